"""Design problem from recorded trials: path to slip, uncertainty set, additional loop delay.

The nominal model is that of the first run; every run of the same actuator is a member of the set.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from slipbench.controllers.pitch_learner import TIMER
from slipbench.identification.design.problem import Problem, Requirements
from slipbench.identification.models.model_order import all_pole, choose_order
from slipbench.identification.models.rational_model import RationalModel
from slipbench.identification.models.uncertainty_set import (
    Member,
    NoSet,
    UncertaintySet,
    uncertainty_set,
)
from slipbench.identification.response.identify import Identification
from slipbench.identification.response.independent_lines import NoRational, independent_lines
from slipbench.identification.response.response import FrequencyResponse
from slipbench.identification.response.responses import excited_actuator
from slipbench.identification.signals.filters import bridged, low_pass
from slipbench.identification.signals.motion import NoMotion
from slipbench.identification.signals.teeth import tooth_interval
from slipbench.identification.signals.trial_window import NoExcitation
from slipbench.protocol.recording.channel import FloatArray
from slipbench.protocol.trial_file import Limits

TRANSMISSION = 0.0003  # s, a status frame and a command frame on a bus that is half full
NOISE_BAND = 40.0  # Hz; slip above this frequency counts as noise


@dataclass(frozen=True)
class Path:
    """Design data of one actuator. speed: m/s, mean; gain: slip per command at low frequency."""

    actuator: str
    problem: Problem
    speed: float
    gain: float
    names: tuple[str, ...]
    limits: Limits


@dataclass(frozen=True)
class NoPath:
    """Why no controller can be designed on these runs."""

    reason: str


def path_of(
    actuator: str, runs: Sequence[Identification], required: Requirements, period: float
) -> Path | NoPath:
    """Design data from the runs that excited an actuator; the first run is nominal. period: s."""
    used = [(run, frf) for run in runs if (frf := _response(run, actuator)) is not None]
    if not used:
        return NoPath(f"no run contains a frequency response from the {actuator} command to slip")
    nominal = used[0][0]
    lines = independent_lines(used[0][1])
    if isinstance(lines, NoRational):
        return NoPath(f"{nominal.recording.folder.name}: {lines.reason}")
    model = choose_order(lines, all_pole()).best_by_mdl.fit.model
    around = _set(model, used)
    if isinstance(around, NoSet):
        return NoPath(around.reason)
    trial = nominal.recording.trial
    if trial is None:
        return NoPath("the first run has no trial file, which defines the limits of the controller")
    speed = _speed(nominal)
    problem = Problem(
        model,
        around,
        _extra(nominal, speed, period),
        period,
        _noise(nominal, speed),
        _half_range(trial.limits, actuator),
        required,
        _sample_interval(nominal, speed, period),
    )
    names = tuple(run.recording.folder.name for run, _ in used)
    return Path(actuator, problem, speed, _gain(used[0][1]), names, trial.limits)


def _response(run: Identification, actuator: str) -> FrequencyResponse | None:
    if isinstance(run.window, NoExcitation):
        return None
    if excited_actuator(run.recording.trial, run.base, run.window) != actuator:
        return None
    path = (f"{actuator}_command", "slip")
    return next((r for r in run.responses if (r.input, r.output) == path), None)


def _set(
    model: RationalModel, used: Sequence[tuple[Identification, FrequencyResponse]]
) -> UncertaintySet | NoSet:
    members = [Member(run.recording.folder.name, frf) for run, frf in used]
    return uncertainty_set(model, members)


def _speed(run: Identification) -> float:
    assert not isinstance(run.motion, NoMotion)
    assert not isinstance(run.window, NoExcitation)
    return float(np.nanmean(run.motion.reference[run.window.exciting]))


def _extra(run: Identification, speed: float, period: float) -> float:
    """Delay that the loop adds, s: age of the tooth speed, command frame, half a tick.

    The identification assigns a tooth speed to the middle of its interval. The controller receives
    it with the frame that reports it and holds it until the next one. The mean age follows from the
    arrival times in the recording.
    """
    age = mean_age(run)
    return (_interval(run, speed) if age is None else age) + TRANSMISSION + 0.5 * period


def _sample_interval(run: Identification, speed: float, period: float) -> float:
    """Time from one slip sample to the next, s; at least a period."""
    reported = _reported_speeds(run)
    lasts = _interval(run, speed) if reported is None else float(np.mean(np.diff(reported[0])))
    return max(lasts, period)


def mean_age(run: Identification) -> float | None:
    """Mean age of the newest tooth speed at the bench, s; None where arrivals were not recorded."""
    reported = _reported_speeds(run)
    if reported is None:
        return None
    arrival, measured = reported
    lasts = np.diff(arrival)
    age = arrival[:-1] - measured[:-1] + 0.5 * lasts
    return float(np.sum(age * lasts) / np.sum(lasts))


def _reported_speeds(run: Identification) -> tuple[FloatArray, FloatArray] | None:
    """Arrival and measurement time of each tooth speed, s, shape (n,); last tooth of each frame."""
    channel = run.recording.channels.get("rear_teeth")
    if channel is None or channel.arrival is None or channel.time.size < 3:
        return None
    middle = run.data.time["rear_teeth"][1:] - 0.5 * np.diff(channel.time)
    arrived = channel.arrival[1:]
    newest = np.append(np.diff(arrived) > 0, True)
    return arrived[newest], middle[newest]


def _interval(run: Identification, speed: float) -> float:
    """Time from tooth to tooth, s; 0 for a wheel speed that is sent as a speed."""
    assert not isinstance(run.motion, NoMotion)
    axle = run.motion.axle
    if not (axle.teeth_per_turn and axle.radius):
        return 0.0
    return tooth_interval(speed, axle.radius, axle.teeth_per_turn)


def _noise(run: Identification, speed: float) -> float:
    """Standard deviation of a slip sample above `NOISE_BAND`; at least that of the encoder timer."""
    assert not isinstance(run.motion, NoMotion)
    slip = bridged(run.motion.slip.ratio)
    residual = slip - low_pass(slip, run.base.rate, NOISE_BAND)
    interval = _interval(run, speed)
    timer = TIMER / np.sqrt(6.0) / interval if interval else 0.0
    return float(max(np.std(residual[np.isfinite(residual)]), timer))


def _half_range(limits: Limits, actuator: str) -> float:
    if actuator == "throttle":
        return limits.throttle_deviation
    return 0.5 * (limits.spark[1] - limits.spark[0])


def _gain(response: FrequencyResponse) -> float:
    """Low-frequency gain, slip per command: mean of the reliable bins of the lowest octave."""
    f, reliable = response.frequency, response.reliable
    lowest = reliable & (f <= 2 * f[reliable][0])
    return float(np.mean(response.value[lowest].real))
