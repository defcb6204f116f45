"""Motorcycles and runs that the laws of the plant are tried on."""

from collections.abc import Callable

import numpy as np
import pytest

from plant.equilibrium import equilibrium
from plant.motorcycle import Motorcycle
from plant.signals import Inputs, Outputs
from plant.simulation import Simulation
from plant.vehicle_file import builtin_vehicle, load_vehicle

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
