"""Speed of decoding a whole log: slipbench, cantools and asammdf, traffic of the motorcycle.

`python benchmarks/decode.py [frames]` prints one table. All decode every signal of every frame to
physical values, from frames that are in memory. cantools decodes frame by frame, on a part of the
same log, and its time is scaled; asammdf extracts from the same frames as an MDF bus log. The
processor time of this process is measured.
"""

import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from statistics import median

import asammdf
import cantools.database
import numpy as np

from slipbench.dbc import MOTORBIKE
from slipbench.protocol.database.database import load_database
from slipbench.protocol.database.layout import Database
from slipbench.protocol.export.mf4 import write_mf4
from slipbench.protocol.logs.decode import SortedLog, decode, sort_log
from slipbench.protocol.logs.frame_log import FrameLog

FRAMES = 1_000_000
REPETITIONS = 5
PART = 50_000  # frames that cantools decodes


def traffic(database: Database, n: int, seed: int = 1) -> FrameLog:
    """Log of n frames with random bits, mixed by the cycle times."""
    random = np.random.default_rng(seed)
    rates = np.array([1 / (message.cycle_time or 1.0) for message in database.messages])
    chosen = random.choice(len(rates), size=n, p=rates / rates.sum())
    identifiers = np.array([message.identifier for message in database.messages], np.uint32)
    lengths = np.array([message.length for message in database.messages], np.uint8)[chosen]
    data = random.integers(0, 256, (n, 8), np.uint8)
    data[np.arange(8) >= lengths[:, None]] = 0
    none = np.zeros(n, np.bool_)
    return FrameLog(
        time_ns=np.arange(n, dtype=np.int64) * 200_000,
        bus=none.astype(np.uint8),
        identifier=identifiers[chosen],
        extended=none,
        fd=none,
        sent=none,
        length=lengths,
        data=data,
        buses=("can0",),
    )


def ours(log: FrameLog, database: Database) -> None:
    """Decode everything with slipbench."""
    for signals in decode(sort_log(log, database)).values():
        for samples in signals.values():
            samples.value  # noqa: B018 (computed when asked for)


def theirs(log: FrameLog, database: cantools.database.can.Database) -> None:
    """Decode everything with cantools, frame by frame."""
    identifiers, lengths, data = log.identifier.tolist(), log.length.tolist(), log.data.tobytes()
    by_identifier = {message.frame_id: message for message in database.messages}
    for row, (identifier, length) in enumerate(zip(identifiers, lengths, strict=True)):
        by_identifier[identifier].decode(data[8 * row : 8 * row + length], decode_choices=False)


def bus_log(log: FrameLog, database: Database, path: Path) -> asammdf.MDF:
    """The frames as an MDF bus log of asammdf."""
    nothing = SortedLog(log, {}, {}, np.arange(0))
    write_mf4(iter([nothing]), database, path)
    return asammdf.MDF(path)


def extracted(frames: asammdf.MDF) -> None:
    """Decode everything with asammdf."""
    frames.extract_bus_logging({"CAN": [(str(MOTORBIKE), 0)]}).close()


def seconds(action: Callable[[], None], repetitions: int) -> float:
    """Median processor time that an action takes."""
    times = []
    for _ in range(repetitions):
        start = time.process_time()
        action()
        times.append(time.process_time() - start)
    return median(times)


def main(frames: int = FRAMES) -> None:
    """Print the table."""
    database, reference = load_database(MOTORBIKE), cantools.database.load_file(MOTORBIKE)
    assert isinstance(reference, cantools.database.can.Database)
    log = traffic(database, frames)
    part = log.select(np.arange(frames) < PART)
    our_time = seconds(lambda: ours(log, database), REPETITIONS)
    their_time = seconds(lambda: theirs(part, reference), 3) * frames / len(part)
    with tempfile.TemporaryDirectory() as folder:
        opened = bus_log(log, database, Path(folder) / "log.mf4")
        mdf_time = seconds(lambda: extracted(opened), 3)
        opened.close()
    print(f"decode, {frames:,} frames, every signal, median of {REPETITIONS} runs")
    print(f"{'':12}{'s':>10}{'frames/s':>16}")
    for name, taken in (("slipbench", our_time), ("cantools", their_time), ("asammdf", mdf_time)):
        print(
            f"{name:12}{taken:10.3f}{frames / taken:16,.0f}   {taken / our_time:8.1f} x the time of slipbench"
        )


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else FRAMES)
