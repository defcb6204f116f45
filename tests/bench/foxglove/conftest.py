"""A recorded trial, and what its database decodes it to."""

import math
from contextlib import contextmanager

import pytest

from slipbench.protocol.database.database import load_database
from slipbench.protocol.logs import read_log
from slipbench.protocol.logs.decode import decode, sort_log
from tests.bench.view.recordings import recorded


@pytest.fixture(scope="session")
def run(tmp_path_factory):
    """Run folder of a short trial on the simulated clock."""
    return recorded(tmp_path_factory.mktemp("foxglove"))


def decoded(run, begin=0):
    """Time and values of each frame of each message of a recording of one bus, by topic."""
    log = read_log(run / "frames.log").frames
    found = {}
    known = load_database(run / "database.dbc")
    for name, signals in decode(sort_log(log, known)).items():
        rows = {}
        for signal, samples in signals.items():
            for row, value in zip(samples.rows.tolist(), samples.exact.tolist(), strict=True):
                values = rows.setdefault(row, {})
                if math.isfinite(value):
                    values[signal] = value
        times = [(int(log.time_ns[row]), row) for row in sorted(rows)]
        kept = [(time, rows[row]) for time, row in times if time >= begin]
        if kept:
            found[f"/{log.buses[0]}/{name}"] = kept
    return found


@contextmanager
def served(context, lines):
    """Enter a context that serves a stream; the address that it printed."""
    with context:
        yield next(line for line in lines if "ws://" in line).split()[2]
