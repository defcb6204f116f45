"""Tables of misses, intervals without the truth, and weak free curves, by case."""

import math
from collections.abc import Iterable, Sequence

from slipbench.studies.blind_validation.score import ScoredCase, misses, what_is_wrong

GOAL = 0.9
"""Goal of a free curve: share of the held-out improvement of the true effect."""


def every_miss(cases: Iterable[ScoredCase]) -> list[str]:
    """Lines of the table of wrong and missing statements."""
    lines = [
        _row(
            c.case,
            c.category,
            ", ".join(c.truth) or "nothing",
            f"{c.nats:.0f}" if math.isfinite(c.nats) else "",
            what_is_wrong(c),
            ", ".join(c.reported) or "no name",
            c.injection_point or "none",
        )
        for c in misses(cases)
    ]
    return _table(
        (
            "case",
            "category",
            "hidden effect",
            "nats",
            "error",
            "reported effect",
            "injection point",
        ),
        lines,
    )


def every_interval(cases: Iterable[ScoredCase]) -> list[str]:
    """Lines of the table of 95 % intervals that do not contain the truth; SI."""
    lines = [
        _row(
            c.case,
            estimate.effect,
            estimate.parameter,
            f"{estimate.truth:.4g}",
            f"{estimate.low:.4g} to {estimate.high:.4g}",
        )
        for c in cases
        for estimate in c.numbers
        if not estimate.holds
    ]
    return _table(("case", "effect", "parameter", "truth", "interval"), lines)


def every_curve(cases: Iterable[ScoredCase]) -> list[str]:
    """Lines of the table of free curves below their goal, worst first."""
    short = [c for c in cases if c.visible and c.curve < GOAL]
    lines = [
        _row(c.case, ", ".join(c.truth), f"{100 * c.curve:.0f} %")
        for c in sorted(short, key=lambda c: c.curve)
    ]
    return _table(("case", "hidden effect", "share of the true improvement"), lines)


def _table(heads: Sequence[str], lines: Sequence[str]) -> list[str]:
    if not lines:
        return ["None."]
    return [_row(*heads), "|" + "---|" * len(heads), *lines]


def _row(*cells: object) -> str:
    return f"| {' | '.join(map(str, cells))} |".replace("_", " ")
