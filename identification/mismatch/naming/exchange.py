"""Where names do not suffice, each is exchanged for what explains more beside the others.

One after the other, the best next step need not be on the best way: beside one overflow, an offset
of the sensor explained more of two tanks than the second overflow did; beside both, a bent sensor
explained far more than the offset. So each name is taken out in turn and the library looked through
again for what the others leave.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

from slipbench.identification.mismatch.fit.calibrate import from_far
from slipbench.identification.mismatch.fit.candidate import Candidate
from slipbench.identification.mismatch.fit.fitting import Fit, with_effects
from slipbench.identification.mismatch.fit.held_out import Veto, contradicted
from slipbench.identification.mismatch.fit.judge import Judge
from slipbench.identification.mismatch.fit.scatter import FAMILY, SHARE
from slipbench.identification.mismatch.naming.accepting import ENOUGH
from slipbench.identification.mismatch.naming.ahead import SECONDS, SURVEYS
from slipbench.identification.mismatch.naming.certainty import Certainty
from slipbench.identification.mismatch.naming.naming import MOST, Named
from slipbench.identification.mismatch.naming.score import survey
from slipbench.identification.mismatch.simulation.model import Model
from slipbench.identification.mismatch.simulation.threads import in_threads
from slipbench.plant.effects.effect import Effect
from slipbench.plant.errors import PlantError

ROUNDS = 2
Say = Callable[[str], None]


def exchanged(
    named: Named,
    library: Sequence[type[Effect]],
    held_out: Model | None,
    say: Say,
    vetoes: list[Veto],
) -> Named:
    """Return the names with which more is explained; the same where there are none.

    A new name must bring ENOUGH nats over the old one, be certain over all that is tried, and not
    be contradicted by the held-out recordings. vetoes: what they contradict is added to these.
    """
    tests = survey(Judge.of(named.base), library).tests
    certainty = Certainty(FAMILY * SHARE / ((SURVEYS + ROUNDS * MOST) * tests), held_out)
    for _ in range(ROUNDS):
        better = _better(named, library, certainty, say, vetoes)
        if better is None:
            break
        named = better
    return named


def _better(
    named: Named,
    library: Sequence[type[Effect]],
    certainty: Certainty,
    say: Say,
    vetoes: list[Veto],
) -> Named | None:
    old, held_out = named.fit, certainty.held_out
    for gone in old.candidates:
        say(f"Testing replacements of {gone.name}".replace("_", " "))
    several = in_threads(lambda i: list(_without(old, i, library)), range(len(old.candidates)))
    for new in sorted((f for fits in several for f in fits), key=lambda f: -f.score):
        if new.score < old.score + ENOUGH:
            break
        if not certainty.all_hold(new):
            continue
        against = None if held_out is None else contradicted(named.base, new, held_out)
        if against is None:
            return _renamed(named, new, say)
        vetoes.append(against)
    return None


def _without(fit: Fit, i: int, library: Sequence[type[Effect]]) -> Iterator[Fit]:
    """Yield fits with the most promising effects in the place of one."""
    gone = fit.candidates[i]
    others = (*fit.candidates[:i], *fit.candidates[i + 1 :])
    rest = from_far(with_effects(fit, others))
    scores = survey(Judge.of(rest), library).scores
    for score in [s for s in scores if s.candidate.name != gone.name][:SECONDS]:
        new = _fitted(rest, score.candidate)
        if new is not None:
            yield new


def _fitted(fit: Fit, new: Candidate) -> Fit | None:
    try:
        return from_far(with_effects(fit, (*fit.candidates, new)))
    except PlantError:
        return None


def _renamed(named: Named, new: Fit, say: Say) -> Named:
    """Return the names of the new fit; rivals of those that stay are kept."""
    names = [c.name for c in new.candidates]
    gone = next(n for n in named.names if n not in names)
    come = names[-1]
    nats = new.score - named.fit.score
    say(f"Replaced: {gone} by {come} (log-likelihood gain {nats:.0f} nats)")
    kept = {n: r for n, r in named.rivals.items() if gone not in n.split(" + ")}
    return replace(named, fit=new, rivals={**kept, come: {gone: nats}})
