"""How much of each limit a trial uses, in simulation, over the uncertainty of the motorcycle.

The motorcycle is drawn within the 95 % intervals of its parameters and of the sizes of the
hypotheses, and the rider within the window of the engine speed that arms the trial.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from slipbench.identification.experiments.bounds import Bounds
from slipbench.identification.experiments.hypothesis import Hypothesis
from slipbench.identification.mismatch.fit.fitting import Fit
from slipbench.identification.mismatch.motorcycle.menu import BEGINS, Choice
from slipbench.identification.mismatch.motorcycle.record import STEP
from slipbench.identification.mismatch.motorcycle.system import MotorcycleSystem
from slipbench.identification.mismatch.simulation.coordinates import NORMAL_95
from slipbench.plant.equilibrium import equilibrium
from slipbench.plant.motorcycle import Motorcycle
from slipbench.plant.signals import Floats, Inputs, Outputs
from slipbench.plant.simulation import Simulation
from slipbench.protocol.straight import AFTERWARDS, DRIFT, MARGIN, WINDOW

TRIES = 8
"""Simulations of one motorcycle until its amplitude fits."""


@dataclass(frozen=True)
class Drawn:
    """A motorcycle that may be the true one. off: share by which the rider is off the engine speed."""

    motorcycle: Motorcycle
    off: float = 0.0


@dataclass(frozen=True)
class Usage:
    """Largest share of a limit that is used, in steady riding and in the trial; 1: all but the margin.

    by: the quantity that uses it
    """

    steady: float
    peak: float
    by: str = ""


def draws(
    known: Fit, hypotheses: Sequence[Hypothesis], number: int, seed: int
) -> tuple[Drawn, ...]:
    """The most likely motorcycle under each hypothesis, then `number` others under each.

    The most likely one is ridden at the operating point and at both ends of the window.
    """
    rng = np.random.default_rng(seed)
    found = []
    for hypothesis in hypotheses:
        likely = _motorcycle(known, known.point.x, hypothesis, 0.0)
        found += [Drawn(likely, off) for off in (0.0, -WINDOW, WINDOW)]
    for hypothesis in hypotheses:
        for _ in range(number):
            x = known.point.x + NORMAL_95 * rng.uniform(-1.0, 1.0, known.point.x.size)
            bike = _motorcycle(known, x, hypothesis, float(rng.uniform(-1.0, 1.0)))
            found.append(Drawn(bike, float(rng.uniform(-WINDOW, WINDOW))))
    return tuple(found)


def _motorcycle(known: Fit, x: Floats, hypothesis: Hypothesis, share: float) -> Motorcycle:
    effects = (*known.point.effects, *hypothesis.drawn(share))
    system = known.model.system.at(known.model.known, x, effects)
    assert isinstance(system, MotorcycleSystem)
    return system.vehicle.motorcycle


def usage(drawn: Drawn, choice: Choice, bounds: Bounds) -> Usage:
    """Share of each limit that a trial uses. Infinite where the motorcycle cannot hold the point."""
    simulation = Simulation(drawn.motorcycle, STEP / 2, 2, 2)
    steady = _steady(simulation, choice.gear, choice.engine_speed * (1.0 + drawn.off))
    if steady is None:
        return Usage(np.inf, np.inf, "no steady state")
    state, opening = steady
    inputs = _inputs(choice, opening)
    _, out = simulation.advance(state, inputs)
    first = round(BEGINS / STEP) - 1
    nominal = choice.engine_speed * _per_turn(drawn.motorcycle, choice.gear)
    used = dict(_used(out, inputs, bounds, nominal, choice))
    worst = max(used, key=lambda name: float(used[name].max()))
    before = max(float(values[: first + 1].max()) for values in used.values())
    return Usage(before, float(used[worst].max()), worst)


def _steady(simulation: Simulation, gear: int, engine_speed: float) -> tuple[Floats, float] | None:
    """State and opening that hold an engine speed, or one within 1 % of it; None: there is none.

    At a single speed the solution may lie on the kink of an effect, where the solver does not end.
    """
    for off in (0.0, 0.003, -0.003, 0.01, -0.01):
        try:
            return equilibrium(simulation, gear, engine_speed * (1.0 + off))
        except (ValueError, IndexError):
            continue
    return None


def _inputs(choice: Choice, opening: float) -> Inputs:
    """Inputs of the trial with the settling and the hand-back after it."""
    rows = round((BEGINS + choice.seconds + AFTERWARDS) / STEP)
    inputs = Inputs.held(rows, gear=float(choice.gear), throttle_command=opening)
    wave = choice.wave(np.asarray(STEP * np.arange(1, rows + 1)))
    column = inputs.throttle_command if choice.actuator == "throttle" else inputs.spark
    column += wave
    return inputs


def _per_turn(bike: Motorcycle, gear: int) -> float:
    """Speed (m/s) per crank speed (rad/s) without slip."""
    return bike.rear_wheel.radius / bike.gears[gear - 1]


def _used(
    out: Outputs, inputs: Inputs, bounds: Bounds, nominal: float, choice: Choice
) -> Iterator[tuple[str, Floats]]:
    """Names of limits, and the share of each that is used row by row, (rows,)."""
    limits = bounds.limits
    yield "engine speed", _of_range(out.engine_speed, limits.engine_speed, MARGIN)
    yield "speed", _of_range(out.speed, limits.speed, MARGIN)
    yield "slip", np.abs(out.slip) / ((1.0 - MARGIN) * limits.slip)
    if choice.actuator == "throttle":
        yield "throttle", _of_range(inputs.throttle_command, limits.throttle, 0.0)
    yield "speed at the brakes", out.speed / (nominal * (1.0 + WINDOW + DRIFT))
    begun = round(BEGINS / STEP) - 1
    way = out.distance - out.distance[begun]
    yield "distance", way / bounds.distance(nominal)


def _of_range(values: Floats, limits: tuple[float, float], margin: float) -> Floats:
    """Distance from the middle of a range in shares of what the margin leaves of its half."""
    low, high = limits
    return np.asarray(np.abs(values - 0.5 * (low + high)) / (0.5 * (high - low) * (1.0 - margin)))


def scaled_into(
    choice: Choice, motorcycles: Sequence[Drawn], bounds: Bounds
) -> tuple[Choice | None, Usage]:
    """The trial with the largest amplitude up to its own with which no motorcycle uses more than all.

    None where steady riding alone does; then the usage says of what.
    """
    worst = Usage(0.0, 0.0)
    for drawn in motorcycles:
        for _ in range(TRIES):
            worst = usage(drawn, choice, bounds)
            if worst.peak <= 1.0:
                break
            if worst.steady >= 0.98:
                return None, worst
            share = (1.0 - worst.steady) / (worst.peak - worst.steady)
            choice = replace(choice, amplitude=rounded(choice.amplitude * min(0.97 * share, 0.9)))
        else:
            return None, worst
    return choice, worst


def rounded(value: float) -> float:
    """The value with three significant digits, not above it in size."""
    if value == 0.0 or not np.isfinite(value):
        return value
    unit = 10.0 ** (np.floor(np.log10(abs(value))) - 2)
    return float(np.floor(value / unit + 1e-9) * unit)
