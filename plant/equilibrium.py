"""The steady state of the motorcycle: every rate is zero while the crank turns at a given speed."""

from collections.abc import Callable

import numpy as np
from scipy.optimize import root

from plant.equations import RATES
from plant.signals import Floats
from plant.simulation import Simulation

UNKNOWN = ("throttle", "air", "twist", "rear_speed", "speed")
ZERO = ("air", "engine_speed", "twist", "rear_speed", "speed")
SCALES = (0.1, 0.1, 0.05, 100.0, 50.0)


def equilibrium(simulation: Simulation, gear: int, engine_speed: float) -> tuple[Floats, float]:
    """Return the steady state at a crank speed [rad/s] and the throttle (0..1) that holds it.

    Raises ValueError where none does.
    """
    x, throttle = steady_state(simulation, gear, engine_speed)
    return simulation.pack(x, throttle, 0.0), throttle


def steady_state(simulation: Simulation, gear: int, engine_speed: float) -> tuple[Floats, float]:
    """Return the states and the throttle that hold the speed. Raises ValueError if none does."""
    states = simulation.layout.states
    places = [states.index(name) for name in UNKNOWN]
    extra = _present_states(simulation)
    zeros = [states.index(name) for name in ZERO] + extra
    scales = np.array(SCALES + (1.0,) * len(extra))

    def fill(z: Floats) -> Floats:
        x = np.zeros(len(states))
        x[places + extra] = z * scales
        x[states.index("engine_speed")] = engine_speed
        return x

    def residual(z: Floats) -> Floats:
        x = fill(z)
        dx, _ = simulation.instant(x, simulation.row(gear, float(x[0])))
        return dx[zeros]

    guess = _guess(simulation, gear, engine_speed, len(extra))
    found = root(residual, guess / scales, method="hybr", options={"xtol": 1e-13})
    x = fill(_polished(residual, np.asarray(found.x)))
    _check(simulation, gear, engine_speed, x, residual(x[places + extra] / scales))
    return x, float(x[0])


def _present_states(simulation: Simulation) -> list[int]:
    present = {effect.name for effect in simulation.motorcycle.effects}
    names = simulation.layout.states
    return [i for i in range(len(RATES), len(names)) if names[i].split(".")[0] in present]


def _guess(simulation: Simulation, gear: int, engine_speed: float, extra: int) -> Floats:
    bike = simulation.motorcycle
    rear_speed = engine_speed / bike.gears[gear - 1]
    speed = rear_speed * bike.rear_wheel.radius
    drag = 0.5 * bike.body.air_density * bike.body.drag_area * speed**2
    twist = drag * bike.rear_wheel.radius / bike.driveline.stiffness
    return np.array([0.08, 0.08, twist + 0.01, rear_speed, 0.985 * speed] + [drag] * extra)


def _polished(residual: Callable[[Floats], Floats], z: Floats) -> Floats:
    """Return z after two Newton steps, which take the residual down to rounding."""
    for _ in range(2):
        r = residual(z)
        columns = [(residual(z + d) - r) / 1e-7 for d in 1e-7 * np.eye(len(z))]
        z = z - np.linalg.lstsq(np.array(columns).T, r, rcond=None)[0]
    return z


def _check(
    simulation: Simulation, gear: int, engine_speed: float, x: Floats, residual: Floats
) -> None:
    if np.abs(residual).max() < 1e-6 and 0.0 <= x[0] <= 1.0:
        return
    raise ValueError(
        f"no throttle from 0 to 1 holds {engine_speed:.0f} rad/s in gear {gear} "
        f"(nearest try: throttle {x[0]:.3f}, residual {np.abs(residual).max():.2g}); "
        "choose a lower speed or a lower gear"
    )
