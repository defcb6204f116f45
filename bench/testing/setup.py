"""Everything that one test uses, made at the first use of its fixture."""

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Any

from slipbench.bench.bus.opening import BusAddress
from slipbench.bench.testing.bench_bus import BenchBus
from slipbench.bench.testing.bus_recording import BusRecording
from slipbench.bench.testing.devices import Device, join
from slipbench.bench.testing.lines import BITRATE, LiveLine, SimulatedLine
from slipbench.bench.testing.measurements import LATENESS, Measurement
from slipbench.bench.testing.plots import plots
from slipbench.bench.testing.replay_on_bus import ReplayOnBus
from slipbench.bench.testing.stimulus import Stimulus
from slipbench.bench.testing.trial_on_bus import TrialOnBus
from slipbench.bench.testing.xcp.session import XcpOnBus
from slipbench.bench.trials.preparation import Prepared, prepare
from slipbench.bench.trials.simulated_trial import BUS
from slipbench.protocol.database.database import load_database
from slipbench.protocol.database.layout import Database
from slipbench.protocol.errors import InputError
from slipbench.protocol.shipped_files import file_or_shipped

SIMULATED, REAL_TIME = "simulated", "real-time"


@dataclass(frozen=True)
class Choice:
    """Values of the options.

    address   None on the simulated clock
    bitrate   bit/s
    lateness  ms, limit in real time
    """

    address: BusAddress | None
    bitrate: int
    database: Path
    trial: Path
    device: str
    lateness: float = math.inf

    @classmethod
    def of(cls, options: Mapping[str, str]) -> "Choice":
        """Choice of the options by name. Raises InputError where one of them is not valid."""
        clock, bitrate = options["slipbench-clock"], options["slipbench-bitrate"]
        if clock not in (SIMULATED, REAL_TIME):
            raise InputError(
                "--slipbench-clock is not valid",
                expected=f"{SIMULATED} or {REAL_TIME}",
                found=clock,
            )
        if not bitrate.isdigit() or not 10_000 <= int(bitrate) <= BITRATE:
            raise InputError(
                "--slipbench-bitrate is not valid",
                expected=f"10000 to {BITRATE} bit/s",
                found=bitrate,
            )
        interface, channel = options["slipbench-interface"], options["slipbench-channel"]
        live = clock == REAL_TIME
        return cls(
            BusAddress(interface, channel, int(bitrate)) if live else None,
            int(bitrate),
            file_or_shipped(options["slipbench-database"], "database"),
            file_or_shipped(options["slipbench-trial"], "trial"),
            options["slipbench-device"],
            _milliseconds(options["slipbench-lateness"]),
        )


def _milliseconds(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not value > 0:
        raise InputError(
            "--slipbench-lateness is not valid", expected="ms above 0, or inf", found=text
        )
    return value


@lru_cache(16)
def _database(path: Path) -> Database:
    return load_database(path)


@lru_cache(16)
def _prepared(trial: Path, database: Path) -> Prepared:
    return prepare(trial, database)


class Setup:
    """Bus of a test and the parts on it. A part exists once it is used."""

    def __init__(self, choice: Choice, folder: Path, name: str) -> None:
        """Use `choice`; recordings go below `folder`; `name` is that of the test."""
        self._choice, self._folder, self._name = choice, folder, name
        self._used: dict[str, Any] = {}

    @cached_property
    def bus(self) -> BenchBus:
        """The bus and its clock."""
        address = self._choice.address
        database = _database(self._choice.database)
        line = SimulatedLine(self._choice.bitrate) if address is None else LiveLine(address)
        self._used["bus"] = BenchBus(line, database)
        return self._used["bus"]  # type: ignore[no-any-return]

    @property
    def now(self) -> float | None:
        """Time of the bus, s; None where there is none."""
        return self.bus.now if "bus" in self._used else None

    @cached_property
    def prepared(self) -> Prepared:
        """The trial file, read and checked."""
        return _prepared(self._choice.trial, self._choice.database)

    @cached_property
    def vehicle(self) -> Device:
        """The device under test."""
        return join(self.bus, self._choice.device, lambda: self.prepared.scenario)

    @cached_property
    def stimulus(self) -> Stimulus:
        """Stimulus on the bus."""
        self._used["stimulus"] = Stimulus(self.bus)
        return self._used["stimulus"]  # type: ignore[no-any-return]

    @cached_property
    def trial(self) -> TrialOnBus:
        """Trial and gateway on the bus."""
        folder = self._folder / "trial"
        self._used["trial"] = TrialOnBus(self.bus, self.prepared, folder, self._choice.address)
        return self._used["trial"]  # type: ignore[no-any-return]

    @cached_property
    def replay(self) -> ReplayOnBus:
        """Replay on the bus."""
        return ReplayOnBus(self.bus)

    @cached_property
    def xcp(self) -> XcpOnBus:
        """XCP on the bus."""
        self._used["xcp"] = XcpOnBus(self.bus)
        return self._used["xcp"]  # type: ignore[no-any-return]

    @cached_property
    def recording(self) -> BusRecording:
        """Recording of the bus."""
        address = self._choice.address
        channel = BUS if address is None else address.name
        folder = self._folder / "recording"
        database, name = self._choice.database, self._name
        return BusRecording(self.bus, folder, database, name, channel, self._tables)

    def _tables(self) -> dict[str, str]:
        """Tables beside the frames, as CSV text, by name."""
        text = self.xcp.table() if "xcp" in self._used else ""
        return {"xcp": text} if text else {}

    def lateness(self) -> Measurement | None:
        """Maximum lateness of this process; None on the simulated clock."""
        if self._choice.address is None or "bus" not in self._used:
            return None
        late = self.bus.lateness * 1e3
        limit, now = self._choice.lateness, self.bus.now
        return Measurement(LATENESS, late, "ms", at_most=limit, source="its clock", at=now)

    def problems(self) -> list[str]:
        """What makes a test fail at its end although no assertion failed."""
        stimulus, xcp = self._used.get("stimulus"), self._used.get("xcp")
        return [*(stimulus.never_occurred() if stimulus else []), *(xcp.problems() if xcp else [])]

    def plots(self) -> list[dict[str, Any]]:
        """Signals that the test read, at the end of the test, as data for a page."""
        return plots(self.bus) if "bus" in self._used else []

    def keep(self, folder: Path) -> str:
        """Where the recording of this test was saved in `folder`, or why it was not."""
        if "bus" not in self._used or not self.bus.traffic.frames:
            return "no frames to keep"
        name = re.sub(r"\W+", "_", self._name).strip("_")[:100]
        try:
            return str(self.recording.save(folder / name))
        except (InputError, OSError) as fault:
            return f"not kept: {fault}"

    def close(self) -> None:
        """Leave the bus."""
        if "trial" in self._used:
            self._used["trial"].close()
        if "bus" in self._used:
            self._used["bus"].close()
