"""Maximum-bandwidth design within the stated margins, by internal model control and by PID.

Internal model: the filter corner is raised until a margin, the robust stability of the set or the
command noise reaches its limit. PID: maximum integral gain under the same conditions (Astroem and
Haegglund 2006, chapter 6: the integral gain determines the rejection of load disturbances), found
by differential evolution from a fixed seed over the logarithms of the gains.
"""

import math
from dataclasses import dataclass

import numpy as np
from scipy import optimize

from slipbench.identification.design.gains import Gains
from slipbench.identification.design.loop import Margins
from slipbench.identification.design.prefilter import Prefilter, quickest
from slipbench.identification.design.problem import LinearController, Problem
from slipbench.identification.design.sampled import sampled
from slipbench.identification.design.shaping import Shape, shaped
from slipbench.identification.response.following import first_fall
from slipbench.protocol.recording.channel import FloatArray

CORNERS = np.geomspace(1.0, 60.0, 60)  # Hz
EXTRA_ORDERS = (0, 1, 2)
SEED = 1
SIMILAR = 1.05  # ratio of bandwidths up to which two loops are compared by their rejection
RANGES = ((0.02, 5.0), (0.3, 100.0), (5e-4, 0.1), (1e-3, 0.05))
"""Of K_p and K_i / s times the path's gain, T_d and T_f in s."""


@dataclass(frozen=True)
class Designed:
    """margins: by member, the nominal loop first; robust: max |W T|; noise: standard deviation of
    the command due to sensor noise, command unit; bandwidth: tracking bandwidth of the nominal loop,
    Hz, -3 dB."""

    controller: LinearController
    prefilter: Prefilter
    margins: dict[str, Margins]
    robust: float
    noise: float
    bandwidth: float


@dataclass(frozen=True)
class NoDesign:
    """Why no controller was found."""

    reason: str


def internal_model(problem: Problem) -> Designed | NoDesign:
    """Internal model controller with the highest rejection bandwidth that the problem allows."""
    plant = sampled(problem.model, problem.extra, problem.period)
    if np.any(np.abs(plant.poles) >= 1.0):
        return NoDesign("the model is not stable: internal model control needs a stable model")
    widest: Shape | None = None
    reach = 0.0
    for extra in EXTRA_ORDERS:
        for corner in CORNERS:
            shape = shaped(plant, float(corner), extra)
            if not allowed(problem, shape):
                break
            rejection = problem.nominal(shape.response).rejection
            if rejection > reach:
                widest, reach = shape, rejection
    if widest is None:
        return NoDesign(why_not(problem, shaped(plant, float(CORNERS[0]), EXTRA_ORDERS[-1])))
    return evaluated(problem, widest)


def pid(problem: Problem, most: int = 60) -> Designed | NoDesign:
    """PID with the largest integral gain that meets the requirements. most: iterations."""
    steady = abs(problem.model.response(np.array([0.2]))[0])
    sign = 1.0 if problem.model.response(np.array([0.2]))[0].real > 0 else -1.0

    def gains(x: FloatArray) -> Gains:
        p, i, d, f = (float(e) for e in np.exp(x))
        return Gains(sign * p / steady, sign * i / steady, sign * p * d / steady, f, problem.period)

    def cost(x: FloatArray) -> float:
        return float(-x[1] + 20.0 * _excess(problem, gains(x)))

    found = optimize.differential_evolution(
        cost,
        optimize.Bounds(*np.log(RANGES).T),
        maxiter=most,
        popsize=10,
        tol=1e-4,
        rng=np.random.default_rng(SEED),
        polish=False,
    )
    best = gains(found.x)
    return evaluated(problem, best) if allowed(problem, best) else NoDesign(why_not(problem, best))


def best(problem: Problem) -> Designed | NoDesign:
    """Better one of internal model control and PID; see `better`."""
    return better(internal_model(problem), pid(problem))


def better(*found: Designed | NoDesign) -> Designed | NoDesign:
    """Design with the highest bandwidth of |T|; among similar ones the best disturbance rejection.

    All meet the same requirements. A loop with 10 % more rejection but a low bandwidth of |T| had
    a much lower tracking bandwidth in simulated rides (6.3 Hz against 10.6 Hz).
    """
    feasible = [d for d in found if isinstance(d, Designed)]
    if not feasible:
        return found[0]
    bandwidth = {id(d): np.nan_to_num(d.margins["nominal"].bandwidth) for d in feasible}
    similar = [d for d in feasible if bandwidth[id(d)] * SIMILAR >= max(bandwidth.values())]
    return max(similar, key=lambda d: d.margins["nominal"].rejection)


def allowed(problem: Problem, controller: LinearController) -> bool:
    """Whether a controller meets every requirement of the problem, command noise included."""
    quiet = (
        problem.command_noise(controller.response) <= problem.required.noise * problem.half_range
    )
    return quiet and problem.met(controller.response)


def _excess(problem: Problem, controller: Gains) -> float:
    """Sum of the logarithmic violations of all requirements; 0 if all are met."""
    required = problem.required
    noise = problem.command_noise(controller.response) / (required.noise * problem.half_range)
    over = [noise, problem.robust(controller.response)]
    over += [math.exp(5.0 * abs(problem.encircled(controller.response)))]
    for m in problem.loops(controller.response).values():
        over += [m.sensitivity / required.sensitivity, required.gain / m.gain]
        over += [required.phase / max(m.phase, 1e-6)]
    return float(np.sum(np.maximum(np.log(np.maximum(over, 1e-9)), 0.0)))


def evaluated(problem: Problem, controller: LinearController) -> Designed:
    """Design with the prefilter and all figures of a controller."""
    prefilter = quickest(problem, controller)
    return Designed(
        controller,
        prefilter,
        problem.loops(controller.response),
        problem.robust(controller.response),
        problem.command_noise(controller.response),
        _tracked(problem, controller, prefilter),
    )


def _tracked(problem: Problem, controller: LinearController, prefilter: Prefilter) -> float:
    f = problem.frequency
    path = problem.path(f)
    closed = controller.reference_response(f) * path / (1 + controller.response(f) * path)
    return first_fall(f, np.abs(prefilter.response(f) * closed))


def why_not(problem: Problem, slowest: LinearController) -> str:
    """Reason why no loop is feasible: worst margins of the slowest one."""
    loops = problem.loops(slowest.response)
    name, worst = max(loops.items(), key=lambda item: item[1].sensitivity)
    return (
        f"even the slowest loop violates the margins: {name} has M_s {worst.sensitivity:.2f}, gain "
        f"margin {20 * np.log10(worst.gain):.1f} dB, phase margin {np.degrees(worst.phase):.0f} "
        f"deg; max |W T| is {problem.robust(slowest.response):.2f}"
    )
