"""Laws that every effect of the library keeps, whatever its physics."""

import sys
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from slipbench.plant.channels import CHANNEL_UNITS
from slipbench.plant.composition import kernel_text
from slipbench.plant.effects.acceleration_limit import AccelerationLimit
from slipbench.plant.effects.backlash import Backlash
from slipbench.plant.effects.clutch_slip import ClutchSlip
from slipbench.plant.effects.effect import SECTIONS, Effect, Hook
from slipbench.plant.effects.library import BY_NAME, LIBRARY, STAND_INS
from slipbench.plant.effects.rate_limit import RateLimit
from slipbench.plant.effects.slipper_clutch import SlipperClutch
from slipbench.plant.effects.voltage_limit import VoltageLimit
from slipbench.plant.encoder import Misplaces, begin, passing_teeth, toothed_disc
from slipbench.plant.equations import EQUATIONS
from slipbench.plant.equilibrium import equilibrium, mean_instant, steady_state
from slipbench.plant.errors import ParameterError
from slipbench.plant.layout import moving
from slipbench.plant.motorcycle import BLOCK_NAMES, Motorcycle
from slipbench.plant.parameters import Parameter
from slipbench.plant.sensing import Misdates, SensorEffect
from slipbench.plant.signals import Inputs, Outputs
from slipbench.plant.simulation import Simulation

every_effect = pytest.mark.parametrize("effect", LIBRARY, ids=lambda e: e.name)
N = len(Outputs.names)
WAVE_TIME = np.arange(400) * 1e-3
WAVE = 50.0 * np.sin(30 * WAVE_TIME) + WAVE_TIME


def with_effects(motorcycle: Motorcycle, *effects: Effect) -> Motorcycle:
    return replace(motorcycle, effects=effects)


def rear_ticks(motorcycle: Motorcycle, out: Outputs) -> np.ndarray:
    disc = toothed_disc(motorcycle.rear_encoder, motorcycle.effects)
    start = begin(0.0, 0.0, out.rear_speed[0])
    return passing_teeth(disc, start, out.time, out.rear_angle, out.rear_speed)[1].ticks


def told_otherwise(effect: Effect) -> float:
    """By how much a sensor with this effect tells something else than what there is."""
    if isinstance(effect, SensorEffect):
        return float(np.abs(effect.measure(np.empty(0), WAVE_TIME, WAVE)[1] - WAVE).max())
    if isinstance(effect, Misdates):
        return abs(effect.clock_error(10.0))
    return 0.0


@every_effect
def test_an_absent_effect_changes_nothing(effect, nominal, swept):
    bare, absent = with_effects(nominal), with_effects(nominal, effect.absent())
    plain, seen = swept(bare, every_ms=False), swept(absent, every_ms=False)
    scale = np.ptp(plain.table[:, :N], axis=0) + 1.0
    assert (np.abs(seen.table[:, :N] - plain.table[:, :N]) / scale).max() < 1e-12
    assert (rear_ticks(bare, plain) == rear_ticks(absent, seen)).all()
    assert told_otherwise(effect.absent()) == 0.0


@pytest.mark.parametrize("lean", [0.0, 0.7])
def test_all_absent_effects_together_change_nothing_in_a_bend_on_a_hot_day(nominal, lean):
    row = Inputs.held(300, gear=2.0, throttle_command=0.2, lean=lean, air_temperature=310.0)
    seen = []
    for effects in ((), tuple(effect.absent() for effect in LIBRARY)):
        simulation = Simulation(with_effects(nominal, *effects))
        state = simulation.state(speed=40.0, rear_speed=126.0, engine_speed=1100.0)
        seen.append(simulation.advance(state, row)[1].table[:, :N])
    assert seen[0] == pytest.approx(seen[1], rel=1e-12, abs=1e-12)


# Sizes that are reached in a sweep that is gentle.
REACHED = {
    RateLimit: RateLimit(limit=1.0),
    AccelerationLimit: AccelerationLimit(limit=60.0),
    ClutchSlip: ClutchSlip(capacity=40.0),
    SlipperClutch: SlipperClutch(back_torque=2.0),
    VoltageLimit: VoltageLimit(stall_acceleration=60.0),
}


@every_effect
def test_an_effect_of_a_size_that_is_reached_leaves_a_trace(effect, nominal):
    present = with_effects(nominal, REACHED.get(effect, effect()))
    t = np.arange(1200) * 1e-3
    wave = np.clip(0.09 + 0.09 * np.sin(2 * np.pi * 4 * t), 0.0, 1.0)
    inputs = Inputs.held(
        len(t), gear=2.0, throttle_command=wave, spark=0.15 * np.sin(40 * t), lean=0.3
    )
    runs = []
    for bike in (nominal, present):
        simulation = Simulation(bike)
        x, _ = steady_state(simulation, 2, 1466.0)
        runs.append(simulation.advance(simulation.pack(x, 0.09, 0.0), inputs)[1])
    plain, seen = runs
    in_motion = np.abs(seen.table[:, :N] - plain.table[:, :N]).max() > 1e-6
    in_teeth = not np.array_equal(rear_ticks(nominal, plain), rear_ticks(present, plain))
    assert in_motion or in_teeth or told_otherwise(effect()) > 0.0


def value(draw: st.DrawFn, described: Parameter) -> float:
    high = min(described.high, 1e6)
    if described.whole:
        return float(draw(st.integers(int(described.low), int(high))))
    edge = st.sampled_from([described.low, described.typical, high])
    return draw(edge | st.floats(described.low, high))


@every_effect
@settings(max_examples=6, deadline=None, derandomize=True)
@given(data=st.data())
def test_an_effect_is_finite_over_its_range(effect, data):
    present = effect(**{p.name: value(data.draw, p) for p in effect.parameters()})
    gear = data.draw(st.sampled_from([0.0, 1.0, 6.0]))
    simulation = Simulation(Motorcycle(effects=(present,)))
    state = simulation.state(speed=30.0, rear_speed=95.0, engine_speed=900.0)
    wave = np.repeat([1.0, 0.0, 0.4], 60)
    inputs = Inputs.held(180, gear=gear, throttle_command=wave, spark=0.3, lean=0.9)
    out = simulation.advance(state, inputs)[1]
    assert np.isfinite(out.table).all()
    assert np.isfinite(told_otherwise(present))
    if isinstance(present, Misplaces):
        assert np.isfinite(present.tooth_offsets(16)).all()


@pytest.mark.parametrize("effect", moving(LIBRARY), ids=lambda e: e.name)
def test_an_effect_is_sound_at_the_usual_step(effect, nominal):
    """A step of a quarter of it gives the same, corners and dead zones included."""
    bike = with_effects(nominal, REACHED.get(effect, effect()))
    t = np.arange(500) * 1e-3
    wave = 0.08 * np.sin(2 * np.pi * (2 + 10 * t) * t)
    runs = []
    for n in (4, 16):
        simulation = Simulation(bike, 1e-3 / n, n, n)
        state, throttle = equilibrium(simulation, 2, 1466.0)
        inputs = Inputs.held(500, gear=2.0, throttle_command=throttle + wave, spark=wave)
        runs.append(simulation.advance(state, inputs)[1])
    for name in ("throttle", "air", "engine_speed", "rear_speed", "slip", "speed"):
        error = np.abs(runs[0][name] - runs[1][name]).max() / np.ptp(runs[1][name])
        assert error < 1e-3, name


@every_effect
def test_a_steady_state_exists_with_the_effect(effect, nominal):
    """On average over full turns no rate is left, and the effect's own states have settled."""
    simulation = Simulation(with_effects(nominal, effect()))
    x, command = steady_state(simulation, 2, 1466.0)
    dx, out = mean_instant(simulation, x, simulation.row(2, command))
    names = simulation.layout.states
    rates = {n: r for n, r in zip(names, dx, strict=True) if not n.endswith(("angle", "distance"))}
    own = [n for n in names if n.startswith(f"{effect.name}.")]
    for name in (*list(rates)[:7], *own):
        assert abs(rates[name]) < 1e-6, name
    assert 45.0 < out[Outputs.names.index("speed")] < 60.0


@every_effect
def test_an_effect_is_one_page_in_the_fixed_order(effect):
    page = effect.page()
    assert list(page) == ["Title", "Physics", *SECTIONS]
    assert all(page.values())
    for described in effect.parameters():
        assert described.name in page["Symbols"]
    for word in (*effect.words(), *effect.states):
        assert word in page["Symbols"]
    assert "absent" in page["Symbols"]


@every_effect
def test_an_effect_is_one_file_named_like_itself(effect):
    path = Path(sys.modules[effect.__module__].__file__)
    assert path.stem == effect.name
    assert path.read_text().count("(Effect):") == 1
    assert effect.__name__ == "".join(part.capitalize() for part in effect.name.split("_"))


@every_effect
def test_an_effect_acts_at_seams_that_exist_and_belongs_to_a_block(effect):
    seams = {equation.__name__ for equation in EQUATIONS}
    assert {hook.seam for hook in effect.hooks} <= seams
    assert effect.block in (*BLOCK_NAMES, "optical_sensor", "road", "encoder", "channel")
    governed = [state for hook in effect.hooks for state in hook.governs]
    assert sorted(governed) == sorted(effect.states)
    assert len(effect.starts) == len(effect.states)
    in_a_sensor = any(isinstance(effect(), kind) for kind in (SensorEffect, Misdates, Misplaces))
    assert bool(effect.hooks) != in_a_sensor


@every_effect
def test_an_effect_shows_somewhere_and_is_like_others_that_exist(effect):
    assert set(effect.shows_in) <= set(CHANNEL_UNITS)
    assert set(effect.confused_with) <= set(BY_NAME) - {effect.name}
    assert all(effect.name in BY_NAME[other].confused_with for other in effect.confused_with)
    for names in (effect.shows_in, effect.confused_with):
        assert names
        assert len(set(names)) == len(names)


@every_effect
def test_sizes_run_from_absent_over_the_smallest_of_interest_to_typical(effect):
    sized = [p for p in effect.parameters() if p.sized]
    assert sized
    for p in effect.parameters():
        if p.smallest is None:
            assert p.absent == p.typical
        else:
            assert p.absent < p.smallest <= p.typical or p.absent > p.smallest >= p.typical
            assert p.low <= p.smallest <= p.high
        assert p.low <= p.typical <= p.high
    small = effect().smallest()
    assert [getattr(small, p.name) for p in sized] == pytest.approx([p.smallest for p in sized])


@every_effect
def test_candidates_differ_in_their_subject_and_have_a_size(effect):
    candidates = effect.candidates()
    assert len({candidate.key for candidate in candidates}) == len(candidates)
    assert effect().key in {candidate.key for candidate in candidates}
    Motorcycle(effects=candidates if effect.words() else candidates[:1])
    for candidate in candidates:
        assert all(hasattr(candidate.smallest(), f.name) for f in fields(effect))


def test_the_library_is_wide_and_its_names_are_its_own():
    assert len(LIBRARY) >= 30
    assert len(BY_NAME) == len(LIBRARY) + len(STAND_INS)  # which no recording names


def test_an_effect_is_given_once_and_within_its_range():
    with pytest.raises(ParameterError, match="given 2 times"):
        Motorcycle(effects=(Backlash(), Backlash(slack=1e-3)))
    with pytest.raises(ParameterError, match=r"Backlash\.slack.*0 to 0\.1 rad.*found 8"):
        Backlash(slack=8)


def test_an_unknown_argument_of_a_hook_is_named():
    class Wrong(Backlash):
        name = "wrong"
        hooks = (Hook("spring_motion", lambda_with_typo),)

    with pytest.raises(NameError, match="'spring_twits' is neither"):
        kernel_text((Wrong,))


def lambda_with_typo(spring_twits: float) -> float:
    return spring_twits


def test_the_guide_to_adding_an_effect_shows_a_real_one_whole():
    root = Path(__file__).parents[2]
    guide = (root / "docs" / "adding_an_effect.md").read_text()
    assert (root / "plant" / "effects" / "grip_wear.py").read_text() in guide
    library = (root / "plant" / "effects" / "library.py").read_text()
    assert library.count("grip_wear") == 1
    assert '    "grip_wear",\n' in guide
    assert '    "grip_wear",\n' in library
