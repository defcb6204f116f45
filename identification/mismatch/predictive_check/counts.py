"""Counts of the results of analyses of simulated recordings."""

from collections import Counter
from dataclasses import dataclass, field

from slipbench.identification.mismatch.predictive_check.order import Order
from slipbench.identification.mismatch.predictive_check.outcome import Compared
from slipbench.identification.mismatch.reporting.check_result import Check, OtherAnswer, Rate


@dataclass
class Counts:
    """Results so far. wanted: names in the verdict that is checked.

    again: results with effects; alarms: whether a mismatch was detected without effects.
    """

    wanted: tuple[str, ...]
    again: list[Compared] = field(default_factory=list)
    alarms: list[bool] = field(default_factory=list)
    failures: list[str] = field(default_factory=list)

    def result(self, order: Order, seconds: float, end_reason: str) -> Check:
        """Return the rates over all results. seconds: wall time; end_reason: why it stopped."""
        comparisons = self.again
        other_results = Counter(tuple(sorted(c.names)) for c in comparisons if not c.same)
        return Check(
            order.seed,
            order.count,
            seconds,
            order.limit,
            end_reason,
            same=Rate(sum(c.same for c in comparisons), len(comparisons)),
            place=Rate(sum(c.place for c in comparisons), len(comparisons)),
            inside=Rate(sum(c.inside for c in comparisons), sum(c.intervals for c in comparisons)),
            false_alarms=Rate(sum(self.alarms), len(self.alarms)),
            effects={
                n: Rate(sum(c.effects[n] for c in comparisons), len(comparisons))
                for n in self.wanted
            },
            answers=tuple(OtherAnswer(names, n) for names, n in other_results.most_common()),
            failures=tuple(self.failures),
        )
