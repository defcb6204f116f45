"""Table of the tested hypotheses: training and held-out log-likelihood gain, and the verdict."""

from collections.abc import Iterator
from dataclasses import dataclass

from slipbench.identification.mismatch.analysis import Analysis, unexplained
from slipbench.identification.mismatch.naming.named import Named
from slipbench.identification.mismatch.reporting.memo import regressor_in_words
from slipbench.identification.mismatch.reporting.verdict import Verdict
from slipbench.identification.mismatch.thresholds import INDISTINGUISHABLE

SHOWN = 5
"""Number of free curves in the table."""


@dataclass(frozen=True)
class Hypothesis:
    """A row of the table. training, held_out: log-likelihood gain over re-calibration, nats.

    None: not computed.
    """

    name: str
    training: float | None
    held_out: float | None
    verdict: str
    stands: bool = False


def hypotheses(a: Analysis, verdict: Verdict) -> list[Hypothesis]:
    """Return the tested hypotheses, the accepted ones first."""
    rows_of_names = list(_rows_of_names(a.named, verdict, unexplained(a))) if a.named else []
    rows = [*rows_of_names, *_rows_of_curves(a, verdict), *_rows_of_vetoes(verdict)]
    return sorted(rows, key=lambda h: not h.stands)


def _rows_of_names(named: Named, verdict: Verdict, withdrawn: bool) -> Iterator[Hypothesis]:
    if not named.names:
        return
    status = "withdrawn: a residual remains at other values" if withdrawn else "accepted"
    held_out = (
        None if withdrawn or not verdict.improvement else verdict.improvement.log_likelihood_gain
    )
    yield Hypothesis(
        " + ".join(map(_without_underscores, named.names)),
        named.log_likelihood_gain,
        held_out,
        status,
        not withdrawn,
    )
    for accepted_name, nats_behind in named.rivals.items():
        for other, nats in nats_behind.items():
            indistinguishable = nats < INDISTINGUISHABLE
            comparison = (
                "cannot be told apart from it"
                if indistinguishable
                else f"{nats:.0f} nats below {_without_underscores(accepted_name)}"
            )
            name = (
                f"{_without_underscores(other)} in the place of"
                f" {_without_underscores(accepted_name)}"
            )
            yield Hypothesis(name, named.log_likelihood_gain - nats, None, comparison)


def _rows_of_curves(a: Analysis, verdict: Verdict) -> Iterator[Hypothesis]:
    """Yield the free curve that is accepted in the simulation, and the significant located ones."""
    if a.free is not None:
        curve = a.free.curve
        held_out = a.free.confirmed if a.held_out else None
        name = _curve_name(curve.place, curve.regressor)
        yield Hypothesis(
            name, a.free.log_likelihood_gain, held_out, "accepted: no name explains as much", True
        )
    for c in [c for c in a.before if c.significant][:SHOWN]:
        held_out = c.confirmed if a.held_out else None
        yield Hypothesis(
            _curve_name(c.place, c.regressor),
            c.log_likelihood_gain,
            held_out,
            "localizes, not a cause",
        )


def _rows_of_vetoes(verdict: Verdict) -> Iterator[Hypothesis]:
    for veto in verdict.vetoes:
        status = f"rejected: {veto.reason}"
        yield Hypothesis(_without_underscores(veto.name), None, veto.gain, status)


def _curve_name(place: str, regressor: str) -> str:
    return f"free curve at {place}{regressor_in_words(regressor)}"


def _without_underscores(name: str) -> str:
    return name.replace("_", " ")
