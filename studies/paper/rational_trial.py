"""Rational functions of a recorded sweep: study of an identification, and time-domain check.

study = study_of(found, "throttle_position", delay=0.010, known=known_path(nominal))
segments = stretches_of(found, study, bandwidth=2 * np.pi * 10)
"""

import math
from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from slipbench.identification.models.rational_ml import ACROSS
from slipbench.identification.models.time_check import SHARES, NoStretch, Stretch, time_check
from slipbench.identification.response.identify import Identification
from slipbench.identification.response.independent_lines import KnownPath, NoRational
from slipbench.identification.signals.filters import bridged
from slipbench.identification.signals.motion import NoMotion
from slipbench.identification.signals.swept_phase import NoSweep, swept_phase
from slipbench.identification.signals.trial_window import NoExcitation
from slipbench.plant.motorcycle import Motorcycle
from slipbench.studies.paper.rational_claims import NOTHING, RationalStudy, rational_study


def known_path(
    motorcycle: Motorcycle,
    input: str = "throttle_position",
    plus_minus: Mapping[str, float] = MappingProxyType({}),
) -> KnownPath:
    """Prior knowledge from a nominal vehicle of the path from an input to slip, without resonances.

    The filling time of the intake is a lag behind the throttle; the driveline's damping leads by
    c / k. plus_minus: 95 % half widths as a vehicle file has them, SI, by block and parameter.
    """
    spring, filled = motorcycle.driveline, input.startswith("throttle")
    lead = spring.damping / spring.stiffness
    lags = (motorcycle.intake.filling_time,) if filled else ()
    doubts = (
        plus_minus.get("intake.filling_time", 0.0) if filled else 0.0,
        plus_minus.get("driveline.damping", 0.0) / spring.stiffness,
        plus_minus.get("driveline.stiffness", 0.0) / spring.stiffness * lead,
    )
    return KnownPath(lags, (lead,), doubt=math.hypot(*doubts) / ACROSS)


def study_of(
    found: Identification, input: str, delay: float, known: KnownPath = NOTHING
) -> RationalStudy | NoRational:
    """Study of the response from an input's role to slip. delay: s, known from the vehicle."""
    for response in found.responses:
        if (response.input, response.output) == (input, "slip"):
            return rational_study(response, delay, known)
    return NoRational(f"the recording has no response from {input} to slip")


def stretches_of(
    found: Identification,
    study: RationalStudy,
    bandwidth: float,
    shares: tuple[float, ...] = SHARES,
) -> tuple[Stretch | NoStretch, ...]:
    """Time-domain check of the maximum-likelihood model at ratios of w_c (bandwidth, rad/s)."""
    at = tuple(share * bandwidth / (2 * np.pi) for share in shares)
    moved, window = found.motion, found.window
    u = found.base.get(study.lines.input)
    if isinstance(moved, NoMotion) or isinstance(window, NoExcitation) or u is None:
        return tuple(NoStretch(f, "there is no excitation, input or slip to compare") for f in at)
    part = window.record
    swept = swept_phase(bridged(u)[window.exciting], found.base.rate)
    if isinstance(swept, NoSweep):
        return tuple(NoStretch(f, swept.reason) for f in at)
    frequency = np.full(found.base.time.size, np.nan)
    start = window.exciting.start
    frequency[start : start + swept.frequency.size] = swept.frequency
    slip = bridged(moved.slip.ratio)[part]
    model = study.likely.best.fit.model
    return time_check(model, bridged(u)[part], slip, found.base.rate, frequency[part], at)
