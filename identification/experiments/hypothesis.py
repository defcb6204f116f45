"""A hypothesis: an effect with the uncertainty of its size, or that nothing is missing."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from slipbench.identification.mismatch.fit.candidate import Candidate
from slipbench.identification.mismatch.fit.sizing import sizes
from slipbench.identification.mismatch.naming.candidates import candidates
from slipbench.identification.mismatch.reporting.open_questions import (
    TYPICAL_SPREAD,
    StatedHypothesis,
)
from slipbench.plant.effects.effect import Effect
from slipbench.plant.errors import PlantError, nearest
from slipbench.protocol.errors import InputError

NOTHING = "nothing"


@dataclass(frozen=True)
class Hypothesis:
    """A hypothesis about the motorcycle.

    candidate: the effect at its most likely size; None: nothing is missing. spread: standard deviation
    of the size, in typical sizes.
    """

    candidate: Candidate | None = None
    spread: float = 0.0

    @property
    def name(self) -> str:
        """Name of the effect with its subject, or "nothing"."""
        return self.candidate.name if self.candidate else NOTHING

    def sizes(self) -> tuple[Candidate, ...]:
        """The effect one deviation below and above its most likely size, never of no interest.

        The mean over these two is the mean over a size with this spread, for what goes with the
        square of the size.
        """
        if self.candidate is None:
            return ()
        if self.spread == 0.0:
            return (self.candidate,)
        size, least = self.candidate.size, self.candidate.smallest
        sign = 1.0 if size > 0.0 else -1.0
        ends = (max(abs(size) - self.spread, least), abs(size) + self.spread)
        return tuple(self.candidate.resized(sign * end) for end in ends)

    def drawn(self, share: float) -> tuple[Effect, ...]:
        """Effects of a motorcycle of which this is true. share: -1..1, of the interval of the size."""
        if self.candidate is None:
            return ()
        size = self.candidate.size
        least = min(abs(size), self.candidate.smallest)
        sign = 1.0 if size > 0.0 else -1.0
        drawn = max(abs(size) + 1.96 * share * self.spread, least)
        return (self.candidate.resized(sign * drawn).effect(),)


def hypotheses_of(
    names: Sequence[str], library: Sequence[type[Effect]], where: str
) -> tuple[Hypothesis, ...]:
    """Hypotheses by name: effects at their typical size. where: an option or file, for messages.

    Raises InputError for an unknown name, and for fewer than two different ones.
    """
    found = tuple(_of(name, library, where) for name in dict.fromkeys(names))
    if len(found) < 2:
        raise InputError(
            "a comparison needs two or more hypotheses",
            where=where,
            expected=f"names of effects with commas, or {NOTHING!r}",
            found=", ".join(names) or "none",
            remedy=f"name another effect, or {NOTHING!r}",
        )
    return found


def stated(one: StatedHypothesis, library: Sequence[type[Effect]], where: str) -> Hypothesis:
    """Hypothesis of a file. Raises InputError where the library has no such effect or other parameters."""
    typical = _of(one.effect, library, where)
    candidate = typical.candidate
    if candidate is None:
        return typical
    if (len(one.dials), len(one.whole)) != (len(candidate.parameters), len(candidate.integers)):
        raise InputError(
            f"{one.effect}: not the numbers of this effect",
            where=where,
            expected=f"{len(candidate.parameters)} dials and {len(candidate.integers)} whole numbers",
            found=f"{len(one.dials)} and {len(one.whole)}",
            remedy="analyse again with this version of slipbench",
        )
    fitted = replace(candidate, parameters=one.dials, integers=one.whole).within()
    return Hypothesis(fitted, one.spread)


def _of(name: str, library: Sequence[type[Effect]], where: str) -> Hypothesis:
    if name == NOTHING:
        return Hypothesis()
    word = name.partition(".")[0]
    for kind in (kind for kind in library if kind.name == word):
        for candidate in _candidates(kind):
            if name in (candidate.name, word):
                return Hypothesis(candidate, TYPICAL_SPREAD * abs(candidate.size))
    raise InputError(
        "no effect has this name",
        where=where,
        found=name,
        remedy=nearest(word, [NOTHING, *(kind.name for kind in library)]),
    )


def _candidates(kind: type[Effect]) -> list[Candidate]:
    try:
        return [c for c in candidates(kind) if sizes(c.kind)]
    except PlantError:
        return []
