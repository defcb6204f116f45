"""The rule by which effects are accepted.

Effects are accepted where the log-likelihood falls by at least ENOUGH nats without each of them,
the size of each is certain at the family-wise level of the search, and held-out recordings that
would show them do not contradict them.

An effect beside another at the same place must in addition bring more than the inexact formula of
the other may leave.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from slipbench.identification.mismatch.fit.candidate import Candidate
from slipbench.identification.mismatch.fit.fitting import Fit, renoised, with_effects
from slipbench.identification.mismatch.fit.held_out import Veto, contradicted
from slipbench.identification.mismatch.fit.hypothesis import Hypothesis
from slipbench.identification.mismatch.fit.variance_inflation import FAMILY, SHARE
from slipbench.identification.mismatch.naming.interval import significance
from slipbench.identification.mismatch.naming.significance import SignificanceRule
from slipbench.identification.mismatch.simulation.model import Model

ENOUGH = 12.0  # nats that an effect must bring
INEXACT = 0.05
"""Share of what an effect brings that its formula may leave to others at the same place."""


@dataclass(frozen=True, eq=False)
class Acceptance:
    """tests: independent tries in one screening of the library. screenings: how many there were.

    found: number of the screening that found an effect, by its name; what is missing there was found
    by the last one. The n-th screening has 1 / (n (n + 1)) of the level, so that all of them together
    stay below it, however many there are. An effect keeps the level at which it was found: to look
    for more takes no certainty from it.
    """

    tests: int
    held_out: Model | None
    screenings: int = 1
    found: Mapping[str, int] = field(default_factory=dict)

    @property
    def certainty(self) -> SignificanceRule:
        """How certain the size of what the last screening found must be."""
        return self._certainty(self.screenings)

    def certain(self, fit: Fit, i: int) -> bool:
        """Tell whether effect i of a fit is certain at the level at which it was found."""
        return self._certainty_of(fit, i).holds(fit, i)

    def all_significant(self, fit: Fit) -> bool:
        """Tell whether all effects of a fit are."""
        return all(self.certain(fit, i) for i in range(len(fit.candidates)))

    def _certainty_of(self, fit: Fit, i: int) -> SignificanceRule:
        return self._certainty(self.found.get(fit.candidates[i].name, self.screenings))

    def _certainty(self, number: int) -> SignificanceRule:
        share = 1.0 / (number * (number + 1))
        return SignificanceRule(FAMILY * SHARE * share / self.tests, self.held_out)

    def accepts(self, before: Fit, after: Fit) -> bool:
        """Tell whether all that is new in a fit brings enough and is certain."""
        new = after.candidates[len(before.candidates) :]
        gain = after.score - before.score
        if gain < sum(_enough(c) for c in new) or any(gain < _inexact(before, c) for c in new):
            return False
        places = range(len(before.candidates), len(after.candidates))
        return all(self.certain(after, i) for i in places)

    def keeps(self, fit: Fit, i: int, lost: Sequence[float]) -> bool:
        """Tell whether effect i stays. lost: nats without each of the effects."""
        there = zip(lost, fit.candidates, strict=True)
        beside = [nats for nats, c in there if alike(fit, c, fit.candidates[i])]
        enough = max(ENOUGH, INEXACT * max(beside, default=0.0))
        return lost[i] >= enough and self.certain(fit, i)

    def p(self, before: Fit, after: Fit) -> float:
        """Family-wise p of what was tried in vain; what brings too little does not count at all."""
        if after.score - before.score < ENOUGH:
            return 1.0
        told = significance(after, len(before.candidates))
        return max(_family_wise(told, self.certainty), FAMILY)

    def ps(self, fit: Fit) -> list[float]:
        """Family-wise p of each effect of a fit."""
        levels = [self._certainty_of(fit, i) for i in range(len(fit.candidates))]
        return [_family_wise(level.p(fit, i), level) for i, level in enumerate(levels)]

    def veto(self, before: Fit, after: Fit) -> Veto | None:
        """Return what held-out recordings say against what is new in a fit."""
        return None if self.held_out is None else contradicted(before, after, self.held_out)


def _family_wise(p: float, level: SignificanceRule) -> float:
    return min(1.0, p / level.limit * FAMILY)


def _enough(new: Hypothesis) -> float:
    """Nats that an effect must bring; more where as much is found at any other place."""
    return ENOUGH * (new.placebo.inflation if new.placebo else 1.0)


def _inexact(fit: Fit, new: Hypothesis) -> float:
    """Nats that the formulas of what is named may leave to a new effect that looks alike."""
    there = [c for c in fit.candidates if alike(fit, c, new)]
    if not there:
        return 0.0
    bare = tuple(c for c in fit.candidates if c not in there)
    return INEXACT * (fit.score - renoised(with_effects(fit, bare)).score)


def alike(fit: Fit, one: Hypothesis, other: Hypothesis) -> bool:
    """Tell whether two effects act at one place, or on a quantity and on its only sensor."""
    here, there = place_of(fit, one), place_of(fit, other)
    if here and here == there:
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
    """Return where an effect acts; empty: not known."""
    return fit.model.system.acts_at(one.pattern) if isinstance(one, Candidate) else ""
