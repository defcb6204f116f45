"""What stays unexplained in size, whatever is significant: held-out errors far above their floor.

A noise model can predict each sample from the errors before it, and take for a disturbance what is
missing physics. No test is then significant, and the simulation is wrong all the same.
"""

from slipbench.identification.mismatch.fit.floor import REPEATED
from slipbench.identification.mismatch.fit.held_out import Error
from slipbench.identification.mismatch.reporting.verdict import Location, Verdict
from slipbench.identification.mismatch.simulation.regressor import quantity_of
from slipbench.identification.mismatch.simulation.written_units import WrittenUnits

SHOWN = 2
"""Outputs that are told, those with the largest ratio first."""


def large_errors(verdict: Verdict) -> list[Error]:
    """Return held-out errors that are large with all that was accepted, the largest ratio first."""
    found = [e for e in verdict.held_out if e.large]
    return sorted(found, key=lambda e: -e.improved / max(e.floor, 1e-300))


def large_errors_in_words(verdict: Verdict) -> str:
    """Say how large they are and what may cause them, in a sentence or two; empty without any."""
    found = large_errors(verdict)
    if not found:
        return ""
    told = " and ".join(_error(e, verdict.written) for e in found[:SHOWN])
    more = f" and {len(found) - SHOWN} more" if len(found) > SHOWN else ""
    return f"Held out, the simulation error stays large: {told}{more}. {_cause(found, verdict)}"


def _error(e: Error, written: WrittenUnits) -> str:
    output = e.output.replace("_", " ")
    factor, unit = written.factor(e.unit, output)
    error = f"{factor * e.improved:.3g} {unit}".rstrip()
    return f"{output} {error}, {e.improved / max(e.floor, 1e-300):.2g} times its noise floor"


def _cause(found: list[Error], verdict: Verdict) -> str:
    if all(e.floor_from == REPEATED for e in found):
        return "Repeated trials differ by far less, so physics is missing."
    where = verdict.suspected
    place = f" The best free curve acts at {where.injection}{_along(where)}." if where else ""
    return (
        "Missing physics or a disturbance that changes slowly may cause it: repeat one trial to tell"
        f" them apart.{place}"
    )


def _along(where: Location) -> str:
    return f" along {quantity_of(where.regressor)} (p {where.p_value:.2g}, not significant)"
