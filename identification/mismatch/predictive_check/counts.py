"""Answers to simulated recordings, counted."""

from collections import Counter
from dataclasses import dataclass, field

from slipbench.identification.mismatch.predictive_check.order import Order
from slipbench.identification.mismatch.predictive_check.outcome import Compared
from slipbench.identification.mismatch.reporting.check_result import Check, OtherAnswer, Rate


@dataclass
class Counts:
    """Answers so far: with the effects, and without."""

    wanted: tuple[str, ...]
    again: list[Compared] = field(default_factory=list)
    alarms: list[bool] = field(default_factory=list)
    failures: list[str] = field(default_factory=list)

    def result(self, order: Order, seconds: float, ended: str) -> Check:
        """Rates of all answers. seconds: wall time; ended: why the check ended."""
        every = self.again
        others = Counter(tuple(sorted(c.names)) for c in every if not c.same)
        return Check(
            order.seed,
            order.count,
            seconds,
            order.limit,
            ended,
            same=Rate(sum(c.same for c in every), len(every)),
            place=Rate(sum(c.place for c in every), len(every)),
            inside=Rate(sum(c.inside for c in every), sum(c.intervals for c in every)),
            false_alarms=Rate(sum(self.alarms), len(self.alarms)),
            effects={n: Rate(sum(c.effects[n] for c in every), len(every)) for n in self.wanted},
            answers=tuple(OtherAnswer(names, n) for names, n in others.most_common()),
            failures=tuple(self.failures),
        )
