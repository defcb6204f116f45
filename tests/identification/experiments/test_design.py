"""Laws of a designed trial: it is not worse than the menu, and leaves neither limits nor straight."""

from dataclasses import replace

import numpy as np
import pytest

from slipbench.identification.experiments.envelope import draws, scaled_into, usage
from slipbench.identification.experiments.family import menu_trials, speed_range
from slipbench.identification.experiments.search import SEED, Effort, design, evaluated
from slipbench.identification.mismatch.motorcycle.menu import BEGINS, Choice
from slipbench.identification.mismatch.motorcycle.record import STEP
from slipbench.plant.equilibrium import equilibrium
from slipbench.plant.signals import Inputs
from slipbench.plant.simulation import Simulation
from slipbench.protocol.straight import AFTERWARDS, BEFORE, BRAKING
from tests.identification.experiments.problems import another_motorcycle, problem

OTHERS = 5  # motorcycles that the design has not seen
SEEDS = (301, 302)
QUICK = Effort(refined=1, rounds=1, offered=1, drawn=2)


def test_a_design_is_worth_at_least_what_the_menu_is():
    asked = problem("backlash", "hardening_cush")
    likely = draws(asked.known, asked.hypotheses, QUICK.drawn, SEED)
    menu = [
        found
        for choice in menu_trials(asked.motorcycle, asked.bounds, asked.actuators)
        if (found := evaluated(asked, likely, choice)) is not None
    ]
    best = design(asked, effort=QUICK)[0]
    assert menu, "limits and straight permit some trial of the menu"
    assert best.evidence.worth >= max(one.evidence.worth for one in menu)


@pytest.mark.parametrize("seed", SEEDS)
def test_no_designed_trial_leaves_limits_or_straight_on_any_motorcycle_of_the_intervals(seed):
    print(f"seed {seed}")
    rng = np.random.default_rng(seed)
    straight, slip = float(rng.uniform(900.0, 2000.0)), f"{rng.uniform(5.0, 9.0):.1f} %"
    names = (("nothing", "backlash"), ("hardening_cush", "driveline_loss"))[seed % 2]
    asked = problem(*names, straight=straight, known=another_motorcycle(seed), slip=slip)
    found = design(asked, effort=QUICK)
    assert found, "these limits leave room"
    for one in found:
        for drawn in draws(asked.known, asked.hypotheses, OTHERS, seed + 1):
            stays_inside(asked.bounds, one.choice, drawn, straight)


def stays_inside(bounds, choice, drawn, straight):
    """Ride the trial from the button to the standstill, in a simulation of the motorcycle alone."""
    simulation = Simulation(drawn.motorcycle, STEP / 2, 2, 2)
    speed = choice.engine_speed * (1.0 + drawn.off)
    state, opening = equilibrium(simulation, choice.gear, speed)
    rows = round((BEGINS + choice.seconds + AFTERWARDS) / STEP)
    wave = choice.wave(STEP * np.arange(1, rows + 1))
    inputs = Inputs.held(rows, gear=float(choice.gear), throttle_command=opening + wave)
    _, out = simulation.advance(state, inputs)
    limits = bounds.limits
    assert (
        limits.engine_speed[0]
        < out.engine_speed.min()
        <= out.engine_speed.max()
        < limits.engine_speed[1]
    )
    assert limits.speed[0] < out.speed.min() <= out.speed.max() < limits.speed[1]
    assert np.abs(out.slip).max() < limits.slip
    assert (
        limits.throttle[0] <= (opening + wave).min() <= (opening + wave).max() <= limits.throttle[1]
    )
    assert np.abs(wave).max() <= limits.throttle_deviation
    assert np.abs(np.diff(wave)).max() / STEP <= limits.throttle_rate * (1 + 1e-6)
    way = out.distance[-1] - out.distance[round(BEGINS / STEP) - 1]
    assert way <= limits.distance
    used = BEFORE * out.speed[0] + way + out.speed[-1] ** 2 / (2.0 * BRAKING)
    assert used <= straight


def test_the_amplitude_falls_until_the_slip_leaves_the_margin():
    wide, narrow = (problem("nothing", "backlash", slip=f"{slip} %") for slip in (20, 4))
    low, high = speed_range(wide.motorcycle, 2, wide.bounds)
    first = Choice(2, 0.5 * (low + high), "throttle", "square", 0.06, 0.8, seconds=6.0)
    sizes = []
    for asked in (wide, narrow):
        motorcycles = draws(asked.known, asked.hypotheses, 2, SEED)
        choice, _ = scaled_into(first, motorcycles, asked.bounds)
        assert choice is not None
        assert all(usage(one, choice, asked.bounds).peak <= 1.0 for one in motorcycles)
        sizes.append(choice.amplitude)
    assert sizes[1] < sizes[0] <= first.amplitude


def test_what_steady_riding_uses_up_is_no_trial():
    asked = problem("nothing", "backlash", slip="0.2 %")
    first = Choice(2, 1200.0, "throttle", "square", 0.02, 0.8, seconds=6.0)
    choice, used = scaled_into(first, draws(asked.known, asked.hypotheses, 0, SEED), asked.bounds)
    assert choice is None
    assert used.by == "slip"
    assert design(replace(asked, bounds=replace(asked.bounds, straight=300.0))) == []


@pytest.mark.parametrize("ramp", [0.0, 0.01, 0.05])
def test_a_square_wave_with_ramps_changes_no_faster_than_its_rate(ramp):
    amplitude = 0.03
    rate = np.inf if ramp == 0.0 else 2 * amplitude / ramp
    choice = Choice(2, 1200.0, "throttle", "square", amplitude, 0.8, seconds=6.0, rate=rate)
    time = STEP * np.arange(round((BEGINS + 5.9) / STEP))
    wave = choice.wave(time)
    assert np.abs(wave).max() == pytest.approx(amplitude)
    assert np.abs(np.diff(wave)).max() / STEP <= rate * (1 + 1e-9)
    ideal = replace(choice, rate=np.inf).wave(time)
    assert np.mean(np.abs(wave - ideal)) <= 2 * amplitude * 2 * 0.8 * ramp * 0.6 + 1e-12
