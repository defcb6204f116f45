"""Which numbers of a vehicle file are uncertain, and by how much."""

from dataclasses import replace

import numpy as np
import pytest

from slipbench.identification.mismatch.fit.calibrate import calibrate
from slipbench.identification.mismatch.motorcycle.coordinates import coordinates, motorcycle_at
from slipbench.identification.mismatch.motorcycle.system import MotorcycleSystem
from slipbench.identification.mismatch.simulation.model import models
from slipbench.plant.vehicle_file import Vehicle
from tests.identification.mismatch.conditions import nominal
from tests.identification.motorcycle_recording import Ride, ride

RIDES = (
    Ride("sweep", 2, 1400.0, 0.04, 0.5, 9.0, seconds=3.0, seed=51),
    Ride("square", 3, 1100.0, 0.05, 0.9, seconds=3.0, seed=52),
)


def with_delay(value: float, half_width: float) -> Vehicle:
    """The nominal vehicle with another delay of the throttle servo, s."""
    bike = nominal().motorcycle
    servo = replace(bike.throttle_servo, delay=value)
    known = {**nominal().plus_minus, "throttle_servo.delay": half_width}
    return replace(nominal(), motorcycle=replace(bike, throttle_servo=servo), plus_minus=known)


def test_a_half_width_of_zero_is_exact_and_so_is_a_zero_without_one() -> None:
    assert "throttle_servo.delay" not in {k.key for k in coordinates(with_delay(5e-3, 0.0), (), ())}
    vehicle = with_delay(0.0, 0.0)
    silent = replace(vehicle, plus_minus={})
    assert "throttle_servo.delay" not in {k.key for k in coordinates(silent, (), ())}


def test_an_exact_gear_ratio_is_not_uncertain() -> None:
    exact = replace(nominal(), plus_minus={**nominal().plus_minus, "gears.2": 0.0})
    keys = [[k.key for k in coordinates(v, (2, 3), ())] for v in (nominal(), exact)]
    assert set(keys[0]) - set(keys[1]) == {"gears.2"}


def test_a_delay_of_zero_with_a_half_width_moves_by_it_and_never_below_zero() -> None:
    vehicle = with_delay(0.0, 4e-3)
    (known,) = (k for k in coordinates(vehicle, (), ()) if k.key == "throttle_servo.delay")
    moved = motorcycle_at(vehicle.motorcycle, [known], np.array([1.959964]))
    assert moved.throttle_servo.delay == pytest.approx(4e-3)
    assert motorcycle_at(vehicle.motorcycle, [known], np.array([-1.0])).throttle_servo.delay == 0.0


def test_calibration_finds_a_delay_that_the_file_takes_for_zero() -> None:
    true = with_delay(5e-3, 0.0).motorcycle
    vehicle = with_delay(0.0, 8e-3)
    system = MotorcycleSystem(vehicle)
    (model,) = models(system, [system.prepare(ride(true, each)) for each in RIDES])
    fit = calibrate(model, model.origin())
    (place,) = (i for i, k in enumerate(model.known) if k.key == "throttle_servo.delay")
    assert model.known[place].at(fit.point.x[place]) == pytest.approx(5e-3, abs=0.5e-3)
