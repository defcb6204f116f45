"""A session plan for a vehicle and a straight; every trial was simulated with margin.

The limits follow from the operating point; that on the slip is the lowest which the errors of the
encoder alone do not use up. The amplitude is the largest of a falling series with which the simulated
motorcycle comes to the end of the trial inside limits that are narrower by MARGIN.
"""

import os
import tempfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from slipbench.bench.session.margin_check import narrower, trip_of, written
from slipbench.bench.session.questions import DEGREE, QUESTIONS, Question
from slipbench.bench.session.straight import Fitting, fittings
from slipbench.bench.trials.preparation import prepare
from slipbench.bench.vehicle.virtual_motorcycle import equilibrium_throttle
from slipbench.protocol.errors import InputError
from slipbench.protocol.straight import MARGIN, WINDOW
from slipbench.protocol.trial_file import RPM

LOWER = 0.75  # from one amplitude to the next
LEAST = 0.1  # of the question's amplitude: the response to smaller ones is below the noise
OF_OPENING = 0.35  # of the opening at the operating point: the engine response is linear up to it
DEVIATION = 1.5  # limit on the command over the amplitude
RATE = 1.5  # limit on its rate over the fastest change of the waveform
CLOSED = 0.005  # opening below which the limit on the throttle lies
# Limits on the slip, the lowest first. A tyre slides from about 10 % on; but the gate sees the slip
# of single frames, and misplaced teeth alone can make that several percent at a low speed.
SLIPS = (0.08, 0.10, 0.12, 0.15)
ENGINE_SPEED = (0.80, 1.15)  # limits over the operating point
SPEED = (0.80, 1.15)


@dataclass(frozen=True)
class OperatingPoint:
    """Where the trials of a plan are ridden.

    opening: of the throttle, 0..1, that holds it; slip: limit of the trials; steady: why it is not
    lower, "" where it is the lowest
    """

    vehicle: Path
    fitting: Fitting
    opening: float
    slip: float
    steady: str = ""


@dataclass(frozen=True)
class Proposed:
    """A trial that fits: its question, trial file, and where it is ridden."""

    name: str
    question: Question
    point: OperatingPoint
    file: Mapping[str, Any]

    @property
    def fitting(self) -> Fitting:
        """Gear, speed and time in the straight."""
        return self.point.fitting


def propose(
    vehicle: Path,
    straight: float,
    questions: Mapping[str, Question],
    folder: Path,
    say: Callable[[str], None] = lambda _: None,
) -> tuple[Proposed, ...]:
    """Trials that answer the questions on a straight (m). folder: of the trial files.

    Raises InputError where the straight is too short, or where no amplitude leaves the margin.
    """
    fitting, opening = _operating_point(vehicle, straight)
    point = OperatingPoint(vehicle, fitting, opening, SLIPS[0])
    point = _with_slip_limit(point)
    say(f"limit on the slip: {point.slip:.0%}" + (f"; {point.steady}" if point.steady else ""))
    found = []
    for name, question in questions.items():
        file = _simulated(name, question, point, folder, say)
        found.append(Proposed(name, question, point, file))
    return tuple(found)


def _operating_point(vehicle: Path, straight: float) -> tuple[Fitting, float]:
    """The best operating point at which the motorcycle has a steady state, and its opening."""
    fault = None
    for fitting in fittings(vehicle, straight):
        try:
            return fitting, _opening(vehicle, fitting)
        except InputError as cause:
            fault = cause
    assert fault is not None
    raise fault


def _opening(vehicle: Path, fitting: Fitting) -> float:
    question = QUESTIONS["spark_response"]  # whose limits do not depend on the opening
    point = OperatingPoint(vehicle, fitting, 0.1, SLIPS[0])
    tree = trial_tree("opening", question, point, question.amplitude)
    with tempfile.TemporaryDirectory() as folder:
        return equilibrium_throttle(prepare(written(Path(folder), tree)).scenario)


def _with_slip_limit(point: OperatingPoint) -> OperatingPoint:
    """The point with the lowest limit on the slip that steady riding does not use up.

    Raises InputError where it uses up all of SLIPS.
    """
    question, why, before = QUESTIONS["spark_response"], "", ""
    for slip in SLIPS:
        steady = f"steady riding shows a {before} in single frames" if before else ""
        at = replace(point, slip=slip, steady=steady)
        why = trip_of(narrower(trial_tree("steady", question, at, LEAST * question.amplitude)))
        if not why:
            return at
        before = why
    raise InputError(
        "steady riding does not stay inside the limits in simulation",
        where=str(point.vehicle),
        expected=f"{MARGIN:.0%} of each range left",
        found=why,
        remedy="check the encoders in the vehicle file, or write the trials yourself",
    )


def _simulated(
    name: str, question: Question, point: OperatingPoint, folder: Path, say: Callable[[str], None]
) -> dict[str, Any]:
    """Trial file with the largest amplitude that leaves the margin in simulation."""
    amplitude, why = _largest(question, point.opening), ""
    while amplitude >= LEAST * question.amplitude:
        tree = trial_tree(name, question, point, amplitude)
        why = trip_of(narrower(tree))
        say(f"{name}: {tree['excitation']['amplitude']}: {why or 'inside the limits, with margin'}")
        if not why:
            return {**tree, "vehicle": os.path.relpath(tree["vehicle"], folder.resolve())}
        amplitude *= LOWER
    raise InputError(
        f"no amplitude for {name} stays inside the limits",
        where=str(point.vehicle),
        expected=f"{MARGIN:.0%} of each range left in simulation",
        found=why or f"an opening of {point.opening:.1%} at the operating point",
        remedy="leave this question out, or write its trial yourself",
    )


def _largest(question: Question, opening: float) -> float:
    """Amplitude to begin with: the question's, or what the opening leaves room for."""
    if question.actuator != "throttle":
        return question.amplitude
    return min(question.amplitude, OF_OPENING * opening, (opening - 2 * CLOSED) / DEVIATION)


def trial_tree(
    name: str, question: Question, point: OperatingPoint, amplitude: float
) -> dict[str, Any]:
    """Contents of a trial file. amplitude: opening (0..1) or rad."""
    at = point.fitting
    throttle = question.actuator == "throttle"
    deviation = DEVIATION * (amplitude if throttle else 0.02)
    steepest = RATE * question.steepest * amplitude
    rpm = at.engine_speed / RPM
    return {
        "name": name,
        "description": question.text,
        "vehicle": str(point.vehicle.resolve()),
        "operating_point": {
            "gear": at.gear,
            "engine_speed": f"{rpm:.0f} rpm",
            "engine_speed_window": f"{WINDOW * rpm:.0f} rpm",
            "steady_for": "500 ms",
        },
        "excitation": {
            "actuator": question.actuator,
            "amplitude": _shown(amplitude, throttle),
            **question.waveform(at.duration),
        },
        "limits": {
            "throttle": [f"{100 * CLOSED:g} %", f"{100 * min(point.opening + 0.25, 0.99):.1f} %"],
            "throttle_deviation": f"{100 * deviation:.3f} %",
            "throttle_rate": f"{100 * (steepest if throttle else 1.0):.1f} %/s",
            "spark": ["-12 deg", "6 deg"],
            "spark_rate": f"{(1.0 if throttle else steepest) / DEGREE:.1f} deg/s",
            "engine_speed": [f"{factor * rpm:.0f} rpm" for factor in ENGINE_SPEED],
            "speed": [f"{factor * at.speed:.2f} m/s" for factor in SPEED],
            "slip": f"{100 * point.slip:g} %",
            "distance": f"{at.distance:.0f} m",
        },
    }


def _shown(amplitude: float, throttle: bool) -> str:
    return f"{100 * amplitude:.2f} %" if throttle else f"{amplitude / DEGREE:.2f} deg"
