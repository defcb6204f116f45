"""What fell short in a study, case by case: misses, intervals, free curves."""

import math
from collections.abc import Iterable, Sequence

from slipbench.studies.blind_validation.score import Judged, misses, what_is_wrong

WANTED = 0.9
"""Share of the true physics' held-out gain that a free curve should have."""


def every_miss(cases: Iterable[Judged]) -> list[str]:
    """Lines of a table of everything that was claimed wrongly or not at all."""
    lines = [
        _row(
            c.case,
            c.sort,
            ", ".join(c.truth) or "nothing",
            f"{c.nats:.0f}" if math.isfinite(c.nats) else "",
            what_is_wrong(c),
            ", ".join(c.said) or "no name",
            c.place or "none",
        )
        for c in misses(cases)
    ]
    return _table(("case", "sort", "missing", "nats", "what is wrong", "said", "place"), lines)


def every_interval(cases: Iterable[Judged]) -> list[str]:
    """Lines of a table of every 95 % interval that does not hold the truth; SI."""
    lines = [
        _row(
            c.case,
            told.effect,
            told.parameter,
            f"{told.truth:.4g}",
            f"{told.low:.4g} to {told.high:.4g}",
        )
        for c in cases
        for told in c.numbers
        if not told.holds
    ]
    return _table(("case", "effect", "parameter", "truth", "interval"), lines)


def every_curve(cases: Iterable[Judged]) -> list[str]:
    """Lines of a table of every free curve that gains too little, the worst first."""
    short = [c for c in cases if c.seen and c.curve < WANTED]
    lines = [
        _row(c.case, ", ".join(c.truth), f"{100 * c.curve:.0f} %")
        for c in sorted(short, key=lambda c: c.curve)
    ]
    return _table(("case", "missing", "share of the true gain"), lines)


def _table(heads: Sequence[str], lines: Sequence[str]) -> list[str]:
    if not lines:
        return ["None."]
    return [_row(*heads), "|" + "---|" * len(heads), *lines]


def _row(*cells: object) -> str:
    return f"| {' | '.join(map(str, cells))} |".replace("_", " ")
