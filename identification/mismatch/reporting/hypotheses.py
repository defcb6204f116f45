"""The table of hypotheses: what was tried, what it gains on both sets of recordings, the verdict."""

from collections.abc import Iterator
from dataclasses import dataclass

from slipbench.identification.mismatch.analysis import Analysis, unexplained
from slipbench.identification.mismatch.naming.named import ALIKE, Named
from slipbench.identification.mismatch.reporting.memo import along
from slipbench.identification.mismatch.reporting.verdict import Verdict

SHOWN = 5
"""Free curves that are listed."""


@dataclass(frozen=True)
class Hypothesis:
    """A line of the table. training, held_out: log-likelihood gain over re-calibration, nats.

    None: not computed.
    """

    name: str
    training: float | None
    held_out: float | None
    verdict: str
    stands: bool = False


def hypotheses(a: Analysis, verdict: Verdict) -> list[Hypothesis]:
    """List what was tried, what stands first."""
    named = list(_of_names(a.named, verdict, unexplained(a))) if a.named else []
    found = [*named, *_of_curves(a, verdict), *_of_vetoes(verdict)]
    return sorted(found, key=lambda h: not h.stands)


def _of_names(named: Named, verdict: Verdict, doubt: bool) -> Iterator[Hypothesis]:
    if not named.names:
        return
    told = "withdrawn: a residual remains at other values" if doubt else "accepted"
    held_out = None if doubt or not verdict.improvement else verdict.improvement.log_likelihood_gain
    yield Hypothesis(
        " + ".join(map(_words, named.names)), named.log_likelihood_gain, held_out, told, not doubt
    )
    for found, behind in named.competing.items():
        for other, nats in behind.items():
            tied = nats < ALIKE
            how = (
                "cannot be told apart from it" if tied else f"{nats:.0f} nats below {_words(found)}"
            )
            name = f"{_words(other)} in the place of {_words(found)}"
            yield Hypothesis(name, named.log_likelihood_gain - nats, None, how)


def _of_curves(a: Analysis, verdict: Verdict) -> Iterator[Hypothesis]:
    """Yield the free curve that stands in the simulation, and those that localize."""
    if a.free is not None:
        curve = a.free.curve
        held_out = a.free.confirmed if a.held_out else None
        name = _curve(curve.place, curve.regressor)
        yield Hypothesis(
            name, a.free.log_likelihood_gain, held_out, "accepted: no name explains as much", True
        )
    for c in [c for c in a.before if c.certain][:SHOWN]:
        held_out = c.confirmed if a.held_out else None
        yield Hypothesis(
            _curve(c.place, c.regressor), c.log_likelihood_gain, held_out, "localizes, not a cause"
        )


def _of_vetoes(verdict: Verdict) -> Iterator[Hypothesis]:
    for veto in verdict.vetoes:
        told = f"rejected: {veto.reason}"
        yield Hypothesis(_words(veto.name), None, veto.gain, told)


def _curve(place: str, regressor: str) -> str:
    return f"free curve at {place}{along(regressor)}"


def _words(name: str) -> str:
    return name.replace("_", " ")
