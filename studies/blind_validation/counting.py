"""Rates over all cases with exact 95 % intervals, compared with their goals."""

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
from slipbench.studies.blind_validation.score import ScoredCase

CONFIDENCE = 0.95


@dataclass(frozen=True)
class Figure:
    """A rate over cases, %. low, high: bounds of the goal; 0 and inf: no goal."""

    text: str
    total: int
    percent: float
    interval: tuple[float, float]
    shown: str
    low: float = 0.0
    high: float = math.inf

    @property
    def has_goal(self) -> bool:
        """Whether there is a goal."""
        return self.low > 0.0 or self.high < math.inf

    @property
    def met(self) -> bool | None:
        """Whether the goal is met; None without cases or goal."""
        counts = bool(self.total) and self.has_goal
        return self.low <= self.percent <= self.high if counts else None


def figures(cases: Sequence[ScoredCase]) -> list[Figure]:
    """All rates with their goals."""
    single = (MODERATE, SMALL)

    def of(
        text: str,
        among: Callable[[ScoredCase], bool],
        what: Callable[[ScoredCase], bool],
        low: float = 0.0,
        high: float = math.inf,
    ) -> Figure:
        chosen = [c for c in cases if among(c)]
        return share(text, sum(map(what, chosen)), len(chosen), low, high)

    def visible(*categories: str) -> Callable[[ScoredCase], bool]:
        return lambda c: c.category in categories and bool(c.visible)

    def not_visible(c: ScoredCase) -> bool:
        return c.category != NOTHING and c.expected is False

    numbers = [estimate.holds for c in cases for estimate in c.numbers]
    honest = [e.holds for c in cases for e in c.numbers if not e.careless]
    curves = [c for c in cases if c.visible and math.isfinite(c.curve)]
    return [
        of(
            "False alarms, nothing missing",
            lambda c: c.category == NOTHING,
            lambda c: c.alarm,
            high=2.0,
        ),
        of(
            "... vehicle file with errors up to three deviations",
            lambda c: c.category == NOTHING and c.careless,
            lambda c: c.alarm,
        ),
        of(
            "... tyre with the formula of the simulation",
            lambda c: c.category == NOTHING and c.tyre == NAMES[MAGIC],
            lambda c: c.alarm,
        ),
        of(
            "... tyre with another formula",
            lambda c: c.category == NOTHING and c.tyre != NAMES[MAGIC],
            lambda c: c.alarm,
        ),
        of("Alarms, effect not visible", not_visible, lambda c: c.alarm, high=5.0),
        of("Detected, one effect, moderate", visible(MODERATE), lambda c: c.alarm),
        of("Detected, one effect, small", visible(SMALL), lambda c: c.alarm),
        of("Injection point correct, moderate", visible(MODERATE), lambda c: c.located, low=97.0),
        of("Injection point correct, small", visible(SMALL), lambda c: c.located, low=95.0),
        of(
            "Name or equivalence class correct, moderate",
            visible(MODERATE),
            lambda c: c.named,
            low=97.0,
        ),
        of("Name or equivalence class correct, small", visible(SMALL), lambda c: c.named, low=92.0),
        of("Pairs exact", visible(PAIR), lambda c: c.named, low=95.0),
        of("Triples exact", visible(TRIPLE), lambda c: c.named, low=90.0),
        of("Detected, effect outside the library", visible(ELSE), lambda c: c.alarm, low=95.0),
        of(
            "No wrong name, outside the library",
            visible(ELSE),
            lambda c: not c.wrong_names,
            low=95.0,
        ),
        of("... no name at all", visible(ELSE), lambda c: not c.reported),
        of(
            "Injection point correct, outside the library",
            visible(ELSE),
            lambda c: c.located,
            low=90.0,
        ),
        of(
            "Not excited, reported as such",
            lambda c: c.category == UNEXCITED and c.expected is False,
            lambda c: c.reported_not_excited,
        ),
        share("95 % intervals that contain the truth", sum(numbers), len(numbers), 92.0, 97.0),
        share("... vehicle file as good as it says", sum(honest), len(honest)),
        middle(
            "Share of the true effect's log-likelihood gain, named cases",
            [c.share for c in cases if c.category in single and c.named and math.isfinite(c.share)],
        ),
        middle(
            "Share of the true effect's held-out gain, free curve",
            [c.curve for c in curves],
            low=90.0,
        ),
        middle("... effects without memory", [c.curve for c in curves if not c.memory]),
        middle("... memories and hysteresis", [c.curve for c in curves if c.memory], low=90.0),
    ]


def share(text: str, count: int, total: int, low: float = 0.0, high: float = math.inf) -> Figure:
    """Rate with the exact 95 % interval of Clopper and Pearson."""
    if not total:
        return Figure(text, 0, math.nan, (0.0, 100.0), "no cases", low, high)
    found = stats.binomtest(count, total).proportion_ci(CONFIDENCE, "exact")
    percent = 100.0 * count / total
    interval = 100.0 * float(found.low), 100.0 * float(found.high)
    return Figure(text, total, percent, interval, f"{count}/{total} = {percent:.1f} %", low, high)


def middle(text: str, shares: Sequence[float], low: float = 0.0) -> Figure:
    """Median of shares with its distribution-free 95 % interval (order statistics)."""
    if not shares:
        return Figure(text, 0, math.nan, (0.0, 100.0), "no cases", low)
    ordered, n = np.sort(shares) * 100.0, len(shares)
    first = max(int(stats.binom.ppf(0.5 - CONFIDENCE / 2, n, 0.5)) - 1, 0)
    percent = float(np.median(ordered))
    interval = float(ordered[first]), float(ordered[n - 1 - first])
    return Figure(text, n, percent, interval, f"{percent:.1f} %, median of {n}", low)
