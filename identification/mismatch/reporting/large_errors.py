"""Report held-out errors far above their noise floor, also without a significant mismatch.

A noise model may predict each sample from the previous errors, and so treat missing physics as a
disturbance. Then no test is significant, although the simulation is wrong.
"""

from slipbench.identification.mismatch.fit.floor import REPEATED
from slipbench.identification.mismatch.fit.held_out import Error
from slipbench.identification.mismatch.reporting.verdict import Location, Verdict
from slipbench.identification.mismatch.simulation.regressor import quantity_of
from slipbench.identification.mismatch.simulation.written_units import WrittenUnits

SHOWN = 2
"""Number of outputs that are reported."""


def large_errors(verdict: Verdict) -> list[Error]:
    """Return the large held-out errors of the improved system, the largest ratio first."""
    errors = [e for e in verdict.held_out if e.large]
    return sorted(errors, key=lambda e: -e.improved / max(e.floor, 1e-300))


def large_errors_in_words(verdict: Verdict) -> str:
    """Report the size and possible causes of large held-out errors; empty without any."""
    errors = large_errors(verdict)
    if not errors:
        return ""
    messages = " and ".join(_error_in_words(e, verdict.written) for e in errors[:SHOWN])
    further = f" and {len(errors) - SHOWN} more" if len(errors) > SHOWN else ""
    return (
        f"Held out, the simulation error stays large: {messages}{further}."
        f" {_cause(errors, verdict)}"
    )


def _error_in_words(e: Error, written: WrittenUnits) -> str:
    output = e.output.replace("_", " ")
    factor, unit = written.factor(e.unit, output)
    error = f"{factor * e.improved:.3g} {unit}".rstrip()
    return f"{output} {error}, {e.improved / max(e.floor, 1e-300):.2g} times its noise floor"


def _cause(errors: list[Error], verdict: Verdict) -> str:
    if all(e.floor_from == REPEATED for e in errors):
        return "Repeated trials differ by far less, so physics is missing."
    suspected = verdict.suspected
    location = (
        f" The best free curve acts at {suspected.injection}{_over_regressor(suspected)}."
        if suspected
        else ""
    )
    return (
        "Missing physics or a disturbance that changes slowly may cause it: repeat one trial to tell"
        f" them apart.{location}"
    )


def _over_regressor(where: Location) -> str:
    return f" along {quantity_of(where.regressor)} (p {where.p_value:.2g}, not significant)"
