"""The widest loop that keeps its reserves, by internal model and by PID.

Internal model: the filter's corner is raised until a margin, the set's |W T| or the noise says no.
PID: the greatest integral gain under the same conditions (Astroem and Haegglund 2006, chapter 6:
integral gain is what holds off a lasting disturbance), found by differential evolution from a
fixed seed over logarithms of the gains.
"""

import math
from dataclasses import dataclass

import numpy as np
from scipy import optimize

from slipbench.identification.design.gains import Gains
from slipbench.identification.design.loop import Margins
from slipbench.identification.design.prefilter import Prefilter, quickest
from slipbench.identification.design.problem import Answering, Problem
from slipbench.identification.design.sampled import sampled
from slipbench.identification.design.shaping import Shape, shaped
from slipbench.identification.response.following import first_fall
from slipbench.protocol.recording.channel import FloatArray

CORNERS = np.geomspace(1.0, 60.0, 60)  # Hz
EXTRA_ORDERS = (0, 1, 2)
SEED = 1
ALIKE = 1.05  # two loops whose |T| reaches as far but for this are chosen by their rejection
RANGES = ((0.02, 5.0), (0.3, 100.0), (5e-4, 0.1), (1e-3, 0.05))
"""Of K_p and K_i / s times the path's gain, T_d and T_f in s."""


@dataclass(frozen=True)
class Designed:
    """shape or gains; margins: by member, the nominal loop first; robust: max |W T|; noise:
    deviation of the command for the sensor's noise, in the command's unit; bandwidth: of the
    nominal answer to the target, Hz, where it first falls through -3 dB."""

    controller: Answering
    prefilter: Prefilter
    margins: dict[str, Margins]
    robust: float
    noise: float
    bandwidth: float


@dataclass(frozen=True)
class NoDesign:
    """Why there is no controller."""

    reason: str


def internal_model(problem: Problem) -> Designed | NoDesign:
    """Raise the corner as far as the problem allows; of all orders the one that holds most off."""
    plant = sampled(problem.model, problem.extra, problem.period)
    if np.any(np.abs(plant.poles) >= 1.0):
        return NoDesign("the model is not stable: an internal model would drift away beside it")
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
    return told(problem, widest)


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
        cost,
        optimize.Bounds(*np.log(RANGES).T),
        maxiter=most,
        popsize=10,
        tol=1e-4,
        rng=np.random.default_rng(SEED),
        polish=False,
    )
    best = gains(found.x)
    return told(problem, best) if allowed(problem, best) else NoDesign(why_not(problem, best))


def best(problem: Problem) -> Designed | NoDesign:
    """Design both ways; see `better`."""
    return better(internal_model(problem), pid(problem))


def better(*found: Designed | NoDesign) -> Designed | NoDesign:
    """Choose the loop that is closed furthest up; of those alike what holds off disturbances most.

    All keep the same reserves and the same calm. A loop that holds off a tenth more, but whose |T|
    ends early, followed its target in rides much less far (6.3 Hz against 10.6).
    """
    able = [d for d in found if isinstance(d, Designed)]
    if not able:
        return found[0]
    reach = {id(d): np.nan_to_num(d.margins["nominal"].bandwidth) for d in able}
    alike = [d for d in able if reach[id(d)] * ALIKE >= max(reach.values())]
    return max(alike, key=lambda d: d.margins["nominal"].rejection)


def allowed(problem: Problem, controller: Answering) -> bool:
    """Tell whether a controller keeps every condition of the problem, noise included."""
    quiet = problem.shaken(controller.response) <= problem.required.noise * problem.swing
    return quiet and problem.met(controller.response)


def _excess(problem: Problem, controller: Gains) -> float:
    """How far the worst condition is missed, as a logarithm; 0 where all are met."""
    required = problem.required
    noise = problem.shaken(controller.response) / (required.noise * problem.swing)
    over = [noise, problem.robust(controller.response)]
    over += [math.exp(5.0 * abs(problem.encircled(controller.response)))]
    for m in problem.loops(controller.response).values():
        over += [m.sensitivity / required.sensitivity, required.gain / m.gain]
        over += [required.phase / max(m.phase, 1e-6)]
    return float(np.sum(np.maximum(np.log(np.maximum(over, 1e-9)), 0.0)))


def told(problem: Problem, controller: Answering) -> Designed:
    """Tell all about a controller, and find its prefilter."""
    prefilter = quickest(problem, controller)
    return Designed(
        controller,
        prefilter,
        problem.loops(controller.response),
        problem.robust(controller.response),
        problem.shaken(controller.response),
        _tracked(problem, controller, prefilter),
    )


def _tracked(problem: Problem, controller: Answering, prefilter: Prefilter) -> float:
    f = problem.frequency
    path = problem.path(f)
    closed = controller.reference_response(f) * path / (1 + controller.response(f) * path)
    return first_fall(f, np.abs(prefilter.response(f) * closed))


def why_not(problem: Problem, slowest: Answering) -> str:
    """Say which condition even the slowest loop breaks."""
    loops = problem.loops(slowest.response)
    name, worst = max(loops.items(), key=lambda item: item[1].sensitivity)
    return (
        f"even the slowest loop keeps too little: {name} has M_s {worst.sensitivity:.2f}, gain "
        f"margin {20 * np.log10(worst.gain):.1f} dB, phase margin {np.degrees(worst.phase):.0f} "
        f"deg; max |W T| is {problem.robust(slowest.response):.2f}"
    )
