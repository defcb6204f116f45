"""Preselection of effects for a screening at another fit, by their responses at the first one.

The response of an effect depends on the motion. Where parameters moved far between the two fits,
the responses differ, and the whole library is screened again: at a time constant of 1.7 s in place
of 0.5 s, an elastic belt had a different response.
"""

from collections.abc import Sequence

import numpy as np

from slipbench.identification.mismatch.fit.candidate import Candidate
from slipbench.identification.mismatch.fit.linearization import Changes, Linearization
from slipbench.identification.mismatch.naming.score_tests import (
    BATCH,
    batches,
    different,
    directions,
    score_tests,
)
from slipbench.identification.mismatch.naming.traces import Traces

AGAIN = 8
"""Number of the most promising effects that are screened again; no more are fitted."""
APART = 3
"""Number of effects of different directions that are screened again."""
HOLDS = 0.9
"""Cosine of the old and the new response of an effect above which the old one is valid."""
SAMPLE = 16
"""Number of effects simulated at the new fit to test validity."""
MOST_HOLD = 0.75
"""Smallest share of valid responses. It was 90 % at fits of motorcycles, and at most 50 % at fits
of two subsystems whose time constant is wrong."""

CurveCandidate = tuple[Candidate, Changes]


def promising_again(linear: Linearization, traces: Traces, most: int = AGAIN) -> set[str] | None:
    """Return the names of effects whose earlier responses explain most of this residual.

    None where those responses are no longer valid.
    """
    best = _best_of_each(linear, traces)
    if not _still_valid(linear, best):
        return None
    earlier_directions = directions(linear, linear.whitened([change for _, change in best[:BATCH]]))
    return {
        best[i][0].name
        for i in {*range(min(most, len(best))), *different(earlier_directions, APART)}
    }


def _best_of_each(linear: Linearization, traces: Traces) -> list[CurveCandidate]:
    """Return the candidate of each effect that explains most here, largest gain first."""
    accepted = {c.name for c in linear.fit.effects}
    gains: dict[str, tuple[float, CurveCandidate]] = {}
    for batch in batches(linear, [t for t in traces.candidates() if t[0].name not in accepted]):
        batch_gains = score_tests(
            linear, linear.whitened([change for _, change in batch])
        ).log_likelihood_gain
        for one, gain in zip(batch, batch_gains, strict=True):
            name = one[0].name
            if name not in gains or gain > gains[name][0]:
                gains[name] = (float(gain), one)
    return [one for _, one in sorted(gains.values(), key=lambda t: -t[0])]


def _still_valid(linear: Linearization, candidates: Sequence[CurveCandidate]) -> bool:
    """Return whether most of a sample of these responses are unchanged at this fit."""
    sample = [
        candidates[i]
        for i in sorted({len(candidates) * k // SAMPLE for k in range(SAMPLE)})
        if candidates
    ]
    if not sample:
        return True
    earlier = directions(linear, linear.whitened([change for _, change in sample]))
    current = directions(linear, linear.effect_responses([candidate for candidate, _ in sample]))
    return float(np.mean(np.einsum("ij,ij->j", earlier, current) > HOLDS)) >= MOST_HOLD
