"""Effects on the derivatives of an FMU for model exchange act as they do in a model file."""

from dataclasses import replace

import numpy as np
import pytest

from slipbench.identification.mismatch.runs import read_system
from slipbench.identification.mismatch.simulation.causal_partition import CausalPartition
from slipbench.identification.mismatch.simulation.simulation_input import SimulationInput
from slipbench.protocol.errors import InputError
from tests.identification.mismatch.callables.fmus.building import (
    BESIDE,
    build,
    needs_compiler,
    with_file,
)
from tests.identification.mismatch.laws.spring import MODEL, spring, swung

pytestmark = needs_compiler
CHAIN = CausalPartition({"system": ()}, ())
STATES = """
[states.x]
variable = "position"
rate = "velocity"
size = { value = 1, unit = "m" }
first = { value = 0, unit = "m" }

[states.velocity]
along = "velocity"
size = { value = 10, unit = "m/s" }
first = { value = 0, unit = "m/s" }
"""
EXCHANGED = BESIDE.replace('step = "10 ms"', 'step = "5 ms"') + STATES
AS_MODEL = MODEL.replace(
    'along = "velocity"\n', 'along = "velocity"\n\n[seams.push]\nvalue = "0"\nalong = "velocity"\n'
    'size = { value = 1000, unit = "m/s^2" }\n', 1
).replace('"gain * force', '"push + gain * force')  # fmt: skip


@pytest.fixture(scope="module", params=[2, 3], ids=["FMI 2.0", "FMI 3.0"])
def fmu(request, tmp_path_factory):
    folder = tmp_path_factory.mktemp("derivatives")
    return read_system(with_file(build(folder, request.param), EXCHANGED))


@pytest.fixture
def model(tmp_path):
    """The same equations as a model file."""
    return spring(tmp_path, AS_MODEL)


def kind(system, name, at, factor=1.0):
    """An effect of the library at a place; factor: of its typical values."""
    one = next(k() for k in system.library if k.name == name and k().place.name == at)
    values = {p.name: factor * getattr(one, p.name) for p in one.parameters() if p.sized}
    return replace(one, **values)


def shown(system, record, effects=(), **added):
    there = system.at([], np.zeros(0), effects)
    q = np.zeros(record.slow.shape[1])
    return there.simulate(SimulationInput(record, CHAIN, "system", q, added))["place"]


@pytest.mark.parametrize(
    "name", ["elastic_load", "elastic_backlash", "jerk_limit", "acceleration_limit", "friction"]
)
def test_an_effect_at_a_derivative_is_that_of_the_kernel(fmu, model, name):
    recording = swung(5, seconds=3.0)
    one, other = kind(model, name, "velocity_rate"), kind(fmu, name, "velocity_rate")
    effects = [one, replace(other, **{p.name: getattr(one, p.name) for p in one.parameters()})]
    plain = shown(model, model.prepare(recording))
    expected = shown(model, model.prepare(recording), effects[:1])
    found = shown(fmu, fmu.prepare(recording), effects[1:])
    assert np.ptp(expected - plain) > 1e-3 * np.ptp(plain), "it has no effect"
    assert np.allclose(found, expected, atol=1e-7 * np.ptp(expected))


@pytest.mark.parametrize("name", ["viscous_friction", "quadratic_drag", "presliding"])
def test_friction_along_the_speed_is_that_at_a_seam(fmu, model, name):
    """A seam that adds to the same derivative, with the same speed as regressor."""
    recording = swung(5, seconds=3.0)
    one = kind(fmu, name, "velocity_rate", 0.1)
    other = replace(
        kind(model, name, "push"), **{p.name: getattr(one, p.name) for p in one.parameters()}
    )
    plain = shown(model, model.prepare(recording))
    expected = shown(model, model.prepare(recording), [other])
    found = shown(fmu, fmu.prepare(recording), [one])
    assert np.ptp(expected - plain) > 1e-3 * np.ptp(plain), "it has no effect"
    assert np.allclose(found, expected, atol=1e-7 * np.ptp(expected))


def test_a_signal_added_to_a_derivative_is_that_added_in_the_kernel(fmu, model):
    recording = swung(5, seconds=3.0)
    records = [system.prepare(recording) for system in (model, fmu)]
    wave = 20.0 * np.sin(0.05 * np.arange(records[0].grid.rows))
    expected = shown(model, records[0], velocity_rate=wave)
    found = shown(fmu, records[1], velocity_rate=wave)
    assert np.ptp(expected - shown(model, records[0])) > 1e-2
    assert np.allclose(found, expected, atol=1e-7 * np.ptp(expected))


def test_nothing_at_a_derivative_changes_nothing(fmu, tmp_path):
    """Naming a state does not change a simulation."""
    recording = swung(5, seconds=2.0)
    path = tmp_path / "plain.toml"
    text = EXCHANGED.replace(STATES, "").replace('"5 ms"', '"5 ms"\ninterface = "model_exchange"')
    path.write_text(f'fmu = "{fmu.simulator.caller._caller._plan.fmu.path}"\n{text}')
    plain = read_system(path)
    assert np.array_equal(
        shown(plain, plain.prepare(recording)), shown(fmu, fmu.prepare(recording))
    )


@pytest.mark.parametrize(
    ("written", "instead", "sentence"),
    [
        ('variable = "position"\nrate', 'variable = "force"\nrate', "no continuous state 'force'"),
        ('rate = "velocity"', 'rate = "speed"', "rate = 'speed' is no state"),
        ('along = "velocity"', 'along = "speed"', "along = 'speed' does not exist"),
        ('size = { value = 10, unit = "m/s" }', 'size = { value = 10, unit = "kg" }', "contradict"),
        ('step = "5 ms"', 'step = "5 ms"\ninterface = "co_simulation"', "model exchange only"),
    ],
)
def test_states_that_do_not_fit_are_refused(fmu, tmp_path, written, instead, sentence):
    assert written in EXCHANGED
    path = tmp_path / "wrong.toml"
    own = fmu.simulator.caller._caller._plan.fmu.path
    text = EXCHANGED.replace(STATES, STATES.replace(written, instead)).replace(written, instead)
    path.write_text(f'fmu = "{own}"\n{text}', encoding="utf-8")
    with pytest.raises(InputError, match=sentence):
        read_system(path)
