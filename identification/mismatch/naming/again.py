"""Which effects to screen beside another fit, by what they changed beside the first one.

What an effect changes depends on the motion. Where parameters moved far between the two fits, the
changes differ, and the whole library is screened again: with a time constant of 20 s in the place
of 0.5 s, what an elastic belt changed was unlike what it changes.
"""

from collections.abc import Sequence

import numpy as np

from slipbench.identification.mismatch.fit.candidate import Candidate
from slipbench.identification.mismatch.fit.judge import Changes, Judge
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
HOLD = 0.9
"""Cosine of what an effect changed and what it changes, above which the one tells of the other."""

Try = tuple[Candidate, Changes]


def promising_again(judge: Judge, traces: Traces, most: int = AGAIN) -> set[str] | None:
    """Return names by what their changes, as they were in another fit, explain here.

    None where those changes no longer hold.
    """
    best = _best_of_each(judge, traces)[:BATCH]
    if not _hold(judge, best[:AGAIN]):
        return None
    then = directions(judge, judge.whitened([change for _, change in best]))
    apart = different(then, APART)
    return {best[i][0].name for i in {*range(min(most, len(best))), *apart}}


def _best_of_each(judge: Judge, traces: Traces) -> list[Try]:
    """Return the try of each effect that explains most here, greatest first; those that explain."""
    there = {c.name for c in judge.fit.effects}
    gains: dict[str, tuple[float, Try]] = {}
    for some in batches(judge, [t for t in traces.tries() if t[0].name not in there]):
        found = pushed(judge, judge.whitened([change for _, change in some])).gain
        for one, gain in zip(some, found, strict=True):
            name = one[0].name
            if gain > gains.get(name, (0.0, one))[0]:
                gains[name] = (float(gain), one)
    return [one for _, one in sorted(gains.values(), key=lambda t: -t[0])]


def _hold(judge: Judge, tries: Sequence[Try]) -> bool:
    """Tell whether most of these tries change now what they changed then."""
    if not tries:
        return True
    then = directions(judge, judge.whitened([change for _, change in tries]))
    now = directions(judge, judge.signatures([candidate for candidate, _ in tries]))
    return float(np.median(np.einsum("ij,ij->j", then, now))) > HOLD
