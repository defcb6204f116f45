"""Arrays, integers and Booleans of an FMU, and variables that are rejected."""

import zipfile

import numpy as np
import pytest

from slipbench.identification.mismatch.callables.call import Call
from slipbench.identification.mismatch.callables.fmu.fmu_system import open_fmu
from slipbench.identification.mismatch.callables.fmu.runner import FmuRunner
from slipbench.identification.mismatch.callables.fmu.template import template
from slipbench.identification.mismatch.callables.fmu.unpacked import unpacked
from slipbench.identification.mismatch.callables.fmu.wrapper.passed_on import require_passed_on
from slipbench.identification.mismatch.runs import read_system
from slipbench.protocol.errors import InputError
from tests.identification.mismatch.callables.fmus.building import needs_compiler
from tests.identification.mismatch.callables.fmus.levels import (
    BESIDE,
    CLOCK,
    CLOCKED,
    COUPLED,
    PERIOD,
    build,
    recorded,
    solution,
)
from tests.identification.mismatch.laws.explained import explained, holds, names, reported

pytestmark = needs_compiler
ROWS = 40
TIMES = PERIOD * np.arange(ROWS + 1)
BOTH = pytest.mark.parametrize("interface", ["co_simulation", "model_exchange"])
OPEN = '[inputs.open]\nrole = "open"\nsize = { value = 1 }\n\n[inputs.first]'
GEAR = '[inputs.gear]\nrole = "gear"\nsize = { value = 1 }\n\n[inputs.first]'
PULSE = "\npulse = { value = 0.333, plus_minus = 0 }\n\n[inputs.first]"
EVENTS = '\n[outputs.events]\nrole = "events"\nsize = { value = 1 }\n'
SINGLE = '\n[outputs.single]\nrole = "single"\nsize = { value = 1 }\n'


@pytest.fixture(scope="module")
def fmu(tmp_path_factory):
    return build(tmp_path_factory.mktemp("levels"))


def beside(folder, fmu, text=BESIDE, interface=""):
    """Write a file of an FMU into a folder; returns it."""
    path = folder / f"levels{interface}.toml"
    path.write_text(f'fmu = "{fmu}"\ninterface = "{interface}"\n{text}', encoding="utf-8")
    return path


def simulated(path, **inputs):
    """Outputs of the nominal parameters, (rows + 1,) by name."""
    opened = open_fmu(path)
    parameters = {name: one.start for name, one in opened.parameters.items()}
    extended = {name: np.append(values, values[-1]) for name, values in inputs.items()}
    return FmuRunner(opened.plan)(Call(parameters, extended, TIMES, tuple(opened.model.outputs)))


def both(first, second=1.0):
    """Both inputs, (rows, 2)."""
    return np.column_stack((first, np.full(ROWS, second)))


@BOTH
def test_elements_of_a_matrix_and_a_vector_are_those_of_the_equations(fmu, tmp_path, interface):
    """K[1,2] couples the second level into the first; the unbound u[2] keeps its start value, 1."""
    first = np.sin(0.3 * np.arange(ROWS))
    found = simulated(beside(tmp_path, fmu, interface=interface), first=first)
    expected = solution(COUPLED, both(first))
    assert np.allclose(found["upper"][1:], expected[:, 0], atol=2e-6)
    assert np.allclose(found["lower"][1:], expected[:, 1], atol=2e-6)


@BOTH
def test_elements_that_the_file_does_not_bind_keep_their_start(fmu, tmp_path, interface):
    text = "\n".join(line for line in BESIDE.splitlines() if not line.startswith(("k12", "k21")))
    found = simulated(beside(tmp_path, fmu, text, interface), first=np.zeros(ROWS))
    expected = solution(np.diag([1.2, 0.6]), both(np.zeros(ROWS)))
    assert np.allclose(found["upper"][1:], 0.0, atol=1e-12)
    assert np.allclose(found["lower"][1:], expected[:, 1], atol=2e-6)


@BOTH
def test_a_switch_and_a_gear_act_from_the_row_in_which_they_change(fmu, tmp_path, interface):
    """In model exchange the FMU accepts them at events alone."""
    opened = (np.arange(ROWS) // 7) % 2
    gear = 1 + (np.arange(ROWS) // 5) % 3
    text = BESIDE.replace("[inputs.first]", OPEN).replace("[inputs.first]", GEAR)
    path = beside(tmp_path, fmu, text, interface)
    found = simulated(path, first=np.ones(ROWS), open=opened, gear=gear + 0.3)
    expected = solution(COUPLED, both(np.ones(ROWS)) * (opened * gear)[:, None])
    assert np.allclose(found["upper"][1:], expected[:, 0], atol=1e-5)


@BOTH
def test_an_event_between_two_steps_is_at_its_time(fmu, tmp_path, interface):
    """At 0.333 s the first level rises by 1; a count of events and a float of 32 bits are read."""
    text = BESIDE.replace("\n[inputs.first]", PULSE) + EVENTS + SINGLE
    found = simulated(beside(tmp_path, fmu, text, interface), first=np.zeros(ROWS))
    after = TIMES[1:] > 0.333
    calm = solution(COUPLED, both(np.zeros(ROWS)))[:, 0]
    eigen, modes = np.linalg.eig(-COUPLED)
    since = TIMES[1:][after] - 0.333
    rise = (modes * np.linalg.solve(modes, [1.0, 0.0])) @ np.exp(np.outer(eigen, since))
    assert np.allclose(found["upper"][1:][~after], calm[~after], atol=2e-6)
    assert np.allclose(found["upper"][1:][after], calm[after] + rise[0], atol=2e-6)
    assert np.array_equal(found["events"][1:], after)
    assert np.allclose(found["single"], found["upper"], atol=1e-6)


def test_the_last_step_is_not_beyond_the_stop_time_by_rounding(fmu, tmp_path):
    """29.95 s and 0.05 s are 30.000000000000004 s in floats, and this FMU rejects them."""
    times = PERIOD * np.arange(601)
    assert times[-1] < PERIOD * 599 + PERIOD
    opened = open_fmu(beside(tmp_path, fmu, BESIDE.replace('"5 ms"', '"50 ms"')))
    parameters = {name: one.start for name, one in opened.parameters.items()}
    call = Call(parameters, {"first": np.ones(601)}, times, tuple(opened.model.outputs))
    assert np.isfinite(FmuRunner(opened.plan)(call)["upper"]).all()


def test_what_an_fmu_of_arrays_lacks_is_named(fmu, tmp_path):
    """A lag of 0.3 s in the sensor of the second level; the flow is switched."""
    text = BESIDE.replace("[inputs.first]", OPEN).replace('"5 ms"', '"50 ms"')
    system = read_system(beside(tmp_path, fmu, text, "model_exchange"))
    truth = COUPLED * [[1.05, 1.1], [1.0, 0.95]]
    runs = [recorded(seed, truth, lagged) for seed in (1, 2)]
    found = explained(system, runs[:1], runs[1:], ["lag", "gain", "dead_zone", "friction"])
    assert names(found) == ["lag.lower"], reported(found)
    assert holds(found, "lag", "time_constant", 0.3, slack=0.05)


def lagged(level, time_constant=0.3):
    """Level behind a lag, s, that follows a straight line from sample to sample."""
    keep, found = np.exp(-PERIOD / time_constant), np.zeros_like(level)
    slip = time_constant / PERIOD * (1.0 - keep)
    for k in range(1, len(level)):
        found[k] = keep * found[k - 1] + (slip - keep) * level[k - 1] + (1.0 - slip) * level[k]
    return found


def test_no_effect_acts_at_a_switch(fmu, tmp_path):
    system = read_system(beside(tmp_path, fmu, BESIDE.replace("[inputs.first]", OPEN)))
    places = {kind().place.name for kind in system.library}
    assert "first" in places
    assert "open" not in places


def test_states_of_a_vector_are_named_by_element(fmu, tmp_path):
    text = BESIDE + '\n[states.level]\nvariable = "x[2]"\nsize = { value = 1 }\n'
    [state] = open_fmu(beside(tmp_path, fmu, text)).plan.states
    assert state.index == 1


def test_the_first_file_lists_elements_and_names_what_is_no_number(fmu, tmp_path):
    text = template(unpacked(fmu))
    assert 'variable = "K[2,1]"' in text
    assert 'variable = "u[2]"' in text
    assert "left out, no numbers: label (String)" in text
    path = tmp_path / "first.toml"
    path.write_text(text.replace('"levels.fmu"', f'"{fmu}"'), encoding="utf-8")
    opened = open_fmu(path)
    assert [*opened.parameters] == ["K_1_1", "K_1_2", "K_2_1", "K_2_2", "pulse"]
    assert len(opened.plan.inputs) == 4


@pytest.mark.parametrize(
    ("written", "instead", "sentence"),
    [
        ('"K[1,1]"', '"K"', r"no element of the array 'K'(.|\n)*K\[1,1\] to K\[2,2\]"),
        ('"K[1,1]"', '"K[3,1]"', r"'K\[3,1\]' names no element"),
        ('"K[1,1]"', '"K[0,1]"', "names no element"),
        ('"K[1,1]"', '"K[1]"', "names no element"),
        ('"u[1]"', '"u(1)"', r"no variable 'u\(1\)'"),
        ('"u[1]"', '"label"', r"'label' is not a number(.|\n)*String"),
        ('"u[1]"', '"open"\nheld = false', "changes at events alone"),
        ('variable = "K[1,1]"', 'variable = "mode"', "whole numbers, which cannot be calibrated"),
        ('variable = "K[1,1]"', 'variable = "n"', "changes the structure"),
    ],
)
def test_what_does_not_fit_is_refused_in_a_sentence(fmu, tmp_path, written, instead, sentence):
    assert written in BESIDE
    path = beside(tmp_path, fmu, BESIDE.replace(written, instead, 1))
    with pytest.raises(InputError, match=sentence):
        read_system(path)


def test_a_clock_that_has_to_be_ticked_is_refused(tmp_path):
    fmu = build(tmp_path, more=CLOCK)
    with pytest.raises(InputError, match=r"clocks that the simulation(.|\n)*input clocks tick"):
        read_system(beside(tmp_path, fmu))


def test_a_variable_of_a_clock_is_refused(tmp_path):
    fmu = build(tmp_path, more=CLOCKED)
    path = beside(tmp_path, fmu, BESIDE.replace('"x[2]"', '"sampled"'))
    with pytest.raises(InputError, match=r"only when a clock ticks(.|\n)*clocks own"):
        read_system(path)


def test_a_solver_with_longer_steps_than_communication_is_said(tmp_path):
    fmu = build(tmp_path)
    long = build(tmp_path, "long")
    text = (tmp_path / "long-build" / "modelDescription.xml").read_text()
    text = text.replace("<CoSimulation ", '<CoSimulation fixedInternalStepSize="0.1" ')
    _with_description(fmu, long, text)
    with pytest.raises(InputError, match=r"solver takes steps of 0\.1 s(.|\n)*model_exchange"):
        read_system(beside(tmp_path, long)).prepare(recorded(1, COUPLED))


def _with_description(fmu, path, text):
    """Write an FMU with another description."""
    with zipfile.ZipFile(fmu) as old, zipfile.ZipFile(path, "w") as new:
        for name in old.namelist():
            new.writestr(name, text if name == "modelDescription.xml" else old.read(name))


def test_the_fmu_around_another_one_has_scalars_only(fmu, tmp_path):
    with pytest.raises(InputError, match=r"scalar real(.|\n)*an array of 4 numbers"):
        require_passed_on(open_fmu(beside(tmp_path, fmu)))
