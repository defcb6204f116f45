"""What is accepted must be missed and certain beside all else that is, or it goes again."""

from collections.abc import Callable, Sequence

from slipbench.identification.mismatch.fit.fitting import Fit, with_effects
from slipbench.identification.mismatch.naming.accepting import ENOUGH, INEXACT, alike
from slipbench.identification.mismatch.naming.certainty import Certainty
from slipbench.identification.mismatch.naming.full_fits import settled
from slipbench.identification.mismatch.simulation.threads import in_threads

Say = Callable[[str], None]


def pruned(base: Fit, fit: Fit, certainty: Certainty, say: Say) -> Fit:
    """Drop what is not missed or not certain, one after the other; all that stays is certain.

    What goes first may take the certainty of the others with it; then another goes first.
    """
    lost = _lost(fit) if len(fit.candidates) > 1 else [(fit.score - base.score, base)]
    order = sorted(range(len(fit.candidates)), key=lambda i: lost[i][0])
    doomed = [i for i in order if not _stays(fit, i, [x for x, _ in lost], certainty)]
    if not doomed:
        return fit
    good = [i for i in doomed if certainty.all_hold(lost[i][1])]
    first = good[0] if good else doomed[0]
    say(f"Removed by backward elimination: {fit.candidates[first].name}")
    return pruned(base, lost[first][1], certainty, say)


def _lost(fit: Fit) -> list[tuple[float, Fit]]:
    """Return of each effect the nats lost without it, and the fit of the others."""
    sets = [(*fit.candidates[:i], *fit.candidates[i + 1 :]) for i in range(len(fit.candidates))]
    without = in_threads(lambda others: settled(with_effects(fit, others)), sets)
    return [(fit.score - w.score, w) for w in without]


def _stays(fit: Fit, i: int, lost: Sequence[float], certainty: Certainty) -> bool:
    beside = [
        x for x, c in zip(lost, fit.candidates, strict=True) if alike(fit, c, fit.candidates[i])
    ]
    enough = max(ENOUGH, INEXACT * max(beside, default=0.0))
    return lost[i] >= enough and certainty.holds(fit, i)
