"""An FMU and its model file: simulation, identified effects, written file."""

import gc
import zipfile

import numpy as np
import pytest
from typer.testing import CliRunner

from slipbench.command import app
from slipbench.identification.mismatch.callables.fmu.unpacked import unpacked
from slipbench.identification.mismatch.runs import read_system
from slipbench.identification.mismatch.simulation.causal_partition import CausalPartition
from slipbench.identification.mismatch.simulation.simulation_input import SimulationInput
from slipbench.protocol.errors import InputError
from tests.identification.mismatch.callables.fmus.building import (
    BESIDE,
    WITHOUT_INPUT,
    build,
    dead,
    needs_compiler,
    recorded,
    with_file,
)
from tests.identification.mismatch.laws.explained import explained, holds, names, reported
from tests.identification.mismatch.laws.spring import cubic, spring, swung

pytestmark = needs_compiler
START = 'start = { value = 0.5, unit = "m", plus_minus = 0.1 }\n\n[inputs.force]'
VELOCITY = """
[states.velocity]
along = "velocity"
size = { value = 10, unit = "m/s" }
first = { value = 0, unit = "m/s" }
"""
CHAIN = CausalPartition({"system": ()}, ())


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("fmus")


@pytest.fixture(scope="module", params=[2, 3], ids=["FMI 2.0", "FMI 3.0"])
def fmu(request, folder):
    return with_file(build(folder, request.param, f"spring{request.param}"))


def shown(system, recording, *effects):
    record = system.prepare(recording)
    there = system.at([], np.zeros(0), effects)
    return there.simulate(SimulationInput.undisturbed(record, CHAIN, "system"))["place"]


@pytest.mark.filterwarnings("error")
def test_the_folder_of_an_fmu_is_removed_with_it_without_a_warning(fmu):
    opened = unpacked(fmu)
    place = opened.folder
    assert (place / "modelDescription.xml").exists()
    del opened
    gc.collect()
    assert not place.exists()


def test_an_fmu_simulates_what_its_equations_simulate(fmu, tmp_path):
    recording = swung(5, seconds=4.0)
    expected = shown(spring(tmp_path), recording)
    assert np.allclose(shown(read_system(fmu), recording), expected, atol=1e-4 * np.ptp(expected))


def test_model_exchange_gives_what_co_simulation_gives(fmu, tmp_path):
    recording = swung(5, seconds=2.0)
    path = tmp_path / "exchanged.toml"
    text = BESIDE.replace('step = "10 ms"', 'step = "2 ms"\ninterface = "model_exchange"')
    path.write_text(f'fmu = "{fmu}"\n{text}', encoding="utf-8")
    expected = shown(read_system(fmu), recording)
    assert np.allclose(shown(read_system(path), recording), expected, atol=1e-5 * np.ptp(expected))


def test_the_start_of_a_state_may_be_a_parameter(fmu, tmp_path):
    """Both interfaces start there: a released spring oscillates with its frequency and damping."""
    recording = swung(5, seconds=2.0, force=np.zeros(200), start=0.5)
    found = []
    for interface in ("co_simulation", "model_exchange"):
        path = tmp_path / f"{interface}.toml"
        text = BESIDE.replace("[inputs.force]", START).replace(
            'step = "10 ms"', f'step = "2 ms"\ninterface = "{interface}"'
        )
        path.write_text(f'fmu = "{fmu}"\n{text}', encoding="utf-8")
        found.append(shown(read_system(path), recording))
    time = 0.01 * np.arange(1, 200)
    damped = 10.0 * np.sqrt(1.0 - 0.1**2)
    oscillation = np.cos(damped * time) + 0.1 * 10.0 / damped * np.sin(damped * time)
    for one in found:
        assert np.allclose(one, 0.5 * np.exp(-time) * oscillation, atol=1e-5)


def test_an_input_that_the_file_does_not_bind_keeps_its_start(fmu, tmp_path):
    """The FMU runs as with an input that was recorded at its start value, 0."""
    recording = swung(5, seconds=2.0, force=np.zeros(200), start=0.5)
    found = []
    for name, text in (("with", BESIDE.replace("[inputs.force]", START)), ("no", WITHOUT_INPUT)):
        path = tmp_path / f"{name}.toml"
        path.write_text(f'fmu = "{fmu}"\n{text}', encoding="utf-8")
        system = read_system(path)
        found.append(shown(system, recording))
    assert not system.file.inputs
    assert np.allclose(*found, atol=1e-6)


@pytest.mark.parametrize("version", [2, 3])
def test_an_event_is_handled_where_it_lies(folder, version):
    """It bounces at -0.2 m with half its speed, and is never beyond. Steps twenty times longer give
    the same, since an event cuts the step in which it lies."""
    fmu = build(folder, version, f"wall{version}", "WALL=-0.2")
    found = []
    for step in ("10 ms", "0.5 ms"):
        text = BESIDE.replace("[inputs.force]", START).replace(
            'step = "10 ms"', f'step = "{step}"\ninterface = "model_exchange"'
        )
        system = read_system(with_file(fmu, text))
        found.append(shown(system, swung(5, seconds=2.0, force=np.zeros(200), start=0.5)))
    assert found[0].min() > -0.2 - 1e-6
    assert np.allclose(*found, atol=3e-4)
    rates = np.diff(found[1]) / 0.01
    hit = int(np.argmin(found[1]))
    assert rates[hit + 2] == pytest.approx(-0.5 * rates[hit - 2], rel=0.15)


def test_an_event_moves_without_jumps_with_a_parameter(folder):
    """Small changes of a start value change the place after a bounce in proportion."""
    fmu = build(folder, 2, "moved", "WALL=-0.2")
    text = BESIDE.replace("[inputs.force]", START).replace(
        'step = "10 ms"', 'step = "10 ms"\ninterface = "model_exchange"'
    )
    recording = swung(5, seconds=2.0, force=np.zeros(200), start=0.5)
    places = []
    for change in (0.0, 1e-6, 1e-4):
        changed = text.replace("start = { value = 0.5", f"start = {{ value = {0.5 + change!r}")
        places.append(shown(read_system(with_file(fmu, changed)), recording))
    small, large = (places[1] - places[0]) / 1e-6, (places[2] - places[0]) / 1e-4
    assert np.allclose(small, large, atol=5e-3 * np.abs(small).max())


@pytest.mark.parametrize("name", ["velocity_rate", "place"])
def test_an_effect_beside_an_event_acts_on_both_sides_of_it(folder, name):
    """Viscous friction on the derivative, or a lag of the sensor: steps of two lengths agree."""
    fmu = build(folder, 2, f"beside_{name}", "WALL=-0.2")
    kind = {"velocity_rate": "viscous_friction", "place": "lag"}[name]
    recording, found = swung(5, seconds=2.0, force=np.zeros(200), start=0.5), []
    for step in ("10 ms", "0.5 ms"):
        text = BESIDE.replace("[inputs.force]", START).replace(
            'step = "10 ms"', f'step = "{step}"\ninterface = "model_exchange"'
        )
        system = read_system(with_file(fmu, text + VELOCITY))
        effect = next(k for k in system.library if k.name == kind and k().place.name == name)
        found.append(shown(system, recording, effect()))
    assert np.allclose(*found, atol=5e-4)


def test_smaller_communication_steps_give_the_same(fmu, tmp_path):
    recording = swung(5, seconds=2.0)
    fine = tmp_path / "fine.toml"
    text = BESIDE.replace('step = "10 ms"', 'step = "2.5 ms"')
    fine.write_text(f'fmu = "{fmu}"\n{text}', encoding="utf-8")
    expected = shown(read_system(fmu), recording)
    assert np.allclose(shown(read_system(fine), recording), expected, atol=1e-6 * np.ptp(expected))


def test_a_linear_input_is_not_half_a_step_late(fmu, tmp_path):
    """For a linear input, steps of 10 ms and 1 ms differ only by the curvature of the input."""
    recording = swung(5, seconds=2.0, force=np.sin(0.1 * np.arange(200)))
    steps = ("10 ms", "1 ms")
    found = []
    for step in steps:
        path = tmp_path / f"{step.replace(' ', '')}.toml"
        text = BESIDE.replace('step = "10 ms"', f'step = "{step}"')
        text = text.replace('role = "force"', 'role = "force"\nheld = false')
        path.write_text(f'fmu = "{fmu}"\n{text}', encoding="utf-8")
        found.append(shown(read_system(path), recording))
    assert np.allclose(*found, atol=1e-3 * np.ptp(found[0]))


def test_what_an_fmu_lacks_is_named_with_its_size(folder):
    fmu = with_file(build(folder, 3, "named"))
    system = read_system(fmu)
    training, held_out = [swung(1, felt=dead)], [swung(2, felt=dead)]
    found = explained(system, training, held_out, ["dead_zone", "saturation", "lag", "cubic"])
    assert names(found) == ["dead_zone.force"], reported(found)
    assert holds(found, "dead_zone", "width", 0.3, slack=0.01)


def test_nothing_is_found_where_an_fmu_lacks_nothing(folder):
    """This FMU has a cubic spring, which the model file lacks."""
    fmu = with_file(build(folder, 2, "complete", "CUBE=0.15"))
    training, held_out = [swung(1, cubic(0.15))], [swung(2, cubic(0.15))]
    found = explained(read_system(fmu), training, held_out, ["dead_zone", "lag", "cubic"])
    assert not found.mismatch, reported(found)
    assert not found.effects


def test_the_command_takes_an_fmu_and_writes_a_file_that_reads_back(folder, tmp_path):
    fmu = with_file(build(folder, 2, "commanded"))
    runs = [recorded(tmp_path, seed) for seed in (1, 2)]
    done = CliRunner().invoke(
        app, ["explain", str(fmu), str(runs[0]), "--held-out", str(runs[1])], catch_exceptions=False
    )
    assert done.exit_code == 0, done.output
    assert "dead zone" in done.output
    improved = read_system(fmu.with_name("commanded.improved.toml"))
    assert [e.key for e in improved.effects] == ["dead_zone.force"]
    assert improved.values[0] == pytest.approx(97.0, rel=0.02)


def test_an_fmu_without_a_file_beside_it_shows_one_that_reads(fmu, folder):
    alone = folder / "alone.fmu"
    alone.write_bytes(fmu.read_bytes())
    with pytest.raises(InputError, match=r"alone\.toml") as fault:
        read_system(alone)
    shown = str(fault.value).partition("Begin with this:\n\n")[2].partition("\n  remedy")[0]
    alone.with_suffix(".toml").write_text(shown, encoding="utf-8")
    system = read_system(alone)
    assert list(system.file.parameters) == ["gain", "frequency", "damping", "start"]
    assert list(system.file.outputs) == ["position"]
    alone.with_suffix(".toml").unlink()


@pytest.mark.parametrize(
    ("written", "instead", "sentence"),
    [
        ("gain = {", "gian = {", r"no variable 'gian'(.|\n)*did you mean 'gain'"),
        ("gain = {", 'gain = { variable = "order",', "whole numbers|changes the structure"),
        ('variable = "position"', "", r"no variable 'place'"),
        ("[inputs.force]", '[inputs.force]\nvariable = "gain"', "cannot be used as input"),
        ("gain = {", 'gain = { variable = "velocity",', "cannot be used as parameter"),
        ('size = { value = 1, unit = "V" }', 'size = { value = 1, unit = "N" }', "contradict"),
        ('value = 10, unit = "rad/s"', 'value = 10, unit = "m"', "contradict"),
        ("value = 100,", "value = 2000,", r"outside of the bounds(.|\n)*0 to 1000"),
        (", plus_minus = 1 }", " }", "neither plus_minus nor bounds"),
        ('step = "10 ms"', 'setp = "10 ms"', "step"),
        ("[inputs.force]", '[inputs.force]\nalong = "speed"', "along = 'speed' is no output"),
        ('step = "10 ms"', 'step = "10 ms"\ninterface = "cosim"', "interface"),
    ],
)
def test_a_file_that_does_not_fit_is_refused_in_a_sentence(
    fmu, tmp_path, written, instead, sentence
):
    assert written in BESIDE
    path = tmp_path / "wrong.toml"
    path.write_text(f'fmu = "{fmu}"\n' + BESIDE.replace(written, instead, 1), encoding="utf-8")
    with pytest.raises(InputError, match=sentence):
        read_system(path)


def test_other_units_of_the_same_quantity_are_converted(fmu, tmp_path):
    path = tmp_path / "degrees.toml"
    text = BESIDE.replace('value = 10, unit = "rad/s"', f'value = {np.rad2deg(10)}, unit = "deg/s"')
    path.write_text(f'fmu = "{fmu}"\n{text}', encoding="utf-8")
    recording = swung(5, seconds=2.0)
    expected = shown(read_system(fmu), recording)
    assert np.allclose(shown(read_system(path), recording), expected, atol=1e-9)


def test_what_is_no_fmu_is_refused(tmp_path):
    path = tmp_path / "text.fmu"
    path.write_text("no archive", encoding="utf-8")
    with_file(path)
    with pytest.raises(InputError, match="no valid FMU"):
        read_system(path)


def test_an_fmu_for_another_platform_is_refused(folder):
    windows = build(folder, 2, "windows")
    made = folder / "windows-build" / "binaries"
    (made / "linux64").rename(made / "win64")
    (made / "win64" / "spring.so").rename(made / "win64" / "spring.dll")
    with zipfile.ZipFile(windows, "w") as packed:
        for file in made.parent.rglob("*"):
            packed.write(file, file.relative_to(made.parent))
    with_file(windows)
    with pytest.raises(InputError, match=r"no binary for this platform(.|\n)*win64"):
        read_system(windows)


@pytest.mark.parametrize("version", [2, 3])
def test_a_licence_that_is_missing_is_said_in_the_words_of_the_fmu(folder, version):
    fmu = with_file(build(folder, version, f"licensed{version}", "NO_LICENCE"))
    with pytest.raises(InputError, match=r"no licence on server licences\.example"):
        read_system(fmu).prepare(swung(5, seconds=2.0))


@pytest.mark.parametrize(
    ("fault", "sentence"),
    [
        (1, "did not return within 5 s"),
        (2, "SIGKILL"),
        (3, r"fmi2DoStep failed with status 3 \(error\)"),
        (4, "place is nan at sample 1"),
    ],
)
def test_an_fmu_that_fails_from_the_start_is_refused(folder, fault, sentence):
    """It fails above a gain of 105 N/kg/V, which the file takes as nominal."""
    fmu = build(folder, 2, f"fault{fault}", f"FAULT={fault}")
    text = BESIDE.replace("value = 100,", "value = 106,").replace('"60 s"', '"5 s"')
    with pytest.raises(InputError, match=sentence):
        read_system(with_file(fmu, text)).prepare(swung(5, seconds=2.0))


def test_an_fmu_that_fails_on_the_way_is_still_explained(folder):
    """Its nominal gain of 104.9 is close to the region where it fails; the true gain is 97."""
    fmu = build(folder, 2, "edge", "FAULT=4")
    text = BESIDE.replace("value = 100,", "value = 104.9,")
    training, held_out = [swung(1, felt=dead)], [swung(2, felt=dead)]
    system = read_system(with_file(fmu, text))
    found = explained(system, training, held_out, ["dead_zone", "lag"])
    assert names(found) == ["dead_zone.force"], reported(found)


def test_an_fmu_that_ends_its_simulation_is_said(folder):
    fmu = with_file(build(folder, 3, "ending", "STOPS_AT=1.0"))
    with pytest.raises(InputError, match=r"ended the simulation at 1\.0"):
        read_system(fmu).prepare(swung(5, seconds=2.0))
