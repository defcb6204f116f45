"""An FMU with effects around it: it simulates what `explain` simulates, in any tool."""

import zipfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from slipbench.identification.mismatch.callables.fmu.fmu_system import open_fmu
from slipbench.identification.mismatch.callables.fmu.wrapper.check import (
    explained,
    held,
    largest_deviation,
    levels,
    simulated_by_wrapper,
)
from slipbench.identification.mismatch.callables.fmu.wrapper.export import write_wrapper
from slipbench.identification.mismatch.callables.fmu.wrapper.sides import Sides
from slipbench.identification.mismatch.systems.model_file import ActingEffect
from slipbench.identification.mismatch.systems.placing import Read, library
from slipbench.protocol.extras import optional_library
from tests.identification.mismatch.callables.fmus.building import (
    BESIDE,
    WITHOUT_INPUT,
    build,
    needs_compiler,
)

pytestmark = needs_compiler
ROUNDING = 1e-9  # of the largest output
STATES = """
[states.position]
rate = "velocity"
size = { value = 1, unit = "m" }

[states.velocity]
along = "velocity"
size = { value = 10, unit = "m/s" }

[inputs.force]"""
AROUND = {  # effects without and with memories and states of their own, delays, other quantities
    "dead_zone": ("force", "place"),
    "hysteresis": ("force", "place"),
    "many_plays": ("force",),
    "delay": ("force",),
    "lag": ("force", "place"),
    "elastic_transmission": ("force",),
    "rate_limit": ("force",),
    "thermal_gain": ("force",),
    "leak_from_channel": ("place",),
    "moving_average": ("place",),
    "sensor_delay": ("place",),
}
INSIDE = {
    "viscous_friction": ("velocity_rate",),
    "presliding": ("velocity_rate",),
    "elastic_load": ("position_rate", "velocity_rate"),
    "jerk_limit": ("velocity_rate",),
    "overflow": ("velocity_rate",),
    "dead_zone": ("force",),
    "lag": ("place",),
}
DEAD = """
[[effects]]
name = "dead_zone"
at = "force"
[effects.values]
width = { value = 0.3, unit = "V" }
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("wrappers")


@pytest.fixture(scope="module", params=[2, 3], ids=["FMI 2.0", "FMI 3.0"])
def fmu(request, folder):
    return build(folder, request.param, f"spring{request.param}")


def headers():
    return Path(optional_library("fmpy").__file__).parent / "c-code"


def opened(fmu, text=BESIDE, name="beside"):
    """Text of the model file; its calibrated gain differs from the gain of the FMU."""
    path = fmu.with_name(f"{name}.toml")
    text = text.replace("value = 100,", "value = 90,")
    path.write_text(f'fmu = "{fmu.name}"\n{text}', encoding="utf-8")
    return open_fmu(path)


def in_model_exchange(text=BESIDE, step="10 ms"):
    exchanged = text.replace('step = "10 ms"', f'step = "{step}"\ninterface = "model_exchange"', 1)
    return exchanged.replace("[inputs.force]", STATES)


def wrapped(sides, path):
    write_wrapper(path, sides, headers())
    return path


def at_every_place(one, wanted):
    """The file with one effect of typical size, for each of the requested places."""
    for kind in library(Read(one.model)):
        if kind.place.name in wanted.get(kind.name, ()):
            numbers = zip(kind.parameters(), kind().values(), strict=True)
            values = {p.name: {"value": float(v), "unit": p.unit} for p, v in numbers}
            using = kind.place.other if kind.uses == "channel" else ""
            entry = ActingEffect(name=kind.name, at=kind.place.name, using=using, values=values)
            yield entry, replace(one, model=one.model.model_copy(update={"effects": (entry,)}))


@pytest.mark.parametrize(
    ("version", "text", "wanted"),
    [(2, BESIDE, AROUND), (3, in_model_exchange(step="5 ms"), INSIDE)],
    ids=["co-simulation, FMI 2.0", "model exchange, FMI 3.0"],
)
def test_a_wrapper_simulates_what_explain_simulates(folder, tmp_path, version, text, wanted):
    """Effects with states, memories and delays, at inputs, derivatives and outputs."""
    fmu, wrapped_places = build(folder, version, f"every{version}"), set()
    for number, (entry, one) in enumerate(at_every_place(opened(fmu, text), wanted)):
        path = wrapped(Sides(one), tmp_path / f"{number}.fmu")
        apart = largest_deviation(path, Sides(one))
        assert apart < ROUNDING, f"{entry.name} at {entry.at}: {apart:.3g}"
        wrapped_places.add((entry.name, entry.at))
    assert wrapped_places == {(name, place) for name, places in wanted.items() for place in places}


def test_an_fmu_without_inputs_has_a_wrapper(fmu, tmp_path):
    number = 0
    for entry, one in at_every_place(opened(fmu, WITHOUT_INPUT, "alone"), AROUND):
        path = wrapped(Sides(one), tmp_path / f"{entry.name}.fmu")
        assert largest_deviation(path, Sides(one)) < ROUNDING, entry.name
        number += 1
    assert number >= 3


def test_several_effects_act_in_the_order_of_the_library(fmu, tmp_path):
    text = (
        BESIDE
        + DEAD
        + DEAD.replace("dead_zone", "lag").replace(
            'width = { value = 0.3, unit = "V" }', 'time_constant = { value = 30, unit = "ms" }'
        )
    )
    sides = Sides(opened(fmu, text))
    assert len(sides.acting) == 2
    assert largest_deviation(wrapped(sides, tmp_path / "two.fmu"), sides) < ROUNDING


@pytest.mark.parametrize("version", [2, 3])
def test_events_of_model_exchange_are_handled(folder, tmp_path, version):
    """A wall at -0.2 m; a delay acts before it."""
    fmu = build(folder, version, f"wall{version}", "WALL=-0.2")
    sides = Sides(opened(fmu, in_model_exchange(BESIDE + DEAD, "1 ms")))
    file = held(sides.opened.model)
    inputs = levels(sides, np.random.default_rng(2))
    path = wrapped(sides, tmp_path / "wall.fmu")
    expected, found = (
        explained(sides, file, inputs),
        simulated_by_wrapper(path, sides.opened, inputs),
    )
    assert np.allclose(found["place"], expected["place"], atol=ROUNDING)


class Ridden:
    """A wrapper in fmpy: variables by name."""

    def __init__(self, path, folder):
        fmpy = optional_library("fmpy")
        self.description = fmpy.read_model_description(str(path), validate=False)
        self.version = self.description.fmiVersion[0]
        self.references = {v.name: v.valueReference for v in self.description.modelVariables}
        self.said = []
        module = optional_library(f"fmpy.fmi{self.version}")
        self.slave = getattr(module, f"FMU{self.version}Slave")(
            guid=self.description.guid,
            unzipDirectory=fmpy.extract(str(path), str(folder)),
            modelIdentifier=self.description.coSimulation.modelIdentifier,
            instanceName="one",
        )
        listening = {"logMessage": lambda _, __, ___, said: self.said.append(said.decode())}
        self.slave.instantiate(**(listening if self.version == "3" else {}))

    def begin(self, **values):
        if self.version == "2":
            self.slave.setupExperiment(startTime=0.0)
        for name, value in values.items():
            self.put(name.replace("__", "."), value)
        self.slave.enterInitializationMode()
        self.slave.exitInitializationMode()
        return self

    def put(self, name, value):
        put = self.slave.setReal if self.version == "2" else self.slave.setFloat64
        put([self.references[name]], [value])

    def get(self, name):
        get = self.slave.getReal if self.version == "2" else self.slave.getFloat64
        return get([self.references[name]])[0]

    def ride(self, forces, step=0.01):
        found = []
        for k, force in enumerate(forces):
            self.put("force", force)
            self.slave.doStep(k * step, step)
            found.append(self.get("position"))
        return np.array(found)


FORCES = np.repeat([0.2, 1.0, -0.8, 0.5], 20)


@pytest.fixture(scope="module")
def dead(fmu, folder):
    name = f"dead zone ä {fmu.stem}.fmu"  # a path as people have them
    return wrapped(Sides(opened(fmu, BESIDE + DEAD)), folder / name)


def test_sizes_of_effects_are_parameters(dead, tmp_path):
    """A dead zone without width is none; one wider than all forces transmits no force."""
    width = "effects__dead_zone__force__width"
    plain = Ridden(dead, tmp_path / "plain ä").begin(**{width: 0.0}).ride(FORCES)
    zone = Ridden(dead, tmp_path / "zone").begin().ride(FORCES)
    still = Ridden(dead, tmp_path / "still").begin(**{width: 2.0}).ride(FORCES)
    assert not still.any()
    assert np.abs(plain).max() > 1.2 * np.abs(zone).max() > 0.0


def test_it_starts_calibrated_and_its_parameters_can_be_set(dead, tmp_path):
    """A linear spring: the position is proportional to the gain."""
    calibrated = Ridden(dead, tmp_path / "one").begin()
    assert calibrated.get("gain") == 90.0
    other = Ridden(dead, tmp_path / "two").begin(gain=45.0)
    assert np.allclose(calibrated.ride(FORCES), 2.0 * other.ride(FORCES), rtol=1e-9)


def test_two_instances_do_not_share_their_past(dead, tmp_path):
    one = Ridden(dead, tmp_path / "one").begin()
    alone = one.ride(FORCES)
    two, three = (Ridden(dead, tmp_path / name).begin() for name in ("two", "three"))
    found = []
    for k, force in enumerate(FORCES):
        for instance, value in ((two, force), (three, -3.0 * force)):
            instance.put("force", value)
            instance.slave.doStep(0.01 * k, 0.01)
        found.append(two.get("position"))
    assert np.array_equal(found, alone)


def test_what_it_cannot_do_is_refused_in_words(dead, tmp_path):
    ridden_one = Ridden(dead, tmp_path / "one").begin()
    ridden_one.ride(FORCES[:3])
    with pytest.raises(Exception, match="DoStep"):
        ridden_one.slave.doStep(0.03, 0.02)
    with pytest.raises(Exception, match=r"Set(Real|Float64)"):
        ridden_one.put("effects.dead_zone.force.width", 0.1)
    with pytest.raises(Exception, match=r"Set(Real|Float64)"):
        Ridden(dead, tmp_path / "two").begin(effects__dead_zone__force__width=-1.0)
    if ridden_one.version == "3":
        assert any("length of the first one, 0.01 s" in said for said in ridden_one.said)


def test_a_wrapper_can_be_wrapped_again(dead, tmp_path):
    """The widths add up: the dead zones act in series."""
    text = BESIDE + DEAD.replace("0.3", "0.2")
    again = tmp_path / "again.fmu"
    again.write_bytes(dead.read_bytes())
    path = wrapped(Sides(opened(again, text)), tmp_path / "twice.fmu")
    twice = Ridden(path, tmp_path / "twice").begin().ride(FORCES)
    once = Ridden(dead, tmp_path / "once").begin(effects__dead_zone__force__width=0.5)
    assert np.allclose(twice, once.ride(FORCES), atol=1e-12)


def test_effects_that_are_not_causal_are_left_out_by_name(fmu):
    text = BESIDE + DEAD.replace("dead_zone", "clock_offset").replace("force", "place").replace(
        'width = { value = 0.3, unit = "V" }', 'offset = { value = -20, unit = "ms" }'
    )
    sides = Sides(opened(fmu, text))
    assert sides.left_out == ("clock_offset.place",)
    assert not sides.acting


def test_along_an_output_the_wrapper_comes_closer_with_smaller_steps(fmu, tmp_path):
    """The FMU receives the speed at the start of a step only and extrapolates it linearly."""
    apart = []
    for step in ("10 ms", "2.5 ms"):
        text = BESIDE.replace('step = "10 ms"', f'step = "{step}"', 1)
        text = text.replace("[inputs.force]", '[inputs.force]\nalong = "place"')
        text += DEAD.replace("dead_zone", "viscous_friction").replace("width", "coefficient")
        text = text.replace('value = 0.3, unit = "V"', 'value = 0.3, unit = "V/m"')
        sides = Sides(opened(fmu, text))
        path = wrapped(sides, tmp_path / f"{step.replace(' ', '')}.fmu")
        apart.append(largest_deviation(path, sides))
    assert ROUNDING < apart[1] < 0.4 * apart[0]


def test_the_fmu_inside_is_the_one_that_was_given(fmu, dead):
    with zipfile.ZipFile(dead) as packed, zipfile.ZipFile(fmu) as inside:
        for name in inside.namelist():
            if not name.endswith("/"):
                assert packed.read(f"resources/inner/{name}") == inside.read(name)


@pytest.mark.parametrize("version", [2, 3])
def test_a_wrapper_handles_events_where_explain_does(folder, version):
    """A mass that bounces at a wall under steps of force, with and without internal friction."""
    wall = build(folder, version, f"bounced{version}", "WALL=-0.02")
    plain = opened(wall, in_model_exchange(), "plain")
    _, rubbed = next(at_every_place(plain, {"viscous_friction": ("velocity_rate",)}))
    for number, one in enumerate((plain, rubbed)):
        sides = Sides(one)
        path = wrapped(sides, folder / f"bouncing{version}{number}.fmu")
        assert largest_deviation(path, sides) < ROUNDING
