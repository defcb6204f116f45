"""Result of the posterior predictive check: how often the same analysis answers the same."""

from dataclasses import dataclass, field

from scipy import stats

CONFIDENCE = 0.95
COMPLETE, INTERRUPTED, OUT_OF_TIME = "complete", "interrupted", "time limit"
REPEATABLE = 0.5
"""Rate of the same answer which the interval must exceed, or stay below, for a conclusion."""
FALSE_ALARMS = 0.05
"""Stated rate of false alarms (see fit/scatter.py)."""


@dataclass(frozen=True)
class Rate:
    """How often something happened: count, of so many."""

    count: int
    of: int

    @property
    def interval(self) -> tuple[float, float]:
        """Interval of the rate, 95 %, by Clopper and Pearson (1934); 0 to 1 where nothing is known."""
        if not self.of:
            return 0.0, 1.0
        found = stats.binomtest(self.count, self.of).proportion_ci(CONFIDENCE, "exact")
        return float(found.low), float(found.high)


@dataclass(frozen=True)
class OtherAnswer:
    """What an analysis of simulated recordings identified instead, and in how many of them."""

    names: tuple[str, ...]
    count: int


@dataclass(frozen=True)
class Check:
    """Rates over simulated sets of recordings.

    requested: of each kind, with and without the effects. seconds: wall time; limit: of it, s; None: none.
    same: the same answer; place: at the same place; effects: each accepted effect, or one that
    cannot be told apart from it; inside: intervals that contain the simulated parameter;
    false_alarms: something identified where the effects were left out. failures: analyses that
    failed; they count as another answer.
    """

    seed: int
    requested: int
    seconds: float
    limit: float | None
    ended: str
    same: Rate
    place: Rate
    inside: Rate
    false_alarms: Rate
    effects: dict[str, Rate] = field(default_factory=dict)
    answers: tuple[OtherAnswer, ...] = ()
    failures: tuple[str, ...] = ()


def rate_tree(rate: Rate) -> dict[str, object]:
    """Return a rate as verdict.json has it."""
    return {"count": rate.count, "of": rate.of, "interval": list(rate.interval)}


def check_tree(check: Check) -> dict[str, object]:
    """Return a check as verdict.json has it."""
    rates = ("same", "place", "inside", "false_alarms")
    return {
        "seed": check.seed,
        "requested": check.requested,
        "seconds": check.seconds,
        "limit": check.limit,
        "ended": check.ended,
        **{name: rate_tree(getattr(check, name)) for name in rates},
        "effects": [{"name": n, "rate": rate_tree(r)} for n, r in check.effects.items()],
        "answers": [{"names": list(a.names), "count": a.count} for a in check.answers],
        "failures": list(check.failures),
    }
