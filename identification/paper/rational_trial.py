"""Rational functions of a recorded sweep: from an identification to a study, checked in time.

study = study_of(found, "throttle_position", delay=0.010, known=known_path(nominal))
stretches = stretches_of(found, study, bandwidth=2 * np.pi * 10)
"""

import numpy as np

from identification.models.time_check import SHARES, NoStretch, Stretch, time_check
from identification.paper.rational_claims import NOTHING, RationalStudy, rational_study
from identification.response.identify import Identification
from identification.response.independent_lines import KnownPath, NoRational
from identification.signals.filters import bridged
from identification.signals.motion import NoMotion
from identification.signals.swept_phase import NoSweep, swept_phase
from identification.signals.trial_window import NoExcitation
from plant.motorcycle import Motorcycle


def known_path(motorcycle: Motorcycle, input: str = "throttle_position") -> KnownPath:
    """Say what a nominal vehicle knows of the path from an input to slip, beside resonances.

    The filling time of the intake is a lag behind the throttle; the driveline's damping leads by
    c / k.
    """
    spring = motorcycle.driveline
    lags = (motorcycle.intake.filling_time,) if input.startswith("throttle") else ()
    return KnownPath(lags, (spring.damping / spring.stiffness,))


def study_of(
    found: Identification, input: str, delay: float, known: KnownPath = NOTHING
) -> RationalStudy | NoRational:
    """Study the response from an input's role to slip; delay: s, known from the vehicle."""
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
    """Check the likeliest model in time at shares of the bandwidth w_c (rad/s)."""
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
