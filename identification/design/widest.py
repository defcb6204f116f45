"""The widest loop that keeps its reserves, by internal model and by PID.

Internal model: the filter's corner is raised until a margin, the set's |W T| or the noise says no.
PID: the greatest integral gain under the same conditions (Astroem and Haegglund 2006, chapter 6:
integral gain is what holds off a lasting disturbance), found by differential evolution from a
fixed seed over logarithms of the gains.
"""

import math
from dataclasses import dataclass, replace

import numpy as np
from scipy import optimize

from controllers.limits import Range
from controllers.pid import Pid
from identification.design.loop import Margins, first_fall
from identification.design.problem import Problem
from identification.design.sampled import sampled
from identification.design.shaping import Shape, shaped
from identification.response.response import ComplexArray
from protocol.channel import FloatArray

CORNERS = np.geomspace(1.0, 60.0, 60)  # Hz
EXTRA_ORDERS = (0, 1, 2)
SEED = 1
WEIGHTS = (1.0, 0.8, 0.6, 0.4, 0.2, 0.0)  # of the reference in the proportional part
PEAK = 1.1  # of the answer to the reference
RANGES = ((0.02, 5.0), (0.3, 100.0), (5e-4, 0.1), (1e-3, 0.05))
"""Of K_p and K_i / s times the path's gain, T_d and T_f in s."""


@dataclass(frozen=True)
class Designed:
    """shape or gains; margins: by member, the nominal loop first; robust: max |W T|; noise:
    deviation of the command for the sensor's noise, in the command's unit; bandwidth: of the
    nominal answer to the reference, Hz, where it first falls through -3 dB."""

    controller: "Shape | Gains"
    margins: dict[str, Margins]
    robust: float
    noise: float
    bandwidth: float


@dataclass(frozen=True)
class NoDesign:
    """Why there is no controller."""

    reason: str


@dataclass(frozen=True)
class Gains:
    """Proportional, integral (1/s), derivative (s) gain and filter time (s) of a PID."""

    proportional: float
    integral: float
    derivative: float
    filter_time: float
    period: float
    reference_weight: float = 1.0

    def response(self, frequency: FloatArray) -> ComplexArray:
        """From error to command, complex, at frequencies in Hz, as `Pid` computes it."""
        z = np.exp(2j * np.pi * np.asarray(frequency) * self.period)
        whole = self.filter_time + self.period
        slope = self.derivative * (1 - 1 / z) / (whole - self.filter_time / z)
        return np.asarray(self.proportional + self.integral * self.period / (z - 1) + slope)

    def reference_response(self, frequency: FloatArray) -> ComplexArray:
        """From reference to command, the loop open: no derivative of the reference."""
        z = np.exp(2j * np.pi * np.asarray(frequency) * self.period)
        weighted = self.reference_weight * self.proportional
        return np.asarray(weighted + self.integral * self.period / (z - 1))

    @property
    def noise_gain(self) -> float:
        """Deviation of the command for white noise of deviation 1, the integral left out."""
        f = np.linspace(0.5, 0.5 / self.period, 500)
        quick = Gains(self.proportional, 0.0, self.derivative, self.filter_time, self.period)
        return float(np.sqrt(np.mean(np.abs(quick.response(f)) ** 2)))

    def controller(self, limits: Range) -> Pid:
        """Return the controller, its command inside limits."""
        track = max(2 * np.sqrt(abs(self.derivative / self.integral)), 0.02)
        return Pid(
            self.proportional, self.integral, self.derivative, limits,
            filter_time=self.filter_time, tracking_time=float(track),
            reference_weight=self.reference_weight,
        )  # fmt: skip


def internal_model(problem: Problem) -> Designed | NoDesign:
    """Raise the corner as far as the problem allows; of all orders the widest loop wins."""
    plant = sampled(problem.model, problem.extra, problem.period)
    if np.any(np.abs(plant.poles) >= 1.0):
        return NoDesign("the model is not stable: an internal model would drift away beside it")
    best: Designed | None = None
    for extra in EXTRA_ORDERS:
        for corner in CORNERS:
            shape = shaped(plant, float(corner), extra)
            if not _allowed(problem, shape):
                break
            found = _told(problem, shape)
            if best is None or found.bandwidth > best.bandwidth:
                best = found
    return best or NoDesign(_why_not(problem, shaped(plant, float(CORNERS[0]), EXTRA_ORDERS[-1])))


def pid(problem: Problem, most: int = 60) -> Designed | NoDesign:
    """Find the PID with the greatest integral gain under the problem's conditions."""
    steady = abs(problem.model.response(np.array([0.2]))[0])
    sign = 1.0 if problem.model.response(np.array([0.2]))[0].real > 0 else -1.0

    def gains(x: FloatArray) -> Gains:
        p, i, d, f = (float(e) for e in np.exp(x))
        return Gains(sign * p / steady, sign * i / steady, sign * p * d / steady, f, problem.period)

    def cost(x: FloatArray) -> float:
        return float(-x[1] + 20.0 * _excess(problem, gains(x)))

    found = optimize.differential_evolution(
        cost, optimize.Bounds(*np.log(RANGES).T), maxiter=most, popsize=10, tol=1e-4,
        rng=np.random.default_rng(SEED), polish=False,
    )  # fmt: skip
    best = _calmed(problem, gains(found.x))
    return _told(problem, best) if _allowed(problem, best) else NoDesign(_why_not(problem, best))


def _calmed(problem: Problem, found: Gains) -> Gains:
    """Weigh the reference as much as its peak allows: a step of the target should not overshoot."""
    path = problem.path(problem.frequency)
    loop = 1 + found.response(problem.frequency) * path
    for weight in WEIGHTS:
        calm = replace(found, reference_weight=weight)
        peak = np.max(np.abs(calm.reference_response(problem.frequency) * path / loop))
        if peak <= PEAK:
            return calm
    return calm


def _allowed(problem: Problem, controller: "Shape | Gains") -> bool:
    quiet = controller.noise_gain * problem.noise <= problem.required.noise * problem.swing
    return quiet and problem.met(controller.response)


def _excess(problem: Problem, controller: Gains) -> float:
    """How far the worst condition is missed, as a logarithm; 0 where all are met."""
    required = problem.required
    noise = controller.noise_gain * problem.noise / (required.noise * problem.swing)
    over = [noise, problem.robust(controller.response)]
    over += [math.exp(5.0 * abs(problem.encircled(controller.response)))]
    for m in problem.loops(controller.response).values():
        over += [m.sensitivity / required.sensitivity, required.gain / m.gain]
        over += [required.phase / max(m.phase, 1e-6)]
    return float(np.sum(np.maximum(np.log(np.maximum(over, 1e-9)), 0.0)))


def _told(problem: Problem, controller: "Shape | Gains") -> Designed:
    return Designed(
        controller, problem.loops(controller.response), problem.robust(controller.response),
        controller.noise_gain * problem.noise, _tracked(problem, controller),
    )  # fmt: skip


def _tracked(problem: Problem, controller: "Shape | Gains") -> float:
    f = problem.frequency
    path = problem.path(f)
    answer = controller.reference_response(f) * path / (1 + controller.response(f) * path)
    return first_fall(f, np.abs(answer))


def _why_not(problem: Problem, slowest: "Shape | Gains") -> str:
    loops = problem.loops(slowest.response)
    name, worst = max(loops.items(), key=lambda item: item[1].sensitivity)
    return (
        f"even the slowest loop keeps too little: {name} has M_s {worst.sensitivity:.2f}, gain "
        f"margin {20 * np.log10(worst.gain):.1f} dB, phase margin {np.degrees(worst.phase):.0f} "
        f"deg; max |W T| is {problem.robust(slowest.response):.2f}"
    )
