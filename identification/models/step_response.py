"""Step response of a fitted model with its 95 % band.

step = step_response(fit)
step.time, step.value, step.half_width
"""

from dataclasses import dataclass

import numpy as np

from slipbench.identification.models.rational_ml import ACROSS, RationalFit, mixed
from slipbench.identification.models.stable_rational import model
from slipbench.protocol.recording.channel import FloatArray

POINTS = 500
STEP = 1e-4  # of a parameter, finite-difference step
ABOVE = 2.0  # times the top of the band; a pair of poles beyond is not counted
SETTLED = 5.0  # time constants of the slowest pole that are shown


@dataclass(frozen=True)
class StepResponse:
    """Response to a unit step at time 0. time: (n,) s; value, half_width: (n,), output per input."""

    time: FloatArray
    value: FloatArray
    half_width: FloatArray


def step_response(fit: RationalFit, duration: float | None = None) -> StepResponse:
    """Step response; by default until the slowest pole has settled, at most 3 periods of the lowest line.

    The band is that of the parameters, linearised, and of the plausible other orders; an order that
    rings above the band is left out, because nothing was measured there.
    """
    duration = duration or _settled(fit)
    time = np.arange(POINTS) * duration / (POINTS - 1)
    value, variance = _of_order(fit, time)
    others = []
    for weight, rival in (one for one in fit.rivals if _within_band(one[1])):
        other, own = _of_order(rival, time)
        others.append((weight, ACROSS * np.sqrt(own), other - value))
    return StepResponse(time, value, mixed(ACROSS * np.sqrt(variance), others))


def _of_order(fit: RationalFit, time: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Step response and its variance within one order, (n,) each."""
    rate = 1 / (time[1] - time[0])

    def at(x: FloatArray) -> FloatArray:
        one = model(x[:-1], fit.order, fit.pace, (fit.lines.input, fit.lines.output))
        return one.simulate(np.concatenate(([0.0], np.ones(time.size))), rate)[1:]

    value = at(fit.x)
    slopes = []
    for k in range(fit.x.size - 1):
        step = STEP * max(1.0, abs(fit.x[k])) * np.eye(fit.x.size)[k]
        ahead, back = fit.x + step, fit.x - step
        back[0] = max(back[0], 0.0)  # no negative delay
        slopes.append((at(ahead) - at(back)) / (ahead[k] - back[k]))
    J = np.stack(slopes, axis=1)
    variance = np.einsum("ij,jk,ik->i", J, fit.covariance[:-1, :-1], J)
    return value, np.asarray(np.maximum(variance, 0.0))


def _within_band(fit: RationalFit) -> bool:
    poles = fit.model.poles
    oscillatory = np.abs(poles[np.abs(poles.imag) > np.abs(poles.real)])
    return bool(np.all(oscillatory <= ABOVE * 2 * np.pi * fit.lines.frequency[-1]))


def _settled(fit: RationalFit) -> float:
    slowest = float(np.min(np.abs(fit.model.poles.real)))
    return fit.model.delay + min(SETTLED / slowest, 3 / float(fit.lines.frequency[0]))
