"""The rule by which effects are accepted.

Effects are accepted if the log-likelihood falls by at least ENOUGH nats without each of them, the
size of each is significant at the family-wise level of the search, and held-out recordings that
would contain a significant response do not contradict them.

An effect at the same injection point as another must in addition gain more than the model error of
the other may leave in the residual.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from slipbench.identification.mismatch.fit.candidate import Candidate
from slipbench.identification.mismatch.fit.fitting import Fit, renoised, with_effects
from slipbench.identification.mismatch.fit.held_out import Veto, contradicted
from slipbench.identification.mismatch.fit.hypothesis import Hypothesis
from slipbench.identification.mismatch.naming.interval import significance
from slipbench.identification.mismatch.naming.significance import SignificanceRule
from slipbench.identification.mismatch.simulation.model import Model
from slipbench.identification.mismatch.thresholds import (
    FALSE_ALARM_RATE,
    FORMULA_SHARE,
    LIBRARY_SHARE,
    REQUIRED_GAIN,
)


@dataclass(frozen=True, eq=False)
class Acceptance:
    """tests: independent tests in one screening of the library. screenings: their number.

    found: index of the screening that found an effect, by its name; effects not listed were found
    by the last one. The n-th screening has 1 / (n (n + 1)) of the level, so that all screenings
    together stay below it, whatever their number. An effect keeps the level at which it was found:
    further screenings do not lower its significance.
    """

    tests: int
    held_out: Model | None
    screenings: int = 1
    found: Mapping[str, int] = field(default_factory=dict)

    @property
    def significance_rule(self) -> SignificanceRule:
        """Significance rule for effects found by the last screening."""
        return self._rule_of_screening(self.screenings)

    def is_significant(self, fit: Fit, i: int) -> bool:
        """Return whether effect i of a fit is significant at the level at which it was found."""
        return self._rule_of_effect(fit, i).holds(fit, i)

    def all_significant(self, fit: Fit) -> bool:
        """Return whether all effects of a fit are significant."""
        return self._significant_from(fit, 0, None)

    def _significant_from(self, fit: Fit, first: int, without: Fit | None) -> bool:
        """Return whether the effects from index `first` on are significant.

        without: as for `SignificanceRule.p`. The quick tests come first.
        """
        rules = [(self._rule_of_effect(fit, i), i) for i in range(first, len(fit.candidates))]
        return all(rule.may_hold(fit, i) for rule, i in rules) and all(
            rule.holds(fit, i, without) for rule, i in rules
        )

    def _rule_of_effect(self, fit: Fit, i: int) -> SignificanceRule:
        return self._rule_of_screening(self.found.get(fit.candidates[i].name, self.screenings))

    def _rule_of_screening(self, screening: int) -> SignificanceRule:
        share = 1.0 / (screening * (screening + 1))
        return SignificanceRule(
            FALSE_ALARM_RATE * LIBRARY_SHARE * share / self.tests, self.held_out
        )

    def accepts(self, before: Fit, after: Fit) -> bool:
        """Return whether all new effects of a fit gain enough and are significant."""
        new = after.candidates[len(before.candidates) :]
        gain = after.score - before.score
        if gain < sum(_required_gain(c) for c in new) or any(
            gain < _formula_residual(before, c) for c in new
        ):
            return False
        return self._significant_from(
            after, len(before.candidates), before if len(new) == 1 else None
        )

    def keeps(self, fit: Fit, i: int, lost: Sequence[float]) -> bool:
        """Return whether effect i is kept. lost: loss without each of the effects, nats."""
        effects = zip(lost, fit.candidates, strict=True)
        similar = [nats for nats, c in effects if same_injection_point(fit, c, fit.candidates[i])]
        required = max(REQUIRED_GAIN, FORMULA_SHARE * max(similar, default=0.0))
        return lost[i] >= required and self.is_significant(fit, i)

    def p(self, before: Fit, after: Fit) -> float:
        """Family-wise p of rejected effects; 1 if their gain is too small."""
        if after.score - before.score < REQUIRED_GAIN:
            return 1.0
        value = significance(after, len(before.candidates))
        return max(_family_wise(value, self.significance_rule), FALSE_ALARM_RATE)

    def ps(self, fit: Fit) -> list[float]:
        """Family-wise p of each effect of a fit."""
        levels = [self._rule_of_effect(fit, i) for i in range(len(fit.candidates))]
        return [_family_wise(level.p(fit, i), level) for i, level in enumerate(levels)]

    def veto(self, before: Fit, after: Fit) -> Veto | None:
        """Return the veto of held-out recordings against the new effects of a fit."""
        return None if self.held_out is None else contradicted(before, after, self.held_out)


def _family_wise(p: float, level: SignificanceRule) -> float:
    return min(1.0, p / level.limit * FALSE_ALARM_RATE)


def _required_gain(new: Hypothesis) -> float:
    """Gain required of an effect, nats; larger if placebo locations gain as much."""
    return REQUIRED_GAIN * (new.placebo.inflation if new.placebo else 1.0)


def _formula_residual(fit: Fit, new: Hypothesis) -> float:
    """Gain that inexact formulas of accepted effects may leave to a similar new effect, nats."""
    similar = [c for c in fit.candidates if same_injection_point(fit, c, new)]
    if not similar:
        return 0.0
    others = tuple(c for c in fit.candidates if c not in similar)
    return FORMULA_SHARE * (fit.score - renoised(with_effects(fit, others)).score)


def same_injection_point(fit: Fit, one: Hypothesis, other: Hypothesis) -> bool:
    """Return whether effects share an injection point, or act on a quantity and its only sensor."""
    own_point, other_point = place_of(fit, one), place_of(fit, other)
    if own_point and own_point == other_point:
        return True
    if not (isinstance(one, Candidate) and isinstance(other, Candidate)):
        return False
    sensed = hasattr(one.kind, "measure") or hasattr(other.kind, "measure")
    system, partition = fit.model.system, fit.model.partition
    return sensed and any(
        sum(len(b.outputs) for b in partition.groups if b.subsystem == subsystem) == 1
        and all(system.concerns(c.pattern, partition, subsystem) for c in (one, other))
        for subsystem in partition.subsystems
    )


def place_of(fit: Fit, one: Hypothesis) -> str:
    """Return the injection point of an effect; empty if unknown."""
    return fit.model.system.acts_at(one.pattern) if isinstance(one, Candidate) else ""
