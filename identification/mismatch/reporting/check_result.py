"""Result of the posterior predictive check: how often a repeated analysis agrees."""

from dataclasses import dataclass, field

from scipy import stats

CONFIDENCE = 0.95
COMPLETE, INTERRUPTED, OUT_OF_TIME = "complete", "interrupted", "time limit"
REPEATABLE = 0.5
"""Rate of equal results that the interval must exceed, or stay below, for a conclusion."""
FALSE_ALARMS = 0.05
"""Stated rate of false alarms (see fit/variance_inflation.py)."""


@dataclass(frozen=True)
class Rate:
    """Relative frequency: count of events in `of` trials."""

    count: int
    of: int

    @property
    def interval(self) -> tuple[float, float]:
        """95 % interval of the rate by Clopper and Pearson (1934); 0 to 1 without trials."""
        if not self.of:
            return 0.0, 1.0
        exact = stats.binomtest(self.count, self.of).proportion_ci(CONFIDENCE, "exact")
        return float(exact.low), float(exact.high)


@dataclass(frozen=True)
class OtherAnswer:
    """A different result of analyses of simulated recordings, and the number of such analyses."""

    names: tuple[str, ...]
    count: int


@dataclass(frozen=True)
class Check:
    """Rates over simulated sets of recordings.

    requested: sets with the effects, and as many without. seconds: wall time; limit: of it, s;
    None: none. same: the same result; place: the same place; effects: each accepted effect, or an
    indistinguishable one; inside: intervals that contain the simulated parameter; false_alarms:
    mismatch detected in simulations without effects. failures: errors of failed analyses, which
    count as different results.
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
    """Return a rate in the form of verdict.json."""
    return {"count": rate.count, "of": rate.of, "interval": list(rate.interval)}


def check_tree(check: Check) -> dict[str, object]:
    """Return a check in the form of verdict.json."""
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
