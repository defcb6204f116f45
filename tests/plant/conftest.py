"""Motorcycles and runs that the laws of the plant are tried on."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from slipbench.plant.effects.effect import Effect
from slipbench.plant.equilibrium import equilibrium
from slipbench.plant.motorcycle import Motorcycle
from slipbench.plant.signals import Inputs, Outputs
from slipbench.plant.simulation import Simulation
from slipbench.plant.vehicle_file import load_vehicle
from slipbench.plant.vehicles import builtin_vehicle

CRANK_SPEED = 1466.0  # rad/s, 14 000 rpm


@pytest.fixture(scope="session")
def nominal() -> Motorcycle:
    return load_vehicle(builtin_vehicle("nominal")).motorcycle


@pytest.fixture(scope="session")
def demonstration() -> Motorcycle:
    return load_vehicle(builtin_vehicle("demonstration")).motorcycle


@pytest.fixture(scope="session")
def swept() -> Callable[..., Outputs]:
    """Run a throttle sweep about a steady state in 2nd gear, with some spark."""

    def run(
        motorcycle: Motorcycle,
        step: float = 0.25e-3,
        crank_speed: float = CRANK_SPEED,
        seconds: float = 2.0,
        every_ms: bool = True,
        spark: float = 0.1,
    ) -> Outputs:
        n = round(1e-3 / step)
        simulation = Simulation(motorcycle, step, n, n if every_ms else 1)
        state, throttle = equilibrium(simulation, 2, crank_speed)
        t = np.arange(round(1e3 * seconds)) * 1e-3
        wave = throttle + 0.04 * np.sin(2 * np.pi * (1 + 4 * t) * t)
        inputs = Inputs.held(
            len(t), gear=2.0, throttle_command=wave, spark=spark * np.sin(2 * np.pi * 8 * t)
        )
        return simulation.advance(state, inputs)[1]

    return run


@pytest.fixture(scope="session")
def moment(nominal: Motorcycle) -> Callable[..., dict[str, float]]:
    """Look at one moment of the nominal motorcycle with some effects.

    Returns outputs by name and rates of the states as "d <state>". Inputs are told by name, states
    too, those of effects with two underscores for the dot; the rest is the operating point.
    """

    def look(*effects: Effect, gear: int = 2, **named: float) -> dict[str, float]:
        simulation = Simulation(replace(nominal, effects=effects))
        at = {"engine_speed": CRANK_SPEED, "rear_speed": 167.0, "speed": 53.0, "twist": 0.07}
        at |= {"throttle": 0.1, "air": 0.1, "throttle_command": 0.1}
        at |= {name.replace("__", "."): value for name, value in named.items()}
        row = simulation.row(gear, at.pop("throttle_command"))
        for name in [name for name in at if name in Inputs.names]:
            row[Inputs.names.index(name)] = at.pop(name)
        states = simulation.layout.states
        dx, out = simulation.instant(np.array([at.pop(name, 0.0) for name in states]), row)
        assert not at, f"neither state nor input: {at}"
        rates = {f"d {name}": rate for name, rate in zip(states, dx, strict=True)}
        return rates | {name: float(out[name][0]) for name in Outputs.names}

    return look


@pytest.fixture(scope="session")
def ridden(nominal: Motorcycle) -> Callable[..., Outputs]:
    """Ride from the steady state in 2nd gear with these effects, a sample every 0.25 ms.

    Columns of inputs are told by name; `throttle_command` counts from the one that holds the speed.
    """

    def ride(
        *effects: Effect, seconds: float = 0.5, crank_speed: float = CRANK_SPEED, **columns: object
    ) -> Outputs:
        simulation = Simulation(replace(nominal, effects=effects))
        state, throttle = equilibrium(simulation, 2, crank_speed)
        rows = round(1e3 * seconds)
        command = throttle + columns.pop("throttle_command", 0.0)
        inputs = Inputs.held(rows, gear=2.0, throttle_command=command, **columns)
        return simulation.advance(state, inputs)[1]

    return ride
