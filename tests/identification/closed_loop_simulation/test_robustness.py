"""Laws of the robustness study: what is drawn, what is measured, what the page says of it."""

import math
from dataclasses import replace

import numpy as np
import pytest
from typer.testing import CliRunner

from slipbench.command import app
from slipbench.identification.closed_loop_simulation.drawn_motorcycles import (
    OUTSIDE,
    drawn_motorcycle,
)
from slipbench.identification.closed_loop_simulation.ride import TICK, Ridden
from slipbench.identification.closed_loop_simulation.robustness import (
    BAND,
    OPEN_LOOP,
    SCENARIOS,
    Outcome,
    outcome,
    settling,
)
from slipbench.identification.closed_loop_simulation.robustness_page import Study, page, quantile
from slipbench.plant.vehicle_file import load_vehicle
from slipbench.plant.vehicles import DEMONSTRATION, NOMINAL
from slipbench.protocol.configuration import read_toml
from slipbench.protocol.controller_file import ControllerFile
from slipbench.protocol.errors import InputError
from tests.paths import CONTROLLERS

VEHICLE = load_vehicle(NOMINAL)
NUMBERS = range(1, 61)


def value_of(motorcycle, key):
    owner, _, name = key.partition(".")
    if owner == "gears":
        return motorcycle.gears[int(name) - 1]
    return getattr(getattr(motorcycle, owner), name)


def test_every_parameter_stays_within_its_stated_deviation_and_is_varied():
    drawn = [drawn_motorcycle(VEHICLE, 1, n).motorcycle for n in NUMBERS]
    for key, half_width in VEHICLE.plus_minus.items():
        off = np.array([value_of(m, key) - value_of(VEHICLE.motorcycle, key) for m in drawn])
        assert np.abs(off).max() <= half_width * (1 + 1e-9), key
        assert 0.2 * half_width < off.std() < 0.7 * half_width, key  # 0.45 for this normal


def test_each_gets_one_or_two_effects_that_act_in_the_loop():
    kinds = set()
    for number in NUMBERS:
        drawn = drawn_motorcycle(VEHICLE, 1, number)
        added = [e for e in drawn.motorcycle.effects if e not in VEHICLE.motorcycle.effects]
        assert 1 <= len(added) <= 2
        assert drawn.effects == tuple(e.key for e in added)
        assert len(set(drawn.effects)) == len(drawn.effects)
        assert all(e.block != OUTSIDE for e in added)
        kinds.update(type(e) for e in added)
    assert len(kinds) > 20


def test_seed_and_number_give_the_same_motorcycle_again():
    assert drawn_motorcycle(VEHICLE, 3, 7) == drawn_motorcycle(VEHICLE, 3, 7)
    assert drawn_motorcycle(VEHICLE, 3, 7) != drawn_motorcycle(VEHICLE, 3, 8)
    assert drawn_motorcycle(VEHICLE, 3, 7) != drawn_motorcycle(VEHICLE, 4, 7)


def test_a_vehicle_that_states_no_deviation_is_refused():
    with pytest.raises(InputError, match="plus_minus"):
        drawn_motorcycle(load_vehicle(DEMONSTRATION), 1, 1)


def ridden(excess):
    """Make a ride whose slip exceeds the setpoint by `excess`, (n,)."""
    n = len(excess)
    zero = np.zeros(n)
    target = np.full(n, 0.03)
    return Ridden(TICK * np.arange(n), target + excess, zero, target, zero, zero, zero, zero)


def test_settling_is_the_time_from_the_first_to_the_last_excess():
    excess = np.zeros(1000)
    assert settling(ridden(excess)) == 0.0
    assert settling(ridden(excess - 1.0)) == 0.0
    excess[200:300] = excess[500:600] = 2 * BAND
    assert settling(ridden(excess)) == pytest.approx(0.4)
    excess[-1] = 2 * BAND
    assert settling(ridden(excess)) == math.inf
    assert settling(ridden(np.full(10, np.nan))) == math.inf


def test_control_keeps_the_slip_of_a_motorcycle_lower_than_no_control():
    file = read_toml(CONTROLLERS / "mixed.toml", ControllerFile)
    drawn = drawn_motorcycle(VEHICLE, 1, 2)
    free = outcome(drawn, OPEN_LOOP, None, SCENARIOS[1], 1)
    held = outcome(drawn, "mixed", file, SCENARIOS[1], 1)
    assert held.peak < 0.5 * free.peak
    assert held == outcome(drawn, "mixed", file, SCENARIOS[1], 1)


def test_a_motorcycle_that_cannot_hold_the_speed_is_not_counted_as_a_failure():
    drawn = drawn_motorcycle(VEHICLE, 1, 1)
    weak = replace(drawn.motorcycle.engine, peak_torque=20.0)
    drawn = replace(drawn, motorcycle=replace(drawn.motorcycle, engine=weak))
    found = outcome(drawn, OPEN_LOOP, None, SCENARIOS[0], 1)
    assert not found.possible


def row(number, peak, settled=0.1, controller="mixed", scenario="wet patch"):
    return Outcome(controller, scenario, number, ("grade",), peak, settled)


def test_the_page_counts_shares_and_names_the_worst():
    rows = [row(n, 0.05) for n in range(1, 8)] + [row(8, 0.2, math.inf), row(9, math.nan, math.nan)]
    text = page(Study("one", 9, 1, 0.08, rows, "slipbench robustness"))
    line = next(line for line in text.splitlines() if line.startswith("| mixed | 8 |"))
    assert "| 88 % (53 to 98) |" in line  # Wilson, 7 of 8
    assert "| 1 | 8 (grade) |" in line
    assert "not counted: 1." in text
    assert "interrupted" not in text
    assert "interrupted: 9 of 20" in page(Study("one", 20, 1, 0.08, rows, "x"))


def test_quantiles_allow_rides_that_do_not_settle():
    values = np.array([1.0, 2.0, 3.0, math.inf])
    assert [quantile(values, q) for q in (0.25, 0.5, 0.75, 1.0)] == [1.0, 2.0, 3.0, math.inf]


def test_the_command_writes_the_page(tmp_path):
    target = tmp_path / "new" / "page.md"
    arguments = [str(CONTROLLERS / "throttle.toml"), "--page", str(target), "--draws", "1"]
    done = CliRunner().invoke(app, ["robustness", *arguments, "--first", "4"])
    assert done.exit_code == 0, done.output
    assert "| throttle | 1 |" in target.read_text()
