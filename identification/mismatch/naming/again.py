"""Which effects to screen beside another fit, by what they changed beside the first one.

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
    pushed,
)
from slipbench.identification.mismatch.naming.traces import Traces

AGAIN = 8
"""Effects that are screened again, the most promising; no more are fitted."""
APART = 3
"""Effects that are screened again because they push in different directions."""
HOLDS = 0.9
"""Cosine of what an effect changed and what it changes, above which the one tells of the other."""
SAMPLE = 16
"""Effects that are simulated to see whether this holds."""
MOST_HOLD = 0.75
"""Share of them of which it must. Beside fits of a motorcycle it held of nine in ten, beside those
of two drives whose time constant is wrong of one in two at most."""

Try = tuple[Candidate, Changes]


def promising_again(linear: Linearization, traces: Traces, most: int = AGAIN) -> set[str] | None:
    """Return names by what their changes, as they were in another fit, explain here.

    None where those changes no longer hold.
    """
    best = _best_of_each(linear, traces)
    if not _hold(linear, best):
        return None
    then = directions(linear, linear.whitened([change for _, change in best[:BATCH]]))
    return {best[i][0].name for i in {*range(min(most, len(best))), *different(then, APART)}}


def _best_of_each(linear: Linearization, traces: Traces) -> list[Try]:
    """Return the try of each effect that explains most here, greatest first."""
    there = {c.name for c in linear.fit.effects}
    gains: dict[str, tuple[float, Try]] = {}
    for some in batches(linear, [t for t in traces.tries() if t[0].name not in there]):
        found = pushed(linear, linear.whitened([change for _, change in some])).gain
        for one, gain in zip(some, found, strict=True):
            name = one[0].name
            if name not in gains or gain > gains[name][0]:
                gains[name] = (float(gain), one)
    return [one for _, one in sorted(gains.values(), key=lambda t: -t[0])]


def _hold(linear: Linearization, tries: Sequence[Try]) -> bool:
    """Tell whether most of these change now what they changed then, by a sample of them."""
    some = [tries[i] for i in sorted({len(tries) * k // SAMPLE for k in range(SAMPLE)}) if tries]
    if not some:
        return True
    then = directions(linear, linear.whitened([change for _, change in some]))
    now = directions(linear, linear.signatures([candidate for candidate, _ in some]))
    return float(np.mean(np.einsum("ij,ij->j", then, now) > HOLDS)) >= MOST_HOLD
