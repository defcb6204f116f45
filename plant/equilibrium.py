"""The steady state of the motorcycle: every rate is zero while the crank turns at a given speed.

Where torque or force goes with the angle of crank or wheel, its mean over full turns counts.
"""

from collections.abc import Callable

import numpy as np
from scipy.optimize import root

from slipbench.plant.signals import Floats
from slipbench.plant.simulation import Simulation

UNKNOWN = ("throttle", "air", "twist", "rear_speed", "speed")
ZERO = ("throttle_rate", "air", "engine_speed", "twist", "rear_speed", "speed")
SCALES = (0.1, 0.1, 0.05, 100.0, 50.0)
COMMAND_SCALE = 0.1
ANGLES = ("crank_angle", "rear_angle", "front_angle")
TURNS, PHASES = 2, 61
"""Turns of the mean, and places in them: a prime, so that no low order stands still in them."""


def equilibrium(simulation: Simulation, gear: int, engine_speed: float) -> tuple[Floats, float]:
    """Steady state at a crank speed (rad/s), shape (size,), and the command (0..1) that holds it.

    Raises ValueError where none does.
    """
    x, throttle = steady_state(simulation, gear, engine_speed)
    return simulation.pack(x, throttle, 0.0), throttle


def steady_state(simulation: Simulation, gear: int, engine_speed: float) -> tuple[Floats, float]:
    """States, shape (n,), and throttle command (0..1) that hold a crank speed (rad/s).

    Raises ValueError where none does.
    """
    states = simulation.layout.states
    nominal = _guess(simulation, gear, engine_speed)
    extra, kept = _effect_states(simulation)
    solved = [states.index(name) for name in UNKNOWN] + [states.index(name) for name in extra]
    zeros = [states.index(name) for name in (*ZERO, *extra)]
    guess = np.array([0.08, *nominal, *extra.values()])
    scales = np.array([COMMAND_SCALE, *SCALES, *(max(abs(v), 1.0) for v in extra.values())])

    def fill(z: Floats) -> Floats:
        x = np.zeros(len(states))
        x[solved] = (z * scales)[1:]
        x[states.index("engine_speed")] = engine_speed
        for state, source in kept.items():
            x[states.index(state)] = x[states.index(source)]
        return x

    def residual(z: Floats) -> Floats:
        row = simulation.row(gear, float(z[0]) * COMMAND_SCALE)
        return mean_instant(simulation, fill(z), row)[0][zeros]

    found = root(residual, guess / scales, method="hybr", options={"xtol": 1e-13})
    z = _polished(residual, np.asarray(found.x))
    x, command = fill(z), float(z[0]) * COMMAND_SCALE
    _check(simulation, gear, engine_speed, min(x[0], command, key=_inside), residual(z))
    return x, command


def mean_instant(simulation: Simulation, x: Floats, row: Floats) -> tuple[Floats, Floats]:
    """Rates, shape (n,), and outputs, shape (outputs,), at states x, in SI.

    The mean over the angles where an effect depends on an angle. row: of inputs.
    """
    if not any(effect.periodic for effect in simulation.motorcycle.effects):
        dx, out = simulation.instant(x, row)
        return dx, out.table[0]
    angles = [simulation.layout.states.index(name) for name in ANGLES]
    rates, outputs = [], []
    for phase in range(PHASES):
        x = x.copy()
        x[angles] = 2 * np.pi * TURNS * phase / PHASES
        dx, out = simulation.instant(x, row)
        rates.append(dx)
        outputs.append(out.table[0])
    return np.mean(rates, axis=0), np.mean(outputs, axis=0)


def _effect_states(simulation: Simulation) -> tuple[dict[str, float], dict[str, str]]:
    """Guesses for the effects' states that are sought, and the origin of the others."""
    starts = {
        f"{effect.name}.{state}": start
        for effect in simulation.motorcycle.effects
        for state, start in zip(effect.states, effect.starts, strict=True)
    }
    guesses = {state: start for state, start in starts.items() if not isinstance(start, str)}
    return guesses, {state: start for state, start in starts.items() if isinstance(start, str)}


def _inside(opening: float) -> float:
    """Distance of an opening from the ends of 0 to 1; negative outside."""
    return min(opening, 1.0 - opening)


def _guess(simulation: Simulation, gear: int, engine_speed: float) -> Floats:
    """A first try at the unknowns."""
    bike = simulation.motorcycle
    rear_speed = engine_speed / bike.gears[gear - 1]
    speed = rear_speed * bike.rear_wheel.radius
    drag = 0.5 * bike.body.air_density * bike.body.drag_area * speed**2
    twist = drag * bike.rear_wheel.radius / bike.driveline.stiffness
    return np.array([0.08, 0.08, twist + 0.01, rear_speed, 0.985 * speed])


def _polished(residual: Callable[[Floats], Floats], z: Floats) -> Floats:
    """Z after two Newton steps, which take the residual down to rounding."""
    for _ in range(2):
        r = residual(z)
        columns = [(residual(z + d) - r) / 1e-7 for d in 1e-7 * np.eye(len(z))]
        z = z - np.linalg.lstsq(np.array(columns).T, r, rcond=None)[0]
    return z


def _check(
    simulation: Simulation, gear: int, engine_speed: float, throttle: float, residual: Floats
) -> None:
    if np.abs(residual).max() < 1e-6 and 0.0 <= throttle <= 1.0:
        return
    raise ValueError(
        f"no throttle from 0 to 1 holds {engine_speed:.0f} rad/s in gear {gear} "
        f"(nearest try: throttle {throttle:.3f}, residual {np.abs(residual).max():.2g}); "
        "choose a lower speed or a lower gear"
    )
