"""Answers in time computed from answers in frequency: step responses of measured members.

y(t) = (2 / pi) int Re T(j w) sin(w t) / w dw for a stable T that is 0 at high frequency
(Papoulis, The Fourier Integral and its Applications, 1962, section 2-4, from causality).
"""

from collections.abc import Callable

import numpy as np

from slipbench.identification.design.problem import Answering, Problem
from slipbench.identification.design.sampled import held
from slipbench.identification.response.response import ComplexArray
from slipbench.protocol.recording.channel import FloatArray

FINE = 0.01  # Hz
TOP = 120.0  # Hz
Passed = Callable[[FloatArray], ComplexArray]


def _unchanged(f: FloatArray) -> ComplexArray:
    return np.ones(f.shape, complex)


def step_response(
    problem: Problem, controller: Answering, time: FloatArray, passed: Passed = _unchanged
) -> dict[str, FloatArray]:
    """Slip after a step of its reference by 1, for the nominal loop and every member.

    time: s, (n,); passed: what the reference is passed through first. Members go on beyond their
    band as far from the nominal model as at its edge.
    """
    f = np.arange(FINE, TOP, FINE)
    law, asked = controller.response(f), controller.reference_response(f) * passed(f)
    at_tick = held(f, problem.period)  # a reference that steps at a tick, not between two
    return {
        name: _step(f, asked * path / (1 + law * path) / at_tick, time)
        for name, path in paths(problem, f).items()
    }


def paths(problem: Problem, f: FloatArray) -> dict[str, ComplexArray]:
    """Answer of the seen slip to the command, nominal and of every member, at f (Hz)."""
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


def _step(f: FloatArray, answer: ComplexArray, time: FloatArray) -> FloatArray:
    closed = answer.real
    w = 2 * np.pi * f
    width = 2 * np.pi * FINE
    first = closed[0] * w[0] / 2 / width  # what lies below the first frequency, as a share of one
    found = (2 / np.pi) * (np.sin(np.outer(time, w)) @ (closed / w)) * width
    return np.asarray(found + (2 / np.pi) * first * time * width)
