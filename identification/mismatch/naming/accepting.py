"""Whether an effect is accepted beside those that are: enough nats, and certain of its size."""

from slipbench.identification.mismatch.fit.candidate import Candidate
from slipbench.identification.mismatch.fit.dialled import Dialled
from slipbench.identification.mismatch.fit.fitting import Fit, renoised, with_effects
from slipbench.identification.mismatch.naming.certainty import Certainty

ENOUGH = 12.0  # nats that an effect must bring
INEXACT = 0.05
"""Share of what an effect brings that its formula may leave to others at the same place."""


def passes(before: Fit, after: Fit, certainty: Certainty) -> bool:
    """Tell whether all that is new in a fit brings enough and is certain."""
    new = after.candidates[len(before.candidates) :]
    gain = after.score - before.score
    if gain < sum(_enough(c) for c in new) or any(gain < _inexact(before, c) for c in new):
        return False
    places = range(len(before.candidates), len(after.candidates))
    return all(certainty.holds(after, i) for i in places)


def _enough(new: Dialled) -> float:
    """Nats that an effect must bring; more where as much is found at any other place."""
    return ENOUGH * (new.elsewhere.inflation if new.elsewhere else 1.0)


def _inexact(fit: Fit, new: Dialled) -> float:
    """Nats that the formulas of what is named may leave to a new effect that looks alike."""
    there = [c for c in fit.candidates if alike(fit, c, new)]
    if not there:
        return 0.0
    bare = tuple(c for c in fit.candidates if c not in there)
    return INEXACT * (fit.score - renoised(with_effects(fit, bare)).score)


def alike(fit: Fit, one: Dialled, other: Dialled) -> bool:
    """Tell whether two effects act at one place, or on a quantity and on its only sensor."""
    here, there = place_of(fit, one), place_of(fit, other)
    if here and here == there:
        return True
    if not (isinstance(one, Candidate) and isinstance(other, Candidate)):
        return False
    sensed = hasattr(one.kind, "measure") or hasattr(other.kind, "measure")
    system, chain = fit.model.system, fit.model.chain
    return sensed and any(
        sum(len(b.outputs) for b in chain.blocks if b.drive == drive) == 1
        and all(system.concerns(c.pattern, chain, drive) for c in (one, other))
        for drive in chain.drives
    )


def place_of(fit: Fit, one: Dialled) -> str:
    """Return where an effect acts; empty: not known."""
    return fit.model.system.acts_at(one.pattern) if isinstance(one, Candidate) else ""
