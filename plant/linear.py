"""Near one operating point the motorcycle is a linear system, and its delays stand apart from it.

The Jacobian of the compiled equations, by central differences: where an effect has a corner at the
operating point (asymmetric filling, say) the result is the mean of both sides.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import control
import numpy as np

from slipbench.plant.equations import RATES
from slipbench.plant.equilibrium import equilibrium, mean_instant
from slipbench.plant.motorcycle import Motorcycle
from slipbench.plant.signals import Floats, Inputs, Outputs
from slipbench.plant.simulation import Simulation

INPUTS = ("throttle_command", "spark")
OUTPUTS = ("slip", "engine_speed", "rear_speed", "speed")
ANGLES = ("crank_angle", "rear_angle", "front_angle", "distance")


@dataclass(frozen=True)
class LinearModel:
    """system: a control.StateSpace without delays, signals named; delays: pure ones, in s.

    delays['throttle_command']: from the command to the torque, of which delays['air'] lies behind
    the measured throttle; delays['spark']: from the spark command to the torque.
    at: the outputs at the operating point, by name.
    """

    system: control.StateSpace
    delays: Mapping[str, float]
    at: Mapping[str, float]


def linearise(
    motorcycle: Motorcycle,
    gear: int,
    engine_speed: float,
    inputs: tuple[str, ...] = INPUTS,
    outputs: tuple[str, ...] = OUTPUTS,
) -> LinearModel:
    """The motorcycle as it responds to small changes about a steady state in this gear."""
    simulation = Simulation(motorcycle)
    state, throttle = equilibrium(simulation, gear, engine_speed)
    x = simulation.states(state)
    u = simulation.row(gear, throttle)
    kept = _kept(simulation)
    columns = [Inputs.names.index(name) for name in inputs]
    rows = [Outputs.names.index(name) for name in outputs]
    fx, yx = _jacobian(lambda z: _evaluated(simulation, z, u), x, kept)
    fu, yu = _jacobian(lambda z: _evaluated(simulation, x, z), u, columns)
    system = control.ss(
        fx[kept],
        fu[kept],
        yx[rows],
        yu[rows],
        states=[simulation.layout.states[i] for i in kept],
        inputs=list(inputs),
        outputs=list(outputs),
    )
    y = _evaluated(simulation, x, u)[1]
    at = {name: float(y[i]) for i, name in enumerate(Outputs.names)}
    return LinearModel(system, _delays(motorcycle, at["air_delay"]), at)


def _kept(simulation: Simulation) -> list[int]:
    present = {effect.name for effect in simulation.motorcycle.effects}
    nominal = [i for i, name in enumerate(RATES) if name not in ANGLES]
    states = simulation.layout.states
    return nominal + [i for i in range(len(RATES), len(states)) if _owner(states[i]) in present]


def _owner(state: str) -> str:
    return state.split(".")[0]


def _evaluated(simulation: Simulation, x: Floats, u: Floats) -> tuple[Floats, Floats]:
    return mean_instant(simulation, x, u)


def _jacobian(
    f: Callable[[Floats], tuple[Floats, Floats]], z: Floats, columns: list[int]
) -> tuple[Floats, Floats]:
    """Derivatives of rates and of outputs by z[columns], central differences."""
    rates, outputs = [], []
    for i in columns:
        h = 1e-6 * max(abs(z[i]), 1e-2)
        d = h * np.eye(len(z))[i]
        above, below = f(z + d), f(z - d)
        rates.append((above[0] - below[0]) / (2 * h))
        outputs.append((above[1] - below[1]) / (2 * h))
    return np.array(rates).T, np.array(outputs).T


def _delays(motorcycle: Motorcycle, air: float) -> Mapping[str, float]:
    return {
        "throttle_command": motorcycle.throttle_servo.delay + air,
        "air": air,
        "spark": motorcycle.engine.spark_delay,
    }
