"""From recorded trials to a design problem: the path to slip, its set, and what the loop adds.

The nominal model is of the first run; every run of the same actuator is a member of the set.
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

ON_THE_WAY = 0.0003  # s, a status frame and a command frame on a bus that is half full
QUICK = 40.0  # Hz; what slip does above it is noise to a controller


@dataclass(frozen=True)
class Path:
    """What runs of one actuator say. speed: m/s, mean; gain: slip per command at low frequency."""

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
    """Join the runs that excited an actuator; the first one is the nominal motorcycle."""
    used = [(run, answer) for run in runs if (answer := _answer(run, actuator)) is not None]
    if not used:
        return NoPath(f"no run answers how slip follows the {actuator} command")
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
        return NoPath("the first run has no trial file, and so no limits to keep to")
    speed = _speed(nominal)
    problem = Problem(
        model,
        around,
        _extra(nominal, speed, period),
        period,
        _noise(nominal, speed),
        _swing(trial.limits, actuator),
        required,
        _told(nominal, speed, period),
    )
    names = tuple(run.recording.folder.name for run, _ in used)
    return Path(actuator, problem, speed, _gain(used[0][1]), names, trial.limits)


def _answer(run: Identification, actuator: str) -> FrequencyResponse | None:
    if isinstance(run.window, NoExcitation):
        return None
    if excited_actuator(run.recording.trial, run.base, run.window) != actuator:
        return None
    wanted = (f"{actuator}_command", "slip")
    return next((r for r in run.responses if (r.input, r.output) == wanted), None)


def _set(
    model: RationalModel, used: Sequence[tuple[Identification, FrequencyResponse]]
) -> UncertaintySet | NoSet:
    members = [Member(run.recording.folder.name, answer) for run, answer in used]
    return uncertainty_set(model, members)


def _speed(run: Identification) -> float:
    assert not isinstance(run.motion, NoMotion)
    assert not isinstance(run.window, NoExcitation)
    return float(np.nanmean(run.motion.reference[run.window.exciting]))


def _extra(run: Identification, speed: float, period: float) -> float:
    """Delay that the loop adds, s: age of the tooth speed, the command's frame, half a tick.

    The identification sees a tooth speed at the middle of its interval. A controller has it when
    the frame that tells it has come, and holds it until the next one: how old it is then, on
    average, the recording's arrivals tell.
    """
    age = mean_age(run)
    return (_interval(run, speed) if age is None else age) + ON_THE_WAY + 0.5 * period


def _told(run: Identification, speed: float, period: float) -> float:
    """Time from one told slip to the next, s; no less than a period."""
    told = _tellings(run)
    lasts = _interval(run, speed) if told is None else float(np.mean(np.diff(told[0])))
    return max(lasts, period)


def mean_age(run: Identification) -> float | None:
    """Mean age of the newest tooth speed at the bench, s; None where arrivals were not recorded."""
    told = _tellings(run)
    if told is None:
        return None
    heard, of = told
    lasts = np.diff(heard)
    age = heard[:-1] - of[:-1] + 0.5 * lasts
    return float(np.sum(age * lasts) / np.sum(lasts))


def _tellings(run: Identification) -> tuple[FloatArray, FloatArray] | None:
    """When a tooth speed was told, and of when it is (s); of teeth told together, the last."""
    channel = run.recording.channels.get("rear_teeth")
    if channel is None or channel.arrival is None or channel.time.size < 3:
        return None
    middle = run.data.time["rear_teeth"][1:] - 0.5 * np.diff(channel.time)
    arrived = channel.arrival[1:]
    newest = np.append(np.diff(arrived) > 0, True)
    return arrived[newest], middle[newest]


def _interval(run: Identification, speed: float) -> float:
    """Time from tooth to tooth, s; nothing for a wheel speed that came as such."""
    assert not isinstance(run.motion, NoMotion)
    axle = run.motion.axle
    if not (axle.teeth_per_turn and axle.radius):
        return 0.0
    return tooth_interval(speed, axle.radius, axle.teeth_per_turn)


def _noise(run: Identification, speed: float) -> float:
    """Deviation of a slip sample: what the recording shows above `QUICK`, and no less than the
    encoder's timer makes.
    """
    assert not isinstance(run.motion, NoMotion)
    slip = bridged(run.motion.slip.ratio)
    left = slip - low_pass(slip, run.base.rate, QUICK)
    interval = _interval(run, speed)
    timer = TIMER / np.sqrt(6.0) / interval if interval else 0.0
    return float(max(np.std(left[np.isfinite(left)]), timer))


def _swing(limits: Limits, actuator: str) -> float:
    if actuator == "throttle":
        return limits.throttle_deviation
    return 0.5 * (limits.spark[1] - limits.spark[0])


def _gain(answer: FrequencyResponse) -> float:
    """Slip per command where the answer is slow: the believed lines of the lowest octave."""
    f, reliable = answer.frequency, answer.reliable
    lowest = reliable & (f <= 2 * f[reliable][0])
    return float(np.mean(answer.value[lowest].real))
