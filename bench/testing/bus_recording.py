"""Recording of all that a bus carried during a test, in the run folder that `slipbench` reads."""

import shutil
from collections.abc import Callable, Mapping
from datetime import UTC, datetime
from pathlib import Path

from slipbench import dbc
from slipbench.bench.loop.recorder import candump_line
from slipbench.bench.loop.ring import Slot
from slipbench.bench.testing.bench_bus import BenchBus
from slipbench.protocol.logs.decoded_log import DecodedLog, decode
from slipbench.protocol.recording.database_copy import copy_database
from slipbench.protocol.recording.recording import Recording
from slipbench.protocol.recording.run_folder import (
    FRAMES,
    ROLES,
    TABLES,
    create,
    read,
    versions,
    write_description,
)


class BusRecording:
    """Frames of a bus from its begin on; `save` writes them, `read` and `decode` read them again."""

    def __init__(
        self,
        bus: BenchBus,
        folder: Path,
        database: Path,
        name: str,
        channel: str,
        tables: Callable[[], Mapping[str, str]] = dict,
    ) -> None:
        """Record `bus` for the new `folder`.

        name     of the test
        channel  of the bus
        tables   gives the tables beside the frames, as CSV text by name
        """
        self._bus, self.folder, self._database, self._tables = bus, folder, database, tables
        self._name, self._channel = name, channel
        self.roles = dbc.MOTORBIKE_ROLES

    @property
    def frame_count(self) -> int:
        """Number of frames so far."""
        return len(self._bus.traffic.frames)

    def save(self, folder: Path | None = None) -> Path:
        """Run folder with all frames so far; an older state of this test's own folder is replaced.

        folder: None: that of the test. Raises InputError where another folder exists already.
        """
        if folder is None:
            folder = self.folder
            shutil.rmtree(folder, ignore_errors=True)
        create(folder)
        lines = (candump_line(Slot(*frame), self._channel) for frame in self._bus.traffic.frames)
        (folder / FRAMES).write_text("".join(lines), encoding="ascii")
        copy_database(self._database, folder)
        shutil.copyfile(self.roles, folder / ROLES)
        run = {
            "kind": "test",
            "name": self._name,
            "started": datetime.now(UTC).isoformat(timespec="seconds"),
            "database_sha256": self._bus.database.sha256,
            "start_time_ns": self._bus.traffic.origin_ns,
        }
        clock = "monotonic" if self._bus.real_time else "simulated"
        bus = {"name": self._channel, "clock": clock}
        described = {
            "run": run,
            "bus": bus,
            "versions": versions(),
            "tables": self._write_tables(folder),
        }
        write_description(folder, described)
        return folder

    def _write_tables(self, folder: Path) -> dict[str, str]:
        """Path of each table in the folder, by name."""
        paths = {}
        for name, text in self._tables().items():
            paths[name] = f"{TABLES}/{name}.csv"
            (folder / TABLES).mkdir(exist_ok=True)
            (folder / paths[name]).write_text(text, encoding="utf-8")
        return paths

    def read(self) -> Recording:
        """Channels by role, as `slipbench.read` gives them. Raises InputError without frames."""
        return read(self.save())

    def decode(self) -> DecodedLog:
        """Every signal by "Message.signal", as `slipbench.decode` gives them. Raises InputError."""
        return decode(self.save() / FRAMES, self._database)
