"""Select effects to screen at another fit, by what they changed in the outputs at the first one.

What an effect changes depends on the motion. Where parameters moved far between the two fits, the
changes differ, and the whole library is screened again: with a time constant of 1.7 s in the place
of 0.5 s, what an elastic belt changed was unlike what it changes.
"""

from collections.abc import Sequence

import numpy as np

from slipbench.identification.mismatch.fit.candidate import Candidate
from slipbench.identification.mismatch.fit.linearization import Changes, Linearization
from slipbench.identification.mismatch.naming.signatures import (
    BATCH,
    batches,
    different,
    directions,
    score_tests,
)
from slipbench.identification.mismatch.naming.traces import Traces

AGAIN = 8
"""Effects that are screened again, the most promising; no more are fitted."""
APART = 3
"""Effects of different directions that are screened again."""
HOLDS = 0.9
"""Cosine of the old and the new change of an effect, above which the old one is still valid."""
SAMPLE = 16
"""Effects that are simulated at the new fit to test that."""
MOST_HOLD = 0.75
"""Least share of valid changes. It was nine in ten at fits of motorcycles, and one in two at most at
fits of two drives whose time constant is wrong."""

CurveCandidate = tuple[Candidate, Changes]


def promising_again(linear: Linearization, traces: Traces, most: int = AGAIN) -> set[str] | None:
    """Return the names of effects whose changes at another fit explain most of this residual.

    None where those changes are no longer valid.
    """
    best = _best_of_each(linear, traces)
    if not _hold(linear, best):
        return None
    then = directions(linear, linear.whitened([change for _, change in best[:BATCH]]))
    return {best[i][0].name for i in {*range(min(most, len(best))), *different(then, APART)}}


def _best_of_each(linear: Linearization, traces: Traces) -> list[CurveCandidate]:
    """Return the try of each effect that explains most here, greatest first."""
    there = {c.name for c in linear.fit.effects}
    gains: dict[str, tuple[float, CurveCandidate]] = {}
    for some in batches(linear, [t for t in traces.tries() if t[0].name not in there]):
        found = score_tests(
            linear, linear.whitened([change for _, change in some])
        ).log_likelihood_gain
        for one, gain in zip(some, found, strict=True):
            name = one[0].name
            if name not in gains or gain > gains[name][0]:
                gains[name] = (float(gain), one)
    return [one for _, one in sorted(gains.values(), key=lambda t: -t[0])]


def _hold(linear: Linearization, tries: Sequence[CurveCandidate]) -> bool:
    """Return whether most of these change the outputs as they did, by a sample of them."""
    some = [tries[i] for i in sorted({len(tries) * k // SAMPLE for k in range(SAMPLE)}) if tries]
    if not some:
        return True
    then = directions(linear, linear.whitened([change for _, change in some]))
    now = directions(linear, linear.effect_responses([candidate for candidate, _ in some]))
    return float(np.mean(np.einsum("ij,ij->j", then, now) > HOLDS)) >= MOST_HOLD
