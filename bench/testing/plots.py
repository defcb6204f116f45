"""Signals around the end of a test as plain data: what a report draws."""

from typing import Any

import numpy as np

from slipbench.bench.testing.bench_bus import BenchBus

BEFORE = 0.1  # s, shown before the first stimulus in the window
LONGEST, SHORTEST = 2.0, 0.25  # s, of a window
MOST_POINTS = 1500  # of one signal; of more, every second or third is shown
MOST_SIGNALS = 8


def plots(bus: BenchBus) -> list[dict[str, Any]]:
    """Name, unit, times (s) and values of each signal that the test read, and what was injected.

    The window ends at the end of the test. It begins before what was injected last, if that is not
    longer ago than LONGEST.
    """
    end = bus.now
    begin = max(0.0, min(_first_mark(bus, end) - BEFORE, end - SHORTEST))
    drawn = []
    for of in list(bus.watched.values())[:MOST_SIGNALS]:
        times, values = bus.traffic.trace(of, begin)
        step = max(1, -(-times.size // MOST_POINTS))
        drawn.append(
            {
                "name": of.name,
                "unit": of.signal.unit,
                "time": np.round(times[::step], 6).tolist(),
                "value": np.round(values[::step], 9).tolist(),
                "begin": begin,
                "end": end,
                "marks": [
                    [max(since, begin), min(until, end), text]
                    for since, until, text in bus.marks
                    if until >= begin and since <= end
                ],
            }
        )
    return drawn


def _first_mark(bus: BenchBus, end: float) -> float:
    recent = [since for since, _, _ in bus.marks if since >= end - LONGEST]
    return min(recent, default=end)
