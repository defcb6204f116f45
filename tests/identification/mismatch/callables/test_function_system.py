"""A function is explained as its equations in a model file are."""

from dataclasses import replace

import numpy as np
import pytest

import slipbench
from slipbench.identification.mismatch.callables.description import Ports
from slipbench.identification.mismatch.simulation.causal_partition import CausalPartition
from slipbench.identification.mismatch.simulation.simulation_input import SimulationInput
from slipbench.identification.mismatch.systems.effects.library import BY_NAME
from slipbench.identification.mismatch.systems.effects.seam_effect import INPUT, OUTPUT
from tests.identification.mismatch.callables import springs
from tests.identification.mismatch.laws.explained import explained, holds, names, reported
from tests.identification.mismatch.laws.spring import MODEL, noise_of_the_force, spring, swung

CHAIN = CausalPartition({"system": ()}, ())
RELEASED = {
    "start": slipbench.Parameter(0.4, 0.2, unit="m"),
    "frequency": slipbench.Parameter(9.5, 1.0, unit="rad/s"),
    "damping": slipbench.Parameter(0.1, 0.05),
}


def dead(force):
    return force - np.clip(force, -0.3, 0.3)


def runs(**truth):
    return [swung(1, **truth)], [swung(2, **truth)]


@pytest.fixture(scope="module")
def pair(tmp_path_factory):
    """The function and the model file of one spring, and a recording."""
    recording = swung(5, seconds=4.0)
    function = springs.system([recording])
    fine = MODEL.replace('step = "5 ms"', 'step = "1.25 ms"')  # as operators integrate
    equations = spring(tmp_path_factory.mktemp("spring"), fine)
    return function, equations, recording


def shown(system, recording, *effects):
    record = system.prepare(recording)
    there = system.at([], np.zeros(0), effects)
    return there.simulate(SimulationInput.undisturbed(record, CHAIN, "system"))["place"]


def test_without_effects_it_gives_what_its_equations_give(pair):
    function, equations, recording = pair
    expected = shown(equations, recording)
    assert np.allclose(shown(function, recording), expected, atol=1e-4 * np.ptp(expected))


OF_STATES = ("speed", "turn")  # a function has none to use
AT_INPUTS = [n for n, k in BY_NAME.items() if INPUT in k.acts_on and k.uses not in OF_STATES]


@pytest.mark.parametrize("name", AT_INPUTS)
def test_an_effect_at_an_input_is_that_of_a_model_file(pair, name):
    """Dynamic effects of a held input reach the function as their means over its steps."""
    function, equations, recording = pair
    of_file = [k for k in equations.library if k.name == name and k.place.name == "force"]
    for kind in of_file:
        expected = shown(equations, recording, kind())
        found = shown(function, recording, kind())
        assert np.allclose(found, expected, atol=0.02 * np.ptp(expected)), kind().key


@pytest.mark.parametrize("name", [n for n, k in BY_NAME.items() if OUTPUT in k.acts_on])
def test_an_effect_at_an_output_is_that_of_a_model_file(pair, name):
    function, equations, recording = pair
    of_file = [k for k in equations.library if k.name == name and k.place.name == "place"]
    for kind in of_file:
        expected = shown(equations, recording, kind())
        found = shown(function, recording, kind())
        assert np.allclose(found, expected, atol=2e-3 * np.ptp(expected)), kind().key


def test_what_acts_at_outputs_alone_costs_no_run(pair):
    function, _, recording = pair
    shown(function, recording)
    before = function.simulator.kept.made
    for kind in (k for k in function.library if k.place.kind == OUTPUT):
        shown(function, recording, kind())
    assert function.simulator.kept.made == before


def test_nothing_is_found_where_nothing_is_missing():
    training, held_out = runs()
    found = explained(springs.system(training), training, held_out)
    assert not found.mismatch, reported(found)
    assert not found.effects


@pytest.mark.parametrize(
    ("name", "parameter", "size", "felt"),
    [
        ("dead_zone", "width", 0.3, dead),
        ("saturation", "limit", 1.0, lambda u: np.clip(u, -1.0, 1.0)),
    ],
)
def test_the_verdict_is_that_of_the_model_file(tmp_path, name, parameter, size, felt):
    training, held_out = runs(felt=felt)
    both = [
        explained(system, training, held_out)
        for system in (springs.system(training), spring(tmp_path))
    ]
    for found in both:
        assert names(found) == [f"{name}.force"], reported(found)
        assert holds(found, name, parameter, size, slack=0.01)
    improved = [found.held_out[0].improved for found in both]
    assert improved[0] == pytest.approx(improved[1], rel=0.02)


def test_what_is_found_stands_in_the_improved_file(tmp_path):
    training, held_out = runs(felt=dead)
    path = tmp_path / "spring.improved.toml"
    said = []
    found = slipbench.explain(
        springs.spring,
        springs.PARAMETERS,
        training,
        held_out,
        said.append,
        inputs=["force"],
        outputs=["place"],
        improved=path,
    )
    assert names(found) == ["dead_zone.force"], reported(found)
    text = path.read_text(encoding="utf-8")
    assert 'name = "dead_zone"' in text
    assert 'at = "force"' in text
    assert said[0].startswith("One run of the function takes")


def test_arrays_in_memory_are_a_recording_in_si():
    force = noise_of_the_force(3, 1.0)
    time = 0.01 * np.arange(force.size)
    made = slipbench.recording_of(
        "made", time, {"force": force, "place": 1e3 * force}, {"force": "V", "place": "mm"}
    )
    assert made.channels["place"].unit == "m"
    assert np.allclose(made.channels["place"].value, force)
    assert np.array_equal(made.channels["force"].value, force)


def test_a_function_may_have_no_inputs():
    """A released spring: calibration reduces the residual to the noise; no effect is missing."""
    rides = [swung(seed, seconds=8.0, force=np.zeros(800), start=0.5) for seed in (1, 2)]
    found = slipbench.explain(let_go, RELEASED, rides[:1], rides[1:], inputs=[], outputs=["place"])
    assert not found.mismatch, reported(found)
    error = found.held_out[0]
    assert error.calibrated < 1.1 * error.floor < 0.2 * error.nominal, reported(found)


def test_without_inputs_the_operating_quantity_is_there_though_it_was_not_recorded():
    """It is the first output, which one of the recordings lacks."""
    both = swung(1, seconds=4.0, force=np.zeros(400), start=0.5)
    role, place = "force", both.channels["place"]
    both = replace(both, channels={"place": place, role: replace(place, role=role, unit="V")})
    less = replace(both, channels={"place": place})

    def simulate(parameters, inputs, times):
        shown = let_go(parameters, inputs, times)
        return {**shown, role: 2.0 * shown["place"]}

    ports = Ports((), (role, "place"))
    system = springs.system([both, less], simulate, RELEASED, ports)
    record = system.prepare(less)
    regressors_there = system.regressors(SimulationInput.undisturbed(record, CHAIN, "system"))
    assert system.operating not in map(str, record.sensors)
    assert np.allclose(regressors_there[system.operating], 2.0 * regressors_there["place"])
    assert system.direction in regressors_there


def let_go(parameters, inputs, times):
    assert not inputs
    frequency, damping = parameters["frequency"], parameters["damping"]
    turned = frequency * np.sqrt(1.0 - damping**2)
    oscillation = np.cos(turned * times) + damping * frequency / turned * np.sin(turned * times)
    return {"place": parameters["start"] * np.exp(-damping * frequency * times) * oscillation}
