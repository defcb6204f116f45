"""Recordings of a machine whose FMU is not quite right, simulated without slipbench.

By fmpy with other parameters, or, where an effect acts inside, by equations of our own.
"""

from collections.abc import Callable, Mapping
from contextlib import redirect_stdout
from io import StringIO
from pathlib import Path
from typing import Any

import fmpy
import numpy as np
from scipy import linalg

from slipbench.plant.signals import Floats

Rates = Callable[[Floats, float], Floats]
"""Derivatives of states, at a held input."""
REST = 0.1  # m/s, below which the ball of the Reference FMU stays down


def by_fmpy(
    path: Path,
    interface: str,
    times: Floats,
    outputs: tuple[str, ...],
    start: Mapping[str, float],
    inputs: Mapping[str, Floats] | None = None,
) -> dict[str, Floats]:
    """Return outputs at times. interface: CoSimulation or ModelExchange; start: values at first."""
    table = None
    if inputs:
        table = np.zeros(times.size, dtype=[("time", float), *((name, float) for name in inputs)])
        table["time"] = times
        for name, values in inputs.items():
            table[name] = values
    with redirect_stdout(StringIO()):
        result: Any = fmpy.simulate_fmu(
            str(path),
            validate=False,
            start_time=0.0,
            stop_time=float(times[-1]),
            step_size=float(times[1]),
            output_interval=float(times[1]),
            relative_tolerance=1e-9,
            record_events=False,
            fmi_type=interface,
            start_values=dict(start),
            input=table,
            output=list(outputs),
        )
    return {name: np.asarray(result[name][: times.size], np.float64) for name in outputs}


def integrated(rates: Rates, start: Floats, inputs: Floats, step: float, parts: int) -> Floats:
    """Return states at the samples of a held input, (n, states). parts: steps in a sample."""
    found, x, h = np.empty((inputs.size, start.size)), start, step / parts
    for k, u in enumerate(inputs):
        found[k] = x
        for _ in range(parts):
            x = _step(rates, x, float(u), h)
    return found


def ball(restitution: float, drag: float, times: Floats, parts: int = 20) -> Floats:
    """Height of a ball that is let go at 1 m, (n,). drag: times speed squared, 1/m."""

    def rates(x: Floats, _: float) -> Floats:
        return np.array([x[1], -9.81 - drag * x[1] * abs(x[1])])

    found, x, h = np.empty(times.size), np.array([1.0, 0.0]), float(times[1]) / parts
    resting = False
    for k in range(times.size):
        found[k] = x[0]
        for _ in range(0 if resting else parts):
            x = _bounced(rates, x, h, restitution)
            if x[0] == 0.0 and x[1] < REST:
                x, resting = np.zeros(2), True
                break
    return found


def _bounced(rates: Rates, x: Floats, h: float, restitution: float) -> Floats:
    """Return the states a step later; a ball that reaches the ground within it bounces."""
    there = _step(rates, x, 0.0, h)
    if there[0] > 0.0 or there[1] > 0.0:
        return there
    low, high = 0.0, h
    for _ in range(60):
        middle = 0.5 * (low + high)
        below = _step(rates, x, 0.0, middle)[0] < 0.0
        low, high = (low, middle) if below else (middle, high)
    up = np.array([0.0, -restitution * _step(rates, x, 0.0, high)[1]])
    return up if up[1] < REST else _step(rates, up, 0.0, h - high)


def van_der_pol(damping: float, drag: float, friction: float, slope: float = 2e-3) -> Rates:
    """Rates of the oscillator. drag: times the square of the speed.

    slope: speed at which dry friction is nearly whole.
    """

    def rates(x: Floats, _: float) -> Floats:
        loss = drag * x[1] * abs(x[1]) + friction * np.tanh(x[1] / slope)
        return np.array([x[1], damping * (1.0 - x[0] ** 2) * x[1] - x[0] - loss])

    return rates


def spring_and_damper(drag: float, friction: float, slope: float = 0.01) -> Rates:
    """Rates of 1 kg on 10600 N/m and 9 N s/m at a force, N. drag: N s^2/m^2; friction: N.

    slope: m/s, at which dry friction is nearly whole.
    """

    def rates(x: Floats, force: float) -> Floats:
        loss = drag * x[1] * abs(x[1]) + friction * np.tanh(x[1] / slope)
        return np.array([x[1], -10600.0 * (x[0] - 1.0) - 9.0 * x[1] - force - loss])

    return rates


def linear(rates: Floats, inputs: Floats, step: float) -> Floats:
    """States of x' = A x + u for held inputs, (n, states), from rest. inputs: (n, states)."""
    size = len(rates)
    block = np.zeros((2 * size, 2 * size))
    block[:size, :size], block[:size, size:] = rates, np.eye(size)
    grown = linalg.expm(step * block)
    found, x = np.empty(inputs.shape), np.zeros(size)
    for k, u in enumerate(inputs):
        found[k] = x
        x = grown[:size, :size] @ x + grown[:size, size:] @ u
    return found


def lagged(signal: Floats, step: float, time_constant: float) -> Floats:
    """Return a signal behind a lag, s; it follows straight lines between samples."""
    keep, found = np.exp(-step / time_constant), np.empty_like(signal)
    slip = time_constant / step * (1.0 - keep)
    found[0] = signal[0]
    for k in range(1, signal.size):
        before, now = signal[k - 1], signal[k]
        found[k] = keep * found[k - 1] + (slip - keep) * before + (1.0 - slip) * now
    return found


def levels(seed: int, count: int, each: int, low: float, high: float) -> Floats:
    """Return random levels, each held over some samples, (count,)."""
    drawn = np.random.default_rng(seed).uniform(low, high, count // each + 1)
    return np.repeat(drawn, each)[:count]


def waves(seed: int, times: Floats, count: int = 5) -> Floats:
    """Return a sum of sines with random phases, to 0.5 Hz, (n,)."""
    phases = np.random.default_rng(seed).uniform(0.0, 2.0 * np.pi, count)
    found = np.zeros_like(times)
    for k, phase in enumerate(phases, start=1):
        found += np.sin(2.0 * np.pi * 0.5 * k / count * times + phase) / np.sqrt(count)
    return found


def _step(rates: Rates, x: Floats, u: float, h: float) -> Floats:
    a = rates(x, u)
    b = rates(x + 0.5 * h * a, u)
    c = rates(x + 0.5 * h * b, u)
    d = rates(x + h * c, u)
    return np.asarray(x + h / 6.0 * (a + 2.0 * b + 2.0 * c + d))
