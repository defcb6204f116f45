"""A hidden case: a motorcycle, hypotheses that its planned trials leave open, and which one is
true.

In even cases the planned trials show that an effect is there, but do not distinguish it from
others. In odd cases they would not show an effect of typical size: it is present, or nothing is.
Which hypotheses these are follows from the evidence that the planned trials are expected to give,
by the thresholds of `explain`.
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import optimize

from slipbench.identification.experiments.evidence import expected_evidence
from slipbench.identification.experiments.hypothesis import NOTHING, Hypothesis, hypotheses_of
from slipbench.identification.mismatch.fit.linearization import Linearization
from slipbench.identification.mismatch.naming.candidates import ROAD
from slipbench.identification.mismatch.naming.plausibility import SENSORS
from slipbench.identification.mismatch.thresholds import EXCITED, INDISTINGUISHABLE, REQUIRED_GAIN
from slipbench.plant.effects.effect import Effect
from slipbench.plant.effects.library import LIBRARY
from slipbench.plant.errors import PlantError
from slipbench.protocol.errors import InputError

RIVALS = 3
SIZES = (0.5, 1.5)
"""Of the typical size, within which the size of an effect that was not excited is drawn."""
SHARES = (0.005, 1.5)
"""Of the typical size, within which a size is sought."""
VISIBLE = (1.2, 3.0)
"""Times the nats that an effect must bring, that the planned trials show of one in an even case."""


class UnsuitableError(Exception):
    """A motorcycle and a plan of which no case can be made. Its text says why."""


@dataclass(frozen=True)
class Case:
    """question: hypotheses that exclude each other; truth: name of the true one; effects: of it."""

    question: tuple[Hypothesis, ...]
    truth: str
    effects: tuple[Effect, ...]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the hypotheses."""
        return tuple(h.name for h in self.question)


def draw_case(rng: np.random.Generator, planned: Sequence[Linearization], alike: bool) -> Case:
    """Case of one of the two kinds. planned: what the planned trials would show of the motorcycle.

    Raises UnsuitableError where they leave nothing open.
    """
    kinds = [kind for kind in LIBRARY if _is_candidate(kind)]
    drawn = [_alone(kinds[i].name) for i in rng.permutation(len(kinds))]
    found = _indistinguishable(rng, planned, drawn) if alike else _not_excited(rng, planned, drawn)
    if found is None:
        raise UnsuitableError("the planned trials leave nothing open")
    return found


def _not_excited(
    rng: np.random.Generator, planned: Sequence[Linearization], drawn: Iterable[Hypothesis]
) -> Case | None:
    """The question whether an effect is there that the planned trials would not show."""
    nothing = Hypothesis()
    for effect in drawn:
        if _nats(planned, (_exact(effect), nothing)) < EXCITED:
            there, share = bool(rng.integers(2)), float(rng.uniform(*SIZES))
            assert effect.candidate is not None
            hidden = (effect.candidate.amplified(share).effect(),) if there else ()
            return Case((effect, nothing), effect.name if there else NOTHING, hidden)
    return None


def _indistinguishable(
    rng: np.random.Generator, planned: Sequence[Linearization], drawn: Iterable[Hypothesis]
) -> Case | None:
    """An effect that the planned trials show, and others indistinguishable from it."""
    nats = REQUIRED_GAIN * float(rng.uniform(*VISIBLE))
    known = [h for one in drawn if (h := _worth(planned, one, nats)) is not None]
    for true in known:
        apart = {h: _nats(planned, (_exact(true), _exact(h))) for h in known if h is not true}
        near = sorted((h for h in apart if apart[h] < INDISTINGUISHABLE), key=apart.__getitem__)[
            :RIVALS
        ]
        if near:
            assert true.candidate is not None
            return Case((true, *near), true.name, (true.candidate.effect(),))
    return None


def _worth(planned: Sequence[Linearization], one: Hypothesis, nats: float) -> Hypothesis | None:
    """A hypothesis so large that the planned trials show it by these nats; None: no size of interest is."""

    def more(log_share: float) -> float:
        return _nats(planned, (_exact(_at(one, math.exp(log_share))), Hypothesis())) - nats

    low, high = map(math.log, SHARES)
    if more(low) >= 0.0 or more(high) <= 0.0:
        return None
    return _at(one, math.exp(float(optimize.bisect(more, low, high, xtol=0.02))))


def _alone(name: str) -> Hypothesis:
    return hypotheses_of([name, NOTHING], LIBRARY, "case")[0]


def _exact(one: Hypothesis) -> Hypothesis:
    return replace(one, spread=0.0)


def _at(one: Hypothesis, share: float) -> Hypothesis:
    """A hypothesis whose size is known to a third about a share of the typical one."""
    assert one.candidate is not None
    sized = one.candidate.amplified(share)
    return Hypothesis(sized, abs(sized.size) / 3.0)


def _nats(planned: Sequence[Linearization], pair: tuple[Hypothesis, Hypothesis]) -> float:
    """Expected evidence of all planned trials together between two hypotheses, nats."""
    try:
        return sum(expected_evidence(linear, [pair]).least for linear in planned)
    except (PlantError, ValueError):
        return math.inf


def _is_candidate(kind: type[Effect]) -> bool:
    """Whether a trial may show an effect: neither of a sensor, nor at a place on the road."""
    if kind.block in SENSORS:
        return False
    try:
        found = hypotheses_of([kind.name, NOTHING], LIBRARY, "library")[0]
    except InputError:
        return False
    on_the_road = any(p.sought and p.unit == ROAD for p in kind.parameters())
    return found.candidate is not None and not on_the_road
