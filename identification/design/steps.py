"""Step responses of measured members, computed from their frequency responses.

y(t) = (2 / pi) int Re T(j w) sin(w t) / w dw for a stable T that is 0 at high frequency
(Papoulis, The Fourier Integral and its Applications, 1962, section 2-4, from causality).
"""

from collections.abc import Callable

import numpy as np

from slipbench.identification.design.problem import LinearController, Problem
from slipbench.identification.design.sampled import held
from slipbench.identification.response.response import ComplexArray
from slipbench.protocol.recording.channel import FloatArray

FINE = 0.01  # Hz
TOP = 120.0  # Hz
Prefiltering = Callable[[FloatArray], ComplexArray]


def _unity(f: FloatArray) -> ComplexArray:
    return np.ones(f.shape, complex)


def step_response(
    problem: Problem,
    controller: LinearController,
    time: FloatArray,
    prefilter: Prefiltering = _unity,
) -> dict[str, FloatArray]:
    """Slip after a unit step of its reference, by member, each of shape (n,).

    time: s, shape (n,); prefilter: frequency response of the reference filter. Outside its band a
    member keeps the ratio to the nominal model that it has at the edge.
    """
    f = np.arange(FINE, TOP, FINE)
    law, reference = controller.response(f), controller.reference_response(f) * prefilter(f)
    at_tick = held(f, problem.period)  # a reference that steps at a tick, not between two
    return {
        name: _step(f, reference * path / (1 + law * path) / at_tick, time)
        for name, path in paths(problem, f).items()
    }


def paths(problem: Problem, f: FloatArray) -> dict[str, ComplexArray]:
    """Response from command to measured slip, nominal and of every member. f: Hz, shape (n,)."""
    nominal = problem.path(f)
    found = {"nominal": nominal}
    around = problem.around
    for name, values in (around.members if around else {}).items():
        assert around is not None
        known = np.isfinite(values)
        at = around.frequency[known]
        if at.size > 1:
            ratio = values[known] / problem.model.response(at)
            found[name] = nominal * np.interp(f, at, ratio)
    return found


def _step(f: FloatArray, response: ComplexArray, time: FloatArray) -> FloatArray:
    closed = response.real
    w = 2 * np.pi * f
    width = 2 * np.pi * FINE
    first = closed[0] * w[0] / 2 / width  # share of the integral below the first frequency
    found = (2 / np.pi) * (np.sin(np.outer(time, w)) @ (closed / w)) * width
    return np.asarray(found + (2 / np.pi) * first * time * width)
