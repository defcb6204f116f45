"""Wall time of an analysis and of its check."""

import time

SLACK = 2.0
"""Default time limit of a check over its expected duration."""
LEAST = 30.0
"""Smallest default time limit of a check, s."""


def seconds() -> float:
    """Return the monotonic wall time, s."""
    return time.monotonic()


def limit_of(expected: float, minutes: float | None) -> float:
    """Return the time limit of a check, s. expected: s; minutes: requested; None: the default."""
    return max(SLACK * expected, LEAST) if minutes is None else 60.0 * minutes


def duration(expected: float) -> str:
    """Return a duration in words. expected: s."""
    return f"{expected:.0f} s" if expected < 90.0 else f"{expected / 60.0:.0f} min"
