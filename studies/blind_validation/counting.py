"""What is counted over all cases, with intervals that assume nothing, beside the goals."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy import stats

from slipbench.studies.blind_validation.generator.case import (
    ELSE,
    MODERATE,
    NOTHING,
    PAIR,
    SMALL,
    TRIPLE,
    UNEXCITED,
)
from slipbench.studies.blind_validation.generator.tyres import MAGIC, NAMES
from slipbench.studies.blind_validation.score import Judged

CONFIDENCE = 0.95


@dataclass(frozen=True)
class Figure:
    """Something counted over cases, %. low, high: what is wanted of it; 0 and inf: nothing."""

    text: str
    total: int
    percent: float
    interval: tuple[float, float]
    shown: str
    low: float = 0.0
    high: float = math.inf

    @property
    def wanted(self) -> bool:
        """Whether there is a goal."""
        return self.low > 0.0 or self.high < math.inf

    @property
    def met(self) -> bool | None:
        """Whether it is what is wanted; None where nothing was counted or wanted."""
        counts = bool(self.total) and self.wanted
        return self.low <= self.percent <= self.high if counts else None


def figures(cases: Sequence[Judged]) -> list[Figure]:
    """Return all that is counted, with the goals that there are."""
    single = (MODERATE, SMALL)

    def of(
        text: str,
        among: Callable[[Judged], bool],
        what: Callable[[Judged], bool],
        low: float = 0.0,
        high: float = math.inf,
    ) -> Figure:
        chosen = [c for c in cases if among(c)]
        return share(text, sum(map(what, chosen)), len(chosen), low, high)

    def visible(*sorts: str) -> Callable[[Judged], bool]:
        return lambda c: c.sort in sorts and bool(c.seen)

    def unseen(c: Judged) -> bool:
        return c.sort != NOTHING and c.expected is False

    numbers = [told.holds for c in cases for told in c.numbers]
    return [
        of(
            "False alarms, nothing missing",
            lambda c: c.sort == NOTHING,
            lambda c: c.alarm,
            high=5.0,
        ),
        of(
            "... where the tyre follows the simulation's formula",
            lambda c: c.sort == NOTHING and c.tyre == NAMES[MAGIC],
            lambda c: c.alarm,
        ),
        of(
            "... where it follows another",
            lambda c: c.sort == NOTHING and c.tyre != NAMES[MAGIC],
            lambda c: c.alarm,
        ),
        of("Alarms where nobody can see anything", unseen, lambda c: c.alarm, high=5.0),
        of("Alarm, one effect, moderate", visible(MODERATE), lambda c: c.alarm),
        of("Alarm, one effect, small", visible(SMALL), lambda c: c.alarm),
        of("Injection point right, moderate", visible(MODERATE), lambda c: c.located, low=95.0),
        of("Injection point right, small", visible(SMALL), lambda c: c.located, low=90.0),
        of("Name or its class right, moderate", visible(MODERATE), lambda c: c.named, low=95.0),
        of("Name or its class right, small", visible(SMALL), lambda c: c.named, low=85.0),
        of("Pairs exact", visible(PAIR), lambda c: c.named, low=85.0),
        of("Triples exact", visible(TRIPLE), lambda c: c.named, low=85.0),
        of("Alarm, effect outside the library", visible(ELSE), lambda c: c.alarm, low=95.0),
        of("No name given, outside the library", visible(ELSE), lambda c: not c.said),
        of("Injection point right, outside the library", visible(ELSE), lambda c: c.located),
        of(
            "Not excited, and said so",
            lambda c: c.sort == UNEXCITED and c.expected is False,
            lambda c: c.said_hidden,
        ),
        share("95 % intervals that hold the truth", sum(numbers), len(numbers), 90.0, 98.0),
        middle(
            "Share of the true effect's held-out gain, where named",
            [c.share for c in cases if c.sort in single and c.named and math.isfinite(c.share)],
        ),
        middle(
            "Share of the true physics' held-out gain, free curve",
            [c.curve for c in cases if c.seen and math.isfinite(c.curve)],
            low=90.0,
        ),
    ]


def share(text: str, count: int, total: int, low: float = 0.0, high: float = math.inf) -> Figure:
    """So many of so many, with Clopper and Pearson's exact 95 % interval."""
    if not total:
        return Figure(text, 0, math.nan, (0.0, 100.0), "none counted", low, high)
    found = stats.binomtest(count, total).proportion_ci(CONFIDENCE, "exact")
    percent = 100.0 * count / total
    interval = 100.0 * float(found.low), 100.0 * float(found.high)
    return Figure(text, total, percent, interval, f"{count}/{total} = {percent:.1f} %", low, high)


def middle(text: str, shares: Sequence[float], low: float = 0.0) -> Figure:
    """Median of shares, with the 95 % interval that their order alone gives."""
    if not shares:
        return Figure(text, 0, math.nan, (0.0, 100.0), "none counted", low)
    ordered, n = np.sort(shares) * 100.0, len(shares)
    first = max(int(stats.binom.ppf(0.5 - CONFIDENCE / 2, n, 0.5)) - 1, 0)
    percent = float(np.median(ordered))
    interval = float(ordered[first]), float(ordered[n - 1 - first])
    return Figure(text, n, percent, interval, f"{percent:.1f} %, median of {n}", low)
