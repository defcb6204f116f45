"""Free curves of a model file: simulated as written, calibrated, written by explain, read again."""

from pathlib import Path

import numpy as np
import pytest

from slipbench.identification.mismatch.analysis import accepted, begin
from slipbench.identification.mismatch.explain import analyse
from slipbench.identification.mismatch.reporting.conclude import verdict
from slipbench.identification.mismatch.reporting.improved import improved_system
from slipbench.identification.mismatch.runs import read_system
from slipbench.identification.mismatch.simulation.causal_partition import CausalPartition
from slipbench.identification.mismatch.simulation.model import Model
from slipbench.identification.mismatch.simulation.simulation_input import SimulationInput
from slipbench.identification.mismatch.systems.system import ModelSystem
from slipbench.protocol.errors import InputError
from tests.identification.mismatch.laws.explained import names, reported
from tests.identification.mismatch.laws.spring import MODEL, NOISE, swung

CHAIN = CausalPartition({"system": ()}, ())
CLOCK = """
[states.clock]
rate = "1"
size = { value = 5, unit = "s" }
"""
DISTURBANCE = "gain * force - frequency ** 2 * deflection - 2 * damping * frequency * velocity"


def curve(at: str, along: str, values: str, unit: str, along_unit: str, more: str = "") -> str:
    """A curve over knots at -5000, 0 and 5000."""
    return f"""
[[curves]]
at = "{at}"
along = "{along}"
knots = [-5000, 0, 5000]
along_unit = "{along_unit}"
values = {values}
unit = "{unit}"
{more}
"""


def read(folder: Path, text: str) -> ModelSystem:
    """The system of a model file."""
    path = folder / "spring.toml"
    path.write_text(text, encoding="utf-8")
    system = read_system(path)
    assert isinstance(system, ModelSystem)
    return system


def shown(
    system: ModelSystem, injection_point: str = "", waveform: np.ndarray | None = None
) -> np.ndarray:
    """Sensor reading of a ride, m. injection_point: where a waveform is added."""
    record = system.prepare(swung(5, seconds=3.0))
    quiet = np.zeros(record.slow.shape[1])
    added = {} if waveform is None else {injection_point: waveform}
    return system.simulate(SimulationInput(record, CHAIN, "system", quiet, added))["place"]


SEAM = '[seams.deflection]\nvalue = "position"'
SHOWN = 'role = "place"\nvalue = "position"'
SAME = {
    "seam along a state": (("deflection", "position", "m", "m"), SEAM, "position"),
    "seam along itself": (("deflection", "deflection", "m", "m"), SEAM, "position"),
    "rate along a speed": (("velocity_rate", "velocity", "m/s^2", "m/s"), DISTURBANCE, "velocity"),
    "rate along a rate": (
        ("velocity_rate", "position_rate", "m/s^2", "m/s"),
        DISTURBANCE,
        "velocity",
    ),
    "rate along a seam": (("velocity_rate", "deflection", "m/s^2", "m"), DISTURBANCE, "deflection"),
    "rate along an input": (("velocity_rate", "force", "m/s^2", "V"), DISTURBANCE, "force"),
    "output along a state": (("place", "velocity", "m", "m/s"), SHOWN, "velocity"),
    "output along a rate": (("place", "velocity_rate", "m", "m/s^2"), SHOWN, f"({DISTURBANCE})"),
}
"""A curve, the equation at its place, and the quantity of which it adds a tenth."""


@pytest.mark.parametrize("case", SAME)
def test_a_curve_acts_as_the_equation_that_it_stands_for(tmp_path, case):
    (at, along, unit, along_unit), equation, z = SAME[case]
    with_curve = MODEL + curve(at, along, "[500, 0, 500]", unit, along_unit)
    sum_of_both = f'{equation.rstrip(chr(34))} + 0.1 * abs({z})"'
    written = MODEL.replace(f'{equation.rstrip(chr(34))}"', sum_of_both)
    one, other = (shown(read(tmp_path, text)) for text in (with_curve, written))
    assert np.allclose(one, other, atol=1e-9)
    assert np.ptp(other - shown(read(tmp_path, MODEL))) > 1e-3


def test_a_curve_along_the_time_is_one_along_a_state_that_counts_it(tmp_path):
    one, other = (
        shown(read(tmp_path, MODEL + CLOCK + curve("force", z, "[0, 0, 5000]", "V", "s")))
        for z in ("time", "clock")
    )
    assert np.allclose(one, other, atol=1e-9)
    assert np.ptp(one - shown(read(tmp_path, MODEL))) > 0.1


def test_a_curve_along_the_rate_of_an_input_pushes_as_one_that_was_located(tmp_path):
    system = read(tmp_path, MODEL)
    record = system.prepare(swung(5, seconds=3.0))
    disturbance = np.abs(record.grid.rate(record.inputs[:, 0])) * 0.01
    wide = curve("force", "force_rate", "[50, 0, 50]", "V", "V/s")
    assert np.allclose(
        shown(read(tmp_path, MODEL + wide)), shown(system, "force", disturbance), atol=1e-9
    )


def test_units_of_knots_and_values_are_converted(tmp_path):
    si = MODEL + curve("deflection", "position", "[500, 0, 500]", "m", "m")
    mm = si.replace("[-5000, 0, 5000]", "[-5000000, 0, 5000000]").replace(
        'along_unit = "m"', 'along_unit = "mm"'
    )
    mm = mm.replace('[500, 0, 500]\nunit = "m"', '[500000, 0, 500000]\nunit = "mm"')
    assert mm != si
    assert np.allclose(shown(read(tmp_path, mm)), shown(read(tmp_path, si)), atol=1e-12)


GOOD = curve("deflection", "position", "[500, 0, 500]", "m", "m")
BAD = [
    (("deflection", "deflektion"), "deflection"),
    (('"position"', '"positoin"'), "position"),
    (('along = "position"', 'along = "velocity_rate"'), "cannot act along 'velocity_rate'"),
    (('along_unit = "m"', 'along_unit = "N"'), "does not convert"),
    (('\nunit = "m"', '\nunit = "V"'), "does not convert"),
    (("[-5000, 0, 5000]", "[0, 0, 50]"), "knots do not increase"),
    (("[500, 0, 500]", "[5, 0]"), "2 values for 3 knots"),
    (("[500, 0, 500]", "[5, 0, inf]"), "finite"),
    (("values", "value"), "values"),
]


@pytest.mark.parametrize(("change", "said"), BAD)
def test_a_curve_that_cannot_be_read_is_refused_in_words(tmp_path, change, said):
    with pytest.raises(InputError, match=said):
        read(tmp_path, MODEL + GOOD.replace(*change))


def test_half_widths_of_a_curve_are_one_each_and_not_below_zero(tmp_path):
    for half_widths, said in (("[1, 1]", "2 plus_minus for 3 knots"), ("[1, -1, 1]", "below 0")):
        text = MODEL + curve(
            "deflection", "position", "[500, 0, 500]", "m", "m", f"plus_minus = {half_widths}"
        )
        with pytest.raises(InputError, match=said):
            read(tmp_path, text)
    with pytest.raises(InputError, match="add their values"):
        read(tmp_path, MODEL + GOOD + GOOD)


KNOTS, HEIGHTS = (-2.0, -0.7, 0.7, 2.0), (0.15, -0.1, 0.1, -0.15)


def bent(x: float, v: float, t: float) -> float:
    """A deflection with a broken line added."""
    return x + float(np.interp(x, KNOTS, HEIGHTS))


def waved(x: float, v: float, t: float) -> float:
    """A deflection with a wave over the position."""
    return x + 0.04 * float(np.sin(4.0 * x))


def test_values_of_a_curve_are_calibrated_within_their_half_widths(tmp_path):
    """A curve with unknown values is calibrated to the values behind the recordings."""
    text = f"""
[[curves]]
at = "deflection"
along = "position"
knots = {list(KNOTS)}
along_unit = "m"
values = [0, 0, 0, 0]
unit = "m"
plus_minus = [0.5, 0.5, 0.5, 0.5]
"""
    known = MODEL.replace("value = 100,", "value = 97,").replace(
        "plus_minus = 20", "plus_minus = 0.05"
    )
    known = known.replace("value = 10,", "value = 10.3,").replace(
        "plus_minus = 1 ", "plus_minus = 0.01 "
    )
    system = read(tmp_path, known + text)
    training = [system.prepare(swung(s, bent, seconds=6.0)) for s in (1, 2)]
    found = analyse(begin(system, training, []), [])
    result = verdict(found)
    assert not result.mismatch, reported(result)
    again = read(tmp_path, improved_system(accepted(found)).text())
    (table,) = again.file.curves
    print(table.values, table.plus_minus)
    assert table.plus_minus is not None
    assert max(table.plus_minus) < 0.25
    slack = 2.0 * np.array(table.plus_minus) + 0.01
    assert np.all(np.abs(np.array(table.values) - HEIGHTS) < slack)


@pytest.fixture(scope="module")
def explained(tmp_path_factory):
    """An analysis of a spring with a wave that no effect of its library describes."""
    rides = [swung(s, waved, seconds=8.0) for s in (1, 2, 3)]
    nominal = read(tmp_path_factory.mktemp("spring"), MODEL)
    return rides, analysed(nominal, rides)


def analysed(system: ModelSystem, rides):
    records = [system.prepare(r) for r in rides]
    few = {"quadratic.deflection", "asymmetry.deflection", "dead_zone.deflection"}
    kinds = [k for k in system.library if k().key in few]
    return analyse(begin(system, records[:2], records[2:]), kinds)


def test_a_free_curve_goes_into_the_improved_file_which_simulates_as_the_fit(explained, tmp_path):
    rides, found = explained
    fit = accepted(found)
    result = verdict(found)
    assert result.curve is not None, reported(result)
    again = read(tmp_path, improved_system(fit).text())
    assert len(again.file.curves) == 1
    model: Model = fit.model
    there = model.at(fit.point)
    for ride in rides[:2]:
        record = again.prepare(ride)
        ride_input = SimulationInput.undisturbed(record, CHAIN, "system")
        one, other = (s.simulate(ride_input)["place"] for s in (again, there))
        assert np.allclose(one, other, atol=1e-6 * np.ptp(other))


def test_a_second_analysis_with_the_improved_file_finds_nothing(explained, tmp_path):
    rides, found = explained
    system = read(tmp_path, improved_system(accepted(found)).text())
    second = analysed(system, rides)
    result = verdict(second)
    assert not result.mismatch, reported(result)
    assert not names(result)
    (error,) = result.held_out
    assert error.nominal < 2.0 * NOISE, reported(result)
    curves = [c for c in system.coordinates([], CHAIN) if c.owner.startswith("curves.")]
    assert len(curves) == len(system.curves[0].knots)
    third = read(tmp_path, improved_system(accepted(second)).text())
    assert len(third.file.curves) == 1
    assert third.file.curves[0].knots == system.file.curves[0].knots
