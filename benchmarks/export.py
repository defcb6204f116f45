"""Speed of exporting a recording: raw frames, and with every signal decoded.

`python benchmarks/export.py [frames]`. Processor time from frames in memory to a file, then the
speed of reading the recording itself (candump text).
"""

import shutil
import sys
import tempfile
from functools import partial
from pathlib import Path

from decode import seconds, traffic

from slipbench.dbc import MOTORBIKE
from slipbench.protocol.database.database import load_database
from slipbench.protocol.export.asc import write_asc
from slipbench.protocol.export.blf import write_blf
from slipbench.protocol.export.mcap_file import write_mcap
from slipbench.protocol.export.mf4 import write_mf4
from slipbench.protocol.export.parquet import write_parquet
from slipbench.protocol.logs import read_log
from slipbench.protocol.logs.candump_line import format_frames
from slipbench.protocol.logs.decode import SortedLog, sort_log

FRAMES = 1_000_000
WRITERS = {
    "mf4": write_mf4,
    "blf": write_blf,
    "asc": write_asc,
    "parquet": write_parquet,
    "mcap": write_mcap,
}
SLOW = {"asc": 5, "mcap": 20}  # only a part of the frames


def main(frames: int = FRAMES) -> None:
    """Print the table."""
    database = load_database(MOTORBIKE)
    print(f"export, {frames:,} frames, one run each, frames/s")
    print(f"{'':10}{'raw frames':>16}{'with signals':>16}")
    with tempfile.TemporaryDirectory() as folder:
        for form, write in WRITERS.items():
            log = traffic(database, frames // SLOW.get(form, 1))
            whole = sort_log(log, database)
            alone = SortedLog(log, {}, {}, whole.unknown)
            rates = []
            for what in (alone, whole):
                out = Path(folder) / form
                taken = seconds(partial(write, [what], database, out), 1)
                rates.append(len(log) / taken)
                shutil.rmtree(out) if out.is_dir() else out.unlink()
            with_signals = (
                f"{rates[1]:16,.0f}" if form not in ("asc", "blf") else f"{'no signals':>16}"
            )
            print(f"{form:10}{rates[0]:16,.0f}{with_signals}")
        path = Path(folder) / "frames.log"
        part = traffic(database, frames // 5)
        path.write_bytes(b"".join(format_frames(part)))
        print(f"reading candump text: {len(part) / seconds(lambda: read_log(path), 3):,.0f}")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else FRAMES)
