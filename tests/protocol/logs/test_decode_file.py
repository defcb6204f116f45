"""A log is decoded in portions: the same samples, in memory that does not grow with the log."""

import os
import subprocess
import sys
from functools import partial

import numpy as np
import pytest
from pyarrow import parquet

from slipbench.dbc import MOTORBIKE
from slipbench.protocol.database.database import load_database
from slipbench.protocol.errors import InputError
from slipbench.protocol.logs.candump import candump_pieces
from slipbench.protocol.logs.candump_line import format_line
from slipbench.protocol.logs.decode_file import decode_file
from slipbench.protocol.logs.sample_table import chosen
from tests.paths import ROOT


def lines_of(database, count, seed=3):
    """Candump lines of a database's messages, random bits, 250 us apart."""
    random = np.random.default_rng(seed)
    chosen_ = random.integers(len(database.messages), size=count)
    bits = random.bytes(8 * count)
    for n, number in enumerate(chosen_.tolist()):
        message = database.messages[number]
        payload = bits[8 * n : 8 * n + message.length]
        time_ns = 1_700_000_000_000_000_000 + n * 250_000
        yield format_line(time_ns, "can0", message.identifier, payload)


def samples_of(path):
    """All samples, by message and signal, in order of time."""
    table = parquet.read_table(path).to_pandas()
    return table.sort_values(["message", "signal", "time_ns"], kind="stable").reset_index(drop=True)


def test_portions_give_the_same_samples_as_the_whole(tmp_path, monkeypatch):
    monkeypatch.setattr(
        "slipbench.protocol.logs.candump_pieces", partial(candump_pieces, size=20_000)
    )
    database = load_database(MOTORBIKE)
    (tmp_path / "x.log").write_bytes(b"".join(lines_of(database, 5000)))
    every = chosen(database, [])
    _, whole, count = decode_file(tmp_path / "x.log", database, every, tmp_path / "whole.parquet")
    text, parts, again = decode_file(
        tmp_path / "x.log", database, every, tmp_path / "parts.parquet", at_once=700
    )
    assert whole == parts
    assert (count, text.warnings) == (again, [])
    assert samples_of(tmp_path / "whole.parquet").equals(samples_of(tmp_path / "parts.parquet"))


def test_a_log_without_frames_is_refused_and_leaves_nothing(tmp_path):
    (tmp_path / "x.log").write_bytes(b"(1.0) can0 123#R\n")
    with pytest.raises(InputError, match="no data frames"):
        decode_file(tmp_path / "x.log", load_database(MOTORBIKE), [], tmp_path / "x.parquet")
    assert [path.name for path in tmp_path.iterdir()] == ["x.log"]


LIMITED = """
import resource, sys
from pathlib import Path
from slipbench.dbc import MOTORBIKE
from slipbench.protocol.database.database import load_database
from slipbench.protocol.logs.decode_file import decode_file
import pyarrow.parquet

room = int(sys.argv[3])
held = int(Path("/proc/self/status").read_text().split("VmData:")[1].split()[0]) * 1024
if room:
    resource.setrlimit(resource.RLIMIT_DATA, (held + room, held + room))
database = load_database(MOTORBIKE)
signals = [("EngineStatus", "engine_speed")]
_, tally, _ = decode_file(Path(sys.argv[1]), database, signals, Path(sys.argv[2]), at_once=50_000)
print(tally.frames)
"""


@pytest.mark.skipif(sys.platform != "linux", reason="RLIMIT_DATA and /proc are Linux's")
def test_a_log_larger_than_the_memory_is_decoded(tmp_path):
    """Under a limit that the log exceeds: held whole it fails, in portions it is decoded."""
    block, times = b"".join(lines_of(load_database(MOTORBIKE), 100_000)), 30
    with (tmp_path / "x.log").open("wb") as file:
        for _ in range(times):
            file.write(block)
    room = 110_000_000
    assert (tmp_path / "x.log").stat().st_size > 1.15 * room
    signal = chosen(load_database(MOTORBIKE), ["engine_speed"])[0]
    code = LIMITED.replace('("EngineStatus", "engine_speed")', repr(signal))

    def run(at_once):
        return subprocess.run(
            [
                sys.executable,
                "-c",
                code.replace("50_000", at_once),
                str(tmp_path / "x.log"),
                str(tmp_path / f"{at_once}.parquet"),
                str(room),
            ],
            cwd=ROOT,
            capture_output=True,
            text=True,
            check=False,
            env={**os.environ, "OMP_NUM_THREADS": "1", "MALLOC_ARENA_MAX": "1"},
        )

    done = run("50_000")
    assert done.stdout.strip() == str(100_000 * times), done.stderr[-2000:]
    assert "MemoryError" in run("10_000_000").stderr
