"""Longitudinal slip: how much faster the driven wheel's tread moves than the road beneath it.

lambda = (v_driven - v) / v, zero when the wheel rolls. Near standstill the quotient means nothing,
and beside a reference wheel that stands while the driven one spins it means infinity: there the
slip speed v_driven - v is what can be said.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from slipbench.protocol.recording.channel import FloatArray

LEAST_SPEED = 3.0  # m/s; below it slip is not defined
STANDING = 0.05  # m/s
SPINNING = 0.5  # m/s
Kind = Literal["slip", "slip speed"]


@dataclass(frozen=True)
class Slip:
    """Slip over time.

    ratio      (n,) 1, NaN where it is not defined
    speed      (n,) m/s, driven minus reference, NaN where one of them is not known
    defined    share of the known time in which the ratio is defined
    kind       which of the two a report should show
    statement  what limits it, in words; empty where nothing does
    """

    ratio: FloatArray
    speed: FloatArray
    defined: float
    kind: Kind
    statement: str


def slip(driven: FloatArray, reference: FloatArray, least: float = LEAST_SPEED) -> Slip:
    """Form the slip of two peripheral speeds on one time base. m/s, (n,) each."""
    speed = driven - reference
    known = np.isfinite(speed)
    ratio = slip_ratio(driven, reference, least)
    defined = float(np.isfinite(ratio).sum() / max(known.sum(), 1))
    standing = bool(known.any()) and bool(np.all(np.abs(reference[known]) < STANDING))
    spinning = standing and float(np.max(driven[known])) > SPINNING
    kind: Kind = "slip" if defined > 0 else "slip speed"
    return Slip(ratio, speed, defined, kind, _statement(defined, standing, spinning, least))


def slip_ratio(driven: FloatArray, reference: FloatArray, least: float = LEAST_SPEED) -> FloatArray:
    """Give (driven - reference) / reference; NaN where the reference is below `least` m/s."""
    safe = np.where(reference >= least, reference, np.nan)
    return (driven - safe) / safe


def _statement(defined: float, standing: bool, spinning: bool, least: float) -> str:
    if spinning:
        return (
            "The reference wheels stand while the driven wheels spin: slip is not defined, "
            "the slip speed is given instead."
        )
    if standing:
        return "The vehicle stands: slip is not defined."
    if defined < 0.999:
        return (
            f"Slip is defined at {least * 3.6:.0f} km/h and above, "
            f"{100 * defined:.0f} % of the known time."
        )
    return ""
