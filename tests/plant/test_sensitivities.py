"""Sensitivities of the simulation are the slopes of its outputs."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest

from slipbench.plant.effects.effect import Effect
from slipbench.plant.effects.free_curve import KNOTS, free_curve
from slipbench.plant.effects.library import LIBRARY
from slipbench.plant.layout import moving
from slipbench.plant.motorcycle import Motorcycle
from slipbench.plant.sensitivities import sensitivities
from slipbench.plant.signals import Floats, Inputs
from slipbench.plant.simulation import Simulation

ROWS = 400
TIME = np.arange(ROWS) * 1e-3
RELATIVE = 1e-6
"""Step of the central differences, as a share of the parameter."""
SHOWN = (
    "throttle",
    "air",
    "engine_speed",
    "rear_speed",
    "front_speed",
    "speed",
    "rear_angle",
    "front_angle",
    "slip",
    "acceleration",
    "optical_speed",
)
FIXED = ("teeth", "resolution")
AWAY = {"delay": 2.6e-3, "spark_delay": 1.3e-3}
"""Delays between whole steps, where the held command has no kink."""


def bike(*effects: Effect) -> Motorcycle:
    nominal = Motorcycle(effects=effects)
    servo = replace(nominal.throttle_servo, delay=AWAY["delay"])
    engine = replace(nominal.engine, spark_delay=AWAY["spark_delay"])
    return replace(nominal, throttle_servo=servo, engine=engine)


def begin(sim: Simulation, throttle: float = 0.2, rear_speed: float = 71.0) -> Floats:
    return sim.state(
        throttle=throttle,
        air=0.2,
        engine_speed=500.0,
        rear_speed=rear_speed,
        speed=21.0,
        twist=0.02,
        throttle_command=0.2,
        crank_angle=3.0,
    )


def ridden(**added: Floats) -> Inputs:
    command = 0.25 + 0.3 * np.sign(np.sin(40 * TIME)) * (TIME > 0.02) + 0.1 * np.sin(30 * TIME)
    inputs = Inputs.held(
        ROWS,
        gear=3.0,
        throttle_command=command,
        spark=-0.05 * (np.sin(60 * TIME) > 0.5),
        rear_brake=20.0,
        road_force=50.0 * np.sin(3 * TIME),
        lean=0.3 + 0.1 * TIME,
        air_temperature=310.0,
    )
    for name, course in added.items():
        inputs.table[:, Inputs.names.index(name)] += course
    return inputs


def numbers(motorcycle: Motorcycle) -> dict[str, float]:
    """All parameters of the kernel by name, and the gear in use."""
    found = {
        f"{name}_{p.name}": float(getattr(block, p.name))
        for name, block in motorcycle.blocks()
        for p in block.parameters()
        if p.name not in FIXED
    }
    for effect in motorcycle.effects:
        found |= {f"{effect.name}.{p.name}": getattr(effect, p.name) for p in effect.parameters()}
    return found | {"gears.3": motorcycle.gears[2]}


def changed(sim: Simulation, name: str, by: float) -> Simulation:
    """The same simulation with one number of its kernel changed, whatever its range."""
    new = replace(sim)
    if name == "gears.3":
        ratios = sim.ratios.copy()
        ratios[2] += by
        object.__setattr__(new, "ratios", ratios)
        return new
    parameters, delays = sim.parameters.copy(), sim.delays.copy()
    parameters[sim.layout.parameters.index(name)] += by
    delays += (
        by / sim.step * np.array([name == "throttle_servo_delay", name == "engine_spark_delay"])
    )
    object.__setattr__(new, "parameters", parameters)
    object.__setattr__(new, "delays", delays)
    return new


def assert_slopes(
    got: Mapping[str, Floats],
    column: int,
    up: dict[str, Floats],
    down: dict[str, Floats],
    by: float,
) -> None:
    for name in got:
        expected = (up[name] - down[name]) / (2.0 * by)
        size = np.abs(up[name]).max() * 1e-10 / by + 1e-4 * np.abs(expected).max()
        np.testing.assert_allclose(got[name][:, column], expected, rtol=0, atol=size, err_msg=name)


def check_parameters(motorcycle: Motorcycle, finer: int = 1, some: str = "") -> None:
    sim = Simulation(motorcycle, 1e-3 / finer, finer, finer)
    state, inputs = begin(sim), ridden()
    sizes = {n: v for n, v in numbers(motorcycle).items() if some in n}
    columns = {name: i for i, name in enumerate(sizes)}
    starts = np.zeros((len(sim.layout.states), len(columns)))
    shown = (*SHOWN, *(s for s in sim.layout.effect_states if s.split(".")[0] in some))
    values, got = sensitivities(sim, state, inputs, shown, columns, starts, {})
    plain = sim.trajectories(state, inputs, shown)
    for name in shown:
        same = 1e-12 * max(float(np.abs(plain[name]).max()), 1.0)
        np.testing.assert_allclose(values[name], plain[name], rtol=0, atol=same)
    for name, value in sizes.items():
        by = RELATIVE * max(abs(value), 1e-2)
        up, down = (changed(sim, name, s).trajectories(state, inputs, shown) for s in (by, -by))
        assert_slopes(got, columns[name], up, down, by)


@pytest.mark.parametrize("finer", [1, 2])
def test_parameters_of_the_nominal_motorcycle(finer: int) -> None:
    check_parameters(bike(), finer)


@pytest.mark.parametrize("effect", moving(LIBRARY), ids=lambda e: e.name)
def test_parameters_of_every_effect(effect: type[Effect]) -> None:
    check_parameters(bike(effect()), some=f"{effect.name}.")


def test_parameters_of_the_motorcycle_with_several_effects() -> None:
    names = ("backlash", "fuel_film", "relaxation_length", "radius_growth", "squat", "gear_play")
    effects = [e() for e in moving(LIBRARY) if e.name in names]
    assert len(effects) == len(names)
    check_parameters(bike(*effects), 2)


@pytest.mark.parametrize(
    ("place", "quantity", "low", "high"),
    [
        ("servo force", "throttle", 0.0, 0.8),
        ("engine torque", "engine speed", 400.0, 700.0),
        ("tyre force", "slip", -0.05, 0.15),
        ("road force", "speed", 18.0, 24.0),
    ],
)
def test_values_of_a_free_curve(place: str, quantity: str, low: float, high: float) -> None:
    values = tuple(0.2 * np.sin(np.arange(float(KNOTS))))
    curve = free_curve(place, quantity, tuple(np.linspace(low, high, KNOTS)), values)
    assert curve is not None
    check_parameters(bike(curve), some=f"{curve.name}.f")


def test_initial_states_and_inputs() -> None:
    sim = Simulation(bike(), 1e-3, 1, 1)
    wave, ramp = np.sin(5 * TIME), TIME.copy()
    starts = np.zeros((len(sim.layout.states), 3))
    starts[sim.layout.states.index("throttle"), 0] = 1.0
    starts[sim.layout.states.index("rear_speed"), 0] = 20.0
    slopes = {n: np.zeros((ROWS, 3)) for n in ("throttle_command", "rear_brake", "road_force")}
    slopes["throttle_command"][:, 1] = wave
    slopes["rear_brake"][:, 2] = 30.0 * ramp
    slopes["road_force"][:, 2] = 90.0 * wave
    _, got = sensitivities(sim, begin(sim), ridden(), SHOWN, {}, starts, slopes)
    by = 1e-6
    both = [
        sim.trajectories(begin(sim, 0.2 + s, 71.0 + 20.0 * s), ridden(), SHOWN) for s in (by, -by)
    ]
    assert_slopes(got, 0, *both, by)
    both = [
        sim.trajectories(begin(sim), ridden(throttle_command=s * wave), SHOWN) for s in (by, -by)
    ]
    assert_slopes(got, 1, *both, by)
    added = [{"rear_brake": s * 30.0 * ramp, "road_force": s * 90.0 * wave} for s in (by, -by)]
    both = [sim.trajectories(begin(sim), ridden(**a), SHOWN) for a in added]
    assert_slopes(got, 2, *both, by)


@pytest.mark.parametrize("finer", [1, 2])
def test_prescribed_states(finer: int) -> None:
    """What a recording prescribes moves with its own slopes, and is let go after a while."""
    sim = Simulation(bike(), 1e-3 / finer, finer, finer)
    throttle = 0.3 + 0.1 * np.sin(30 * TIME)
    speed = np.where(TIME < 0.1, 21.0 + TIME, np.nan)
    inputs = ridden()
    inputs.measured_throttle[:] = throttle
    inputs.measured_speed[:] = speed
    slopes = {n: np.zeros((ROWS, 2)) for n in ("measured_throttle", "measured_speed")}
    slopes["measured_throttle"][:, 0] = np.cos(20 * TIME)
    slopes["measured_speed"][:100, 1] = 1.0 + 3.0 * TIME[:100]
    starts = np.zeros((len(sim.layout.states), 2))
    starts[sim.layout.states.index("speed"), 1] = 1.0
    columns = {"engine_friction": 0}
    _, got = sensitivities(sim, begin(sim), inputs, SHOWN, columns, starts, slopes)
    by = 1e-6

    def run(column: int, size: float) -> dict[str, Floats]:
        moved = Inputs(inputs.table.copy())
        for name, course in slopes.items():
            moved.table[:, Inputs.names.index(name)] += size * course[:, column]
        state = begin(sim)
        state[1 : 1 + len(starts)] += size * starts[:, column]
        there = changed(sim, "engine_friction", size) if column == 0 else sim
        return there.trajectories(state, moved, SHOWN)

    for column in (0, 1):
        assert_slopes(got, column, run(column, by), run(column, -by), by)


def test_many_columns_are_the_columns_one_by_one() -> None:
    sim = Simulation(bike(), 1e-3, 1, 1)
    names = [n for n in numbers(bike()) if n in sim.layout.parameters]
    columns = {name: 3 * i for i, name in enumerate(names)}  # more than one run can hold
    starts = np.zeros((len(sim.layout.states), 3 * len(names)))
    _, all_of_them = sensitivities(sim, begin(sim), ridden(), SHOWN, columns, starts, {})
    for name in names[::7]:
        _, alone = sensitivities(sim, begin(sim), ridden(), SHOWN, {name: 0}, starts[:, :1], {})
        for shown in SHOWN:
            whole = all_of_them[shown][:, columns[name]]
            np.testing.assert_allclose(whole, alone[shown][:, 0], rtol=1e-10, atol=1e-10)


def test_a_name_that_is_no_parameter_is_an_error() -> None:
    sim = Simulation(bike(), 1e-3, 1, 1)
    starts = np.zeros((len(sim.layout.states), 1))
    with pytest.raises(KeyError, match="engine_power"):
        sensitivities(sim, begin(sim), ridden(), SHOWN, {"engine_power": 0}, starts, {})


def test_a_gear_that_does_not_exist_is_an_error() -> None:
    sim = Simulation(bike(), 1e-3, 1, 1)
    inputs = Inputs.held(3, gear=9.0)
    with pytest.raises(ValueError, match="gears"):
        sensitivities(sim, begin(sim), inputs, SHOWN, {}, np.zeros((len(sim.layout.states), 1)), {})
