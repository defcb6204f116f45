"""From what was commanded and measured to slip: every frequency response that a trial carries.

The input is always what the device says that it applied, never what was intended.
"""

from dataclasses import dataclass

import numpy as np

from slipbench.identification.response.feedback import Feedback, feedback
from slipbench.identification.response.local_polynomial import WINDOW, sweep_response
from slipbench.identification.response.periodic import periodic_response
from slipbench.identification.response.quiet_reference import with_quiet_reference
from slipbench.identification.response.response import FrequencyResponse
from slipbench.identification.signals.dataset import Dataset
from slipbench.identification.signals.filters import bridged
from slipbench.identification.signals.motion import Motion, NoMotion
from slipbench.identification.signals.named import named_signal
from slipbench.identification.signals.slip import Slip
from slipbench.identification.signals.trial_window import TrialWindow
from slipbench.protocol.codec.messages import Authority
from slipbench.protocol.recording.channel import FloatArray
from slipbench.protocol.trial_file import Multisine, Square, Sweep, TrialFile

MOST_UNKNOWN = 0.05  # share of a record that may be bridged for the transform
INPUTS = {
    "throttle": ("throttle_command", "throttle_position"),
    "spark": ("spark_command", "spark_advance"),
}
CONTROLLED = "the trial ran under slip control: in a closed loop the response cannot be identified"
NARROW = 0.05  # of the band, half width of the windows where no trial says what to expect
STILL = 1e-6  # an input that moves less than this did not excite


@dataclass(frozen=True)
class NoResponse:
    """Why a response is not given."""

    input: str
    output: str
    reason: str
    roles: tuple[str, ...] = ()


def excited_actuator(trial: TrialFile | None, base: Dataset, window: TrialWindow) -> str:
    """Name the actuator: from the trial, else from the authority, else the one that moved."""
    if trial is not None and trial.excitation.actuator != "slip":
        return trial.excitation.actuator
    authority = base.get("authority")
    if authority is not None:
        held = np.nanmedian(authority[window.exciting])
        return "spark" if held == Authority.SPARK else "throttle"
    return "throttle" if base.get("throttle_command") is not None else "spark"


def responses(
    base: Dataset, moved: Motion, window: TrialWindow, trial: TrialFile | None
) -> tuple[FrequencyResponse | NoResponse, ...]:
    """Estimate command to slip first, then measured position to slip, then command to position."""
    actuator = excited_actuator(trial, base, window)
    command, measured = INPUTS[actuator]
    pairs = [(command, "slip"), (measured, "slip"), (command, measured)]
    found = [response_between(base, moved, window, trial, pair) for pair in pairs]
    found = [_quietened(one, base, moved, window, trial) for one in found]
    looped = _closed_loop(found[0], base, moved.slip, window)
    if looped is not None or (trial is not None and trial.controller is not None):
        reason = looped.reason if looped is not None else CONTROLLED
        found[:2] = [NoResponse(*pair, reason) for pair in pairs[:2]]
    return tuple(found)


def _closed_loop(
    of: FrequencyResponse | NoResponse, base: Dataset, slip: Slip, window: TrialWindow
) -> Feedback | None:
    if isinstance(of, NoResponse):
        return None
    part = window.exciting
    return feedback(bridged(base.signals[of.input])[part], bridged(slip.ratio)[part], base.rate, of)


def chosen_response(
    base: Dataset,
    moved: Motion | NoMotion,
    window: TrialWindow,
    trial: TrialFile | None,
    pair: tuple[str, str],
) -> tuple[FrequencyResponse | NoResponse, ...]:
    """Response of an output to an input that the user selected, also where the loop is closed.

    Feedback from output to input then stands beside it as a `NoResponse`: the response is biased.
    """
    found = response_between(base, moved, window, trial, pair)
    if isinstance(found, NoResponse):
        return (found,)
    part = window.exciting
    u, y = (named_signal(base, moved, name) for name in pair)
    assert u is not None
    assert y is not None
    looped = feedback(bridged(u)[part], bridged(y)[part], base.rate, found)
    return (found,) if looped is None else (found, NoResponse(*pair, looped.reason))


def response_between(
    base: Dataset,
    moved: Motion | NoMotion,
    window: TrialWindow,
    trial: TrialFile | None,
    pair: tuple[str, str],
) -> FrequencyResponse | NoResponse:
    """Response between two signals by name in a window, or why there is none."""
    u, y = pair
    given, taken = (named_signal(base, moved, name) for name in pair)
    absent = tuple(role for role, x in ((u, given), (y, taken)) if x is None)
    if given is None or taken is None:
        return NoResponse(u, y, "not recorded", absent)
    for role, x in ((u, given), (y, taken)):
        unknown = float(np.mean(~np.isfinite(x[window.record])))
        if unknown > MOST_UNKNOWN:
            return NoResponse(u, y, f"{100 * unknown:.0f} % of {role} is not known in the trial")
    if np.nanstd(given[window.exciting]) < STILL:
        return NoResponse(u, y, f"{u} did not move during the excitation")
    try:
        return _estimate(bridged(given), bridged(taken), base.rate, window, trial, (u, y))
    except ValueError as fault:
        return NoResponse(u, y, str(fault))


def _quietened(
    of: FrequencyResponse | NoResponse,
    base: Dataset,
    moved: Motion,
    window: TrialWindow,
    trial: TrialFile | None,
) -> FrequencyResponse | NoResponse:
    """Take the reference's noise off a sweep's response of slip, where the reference is whole."""
    spec = trial.excitation if trial is not None else None
    if isinstance(of, NoResponse) or of.output != "slip" or not isinstance(spec, Sweep | None):
        return of
    signals = [base.signals[of.input], moved.slip.ratio, moved.driven, moved.reference]
    u, y, driven, reference = (bridged(x)[window.record] for x in signals)
    band = _band(u, spec, window, base.rate)
    return with_quiet_reference(of, u, y, driven, reference, base.rate, band)


def _band(
    u: FloatArray, spec: Sweep | None, window: TrialWindow, rate: float
) -> tuple[float, float]:
    """Band of a sweep; of what was recorded without a trial, that of the input. Hz."""
    if spec is None:
        return _band_of(u, rate)
    return swept_band(spec, (window.exciting.stop - window.exciting.start) / rate)


def _estimate(
    u: FloatArray,
    y: FloatArray,
    rate: float,
    window: TrialWindow,
    trial: TrialFile | None,
    names: tuple[str, str],
) -> FrequencyResponse:
    spec = trial.excitation if trial is not None else None
    part, whole = window.exciting, window.record
    match spec:
        case Multisine():
            n = np.arange(1.0, np.floor(spec.highest * spec.period + 1e-9) + 1, 2)
            lines = n[n >= spec.lowest * spec.period - 1e-9]
            return periodic_response(u[part], y[part], rate, spec.period, lines, names)
        case Square():
            lines = np.arange(1.0, max(2.0, 0.05 * rate / spec.frequency), 2)
            return periodic_response(u[part], y[part], rate, 1 / spec.frequency, lines, names)
        case Sweep():
            band = _band(u[whole], spec, window, rate)
            return sweep_response(u[whole], y[whole], rate, band, names)
        case None:  # the band may be as narrow as a rider's hand is slow
            band = _band(u[whole], spec, window, rate)
            return sweep_response(u[whole], y[whole], rate, band, names, _half_width(band))


def _half_width(band: tuple[float, float]) -> float:
    """Half width of the windows where no trial says what to expect, Hz. band: Hz.

    Not wider than the lowest frequency: a window over a decade takes the bend of a slow pole for a
    parabola. Of a plate with a time constant of 300 s, heated in steps, 13 % of the 95 % intervals
    below 0.006 Hz held the truth with windows of 5 % of the band, and 87 % do so now.
    """
    return min(WINDOW, NARROW * (band[1] - band[0]), band[0])


def swept_band(spec: Sweep, lasted: float) -> tuple[float, float]:
    """Frequencies that a sweep passed in the time that it was given. Hz."""
    share = min(lasted / spec.duration, 1.0)
    if spec.waveform == "linear_sweep":
        reached = spec.start + share * (spec.stop - spec.start)
    else:
        reached = spec.start * (spec.stop / spec.start) ** share
    return min(spec.start, reached), max(spec.start, reached)


def _band_of(u: FloatArray, rate: float) -> tuple[float, float]:
    """Band that holds all but one percent of an input's power at each end. Hz."""
    power = np.cumsum(np.abs(np.fft.rfft(u - u.mean())) ** 2)
    low, high = np.searchsorted(power, (0.01 * power[-1], 0.99 * power[-1]))
    return float(low * rate / u.size), float(high * rate / u.size)
