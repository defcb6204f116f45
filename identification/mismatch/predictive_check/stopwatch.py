"""Wall time of an analysis and of its check: what a user waits for."""

import time

SLACK = 2.0
"""Times the expected duration that a check may take where no limit is given."""
LEAST = 30.0
"""Limit of the shortest check, s."""


def seconds() -> float:
    """Wall time since some instant, s."""
    return time.monotonic()


def limit_of(expected: float, minutes: float | None) -> float:
    """Limit of a check, s. expected: s; minutes: requested limit; None: twice what is expected."""
    return max(SLACK * expected, LEAST) if minutes is None else 60.0 * minutes


def duration(expected: float) -> str:
    """A duration in words. expected: s."""
    return f"{expected:.0f} s" if expected < 90.0 else f"{expected / 60.0:.0f} min"
