"""Effects periodic in an angle: as a curve of a model file, and hidden in recordings."""

from pathlib import Path

import numpy as np
import pytest

from slipbench.identification.mismatch.simulation.causal_partition import CausalPartition
from slipbench.identification.mismatch.simulation.simulation_input import SimulationInput
from slipbench.identification.mismatch.systems.placing import unseen_angle
from slipbench.identification.mismatch.systems.system import ModelSystem
from slipbench.protocol.errors import InputError
from tests.identification.mismatch.laws.drum import NOISE, drum, orders, text_of, turned
from tests.identification.mismatch.laws.explained import explained, holds, names, reported

CHAIN = CausalPartition({"system": ()}, ())
FEW = ("unbalance", "cogging", "torque_ripple", "friction", "offset", "saturation")
KNOTS = np.linspace(0.0, 2.0 * np.pi, 24, endpoint=False)


def curve(knots: np.ndarray, values: np.ndarray, along: str = "angle", unit: str = "rad") -> str:
    """A periodic curve of the torque."""
    return f"""
[[curves]]
at = "torque"
along = "{along}"
knots = {[float(k) for k in knots]}
along_unit = "{unit}"
values = {[float(v) for v in values]}
unit = "rad/s^2"
periodic = true
"""


def speed_of(system: ModelSystem) -> np.ndarray:
    """Speed as simulated."""
    record = system.prepare(turned(3, "tacho", orders(), seconds=4.0))
    return system.simulate(SimulationInput.undisturbed(record, CHAIN, "system"))["speed"]


def a_wave(folder: Path, order: int = 2, knots: np.ndarray = KNOTS) -> ModelSystem:
    return drum(folder, text_of("tacho", curve(knots, 4.0 * np.sin(order * knots + 0.3))))


@pytest.mark.parametrize("turns", [1, -2, 7])
def test_a_periodic_curve_is_the_same_whole_turns_on(tmp_path, turns):
    text = a_wave(tmp_path).text()
    here, there, at_other_phase = (
        speed_of(drum(tmp_path, text.replace("start = { value = 0", f"start = {{ value = {begun}")))
        for begun in (0.0, 2.0 * np.pi * turns, 1.0)
    )
    assert np.abs(here - there).max() < 1e-9
    assert np.abs(here - at_other_phase).max() > 0.05


def test_a_periodic_curve_acts_as_the_wave_that_it_stands_for(tmp_path):
    curved = speed_of(a_wave(tmp_path))
    written = text_of("tacho").replace(
        'damping * speed"', 'damping * speed + 4 * sin(2 * angle + 0.3)"'
    )
    assert np.abs(curved - speed_of(drum(tmp_path, written))).max() < 2e-3


def test_knots_may_begin_anywhere_in_the_turn(tmp_path):
    one = speed_of(a_wave(tmp_path))
    assert np.abs(one - speed_of(a_wave(tmp_path, knots=KNOTS + KNOTS[5]))).max() < 1e-9
    assert np.abs(one - speed_of(a_wave(tmp_path, knots=KNOTS - KNOTS[7]))).max() < 1e-9


def test_a_periodic_curve_is_read_as_it_is_written(tmp_path):
    system = a_wave(tmp_path)
    again = drum(tmp_path, system.text())
    assert again.file.curves[0].periodic
    assert again.curves[0].knots == pytest.approx(system.curves[0].knots)
    assert again.curves[0].heights == pytest.approx(system.curves[0].heights)


def test_what_cannot_repeat_every_turn_is_refused_in_words(tmp_path):
    with pytest.raises(InputError, match="'drive' does not repeat every turn"):
        drum(tmp_path, text_of("tacho", curve(KNOTS, KNOTS, "drive", "V")))
    with pytest.raises(InputError, match="span more than a turn"):
        drum(tmp_path, text_of("tacho", curve(2.0 * KNOTS, KNOTS)))


def test_an_angle_is_unseen_where_no_equation_and_no_output_tells_it(tmp_path):
    assert unseen_angle(drum(tmp_path, text_of("tacho")).file) == "angle"
    assert not unseen_angle(drum(tmp_path, text_of("encoder")).file)
    exact = 'unit = "rad" }\nfirst = { value = 0, unit = "rad" }\n\n[states.speed]'
    exact_text = text_of("tacho").replace('unit = "rad" }\n\n[states.speed]', exact)
    assert not unseen_angle(drum(tmp_path, exact_text).file)
    forces = {
        k.name: k.unseen_turn for k in drum(tmp_path, text_of("tacho")).library if k.place.other
    }
    assert forces["cogging"]
    assert not forces["presliding"]  # it depends only on the angle since the last reversal
    leaning = text_of("tacho").replace('damping * speed"', 'damping * speed - sin(angle)"')
    assert not unseen_angle(drum(tmp_path, leaning).file)


def test_a_force_along_an_unseen_angle_is_named_with_its_size(tmp_path):
    """The initial angle of each training and held-out recording is unknown."""
    hidden = orders((3, 4.0, 0.3))
    rides = [turned(seed, "tacho", hidden) for seed in range(5)]
    verdict = explained(drum(tmp_path, text_of("tacho")), rides[:3], rides[3:], FEW)
    assert names(verdict) == ["cogging.torque/angle"], reported(verdict)
    assert holds(verdict, "cogging", "amplitude", 4.0)
    (error,) = verdict.held_out
    assert error.improved < 1.1 * NOISE["tacho"] < 0.5 * error.calibrated, reported(verdict)


def test_without_a_ripple_an_unseen_angle_is_nothing(tmp_path):
    rides = [turned(seed, "tacho", orders()) for seed in range(5)]
    verdict = explained(drum(tmp_path, text_of("tacho")), rides[:3], rides[3:], FEW)
    assert not verdict.mismatch, reported(verdict)


def test_what_no_name_describes_is_told_along_the_turn(tmp_path):
    """A sum of lines: one effect has one order, so the curve around the turn explains more."""
    hidden = orders((1, 5.0, 0.4), (2, 4.0, 2.0), (3, 4.0, 1.0))
    rides = [turned(seed, "encoder", hidden) for seed in range(4)]
    verdict = explained(
        drum(tmp_path, text_of("encoder")), rides[:3], rides[3:], ("friction", "saturation")
    )
    assert verdict.unknown, reported(verdict)
    assert verdict.location is not None
    assert verdict.location.regressor == "turn of angle", reported(verdict)
    assert "repeats every turn" in verdict.location.shape
    (error,) = verdict.held_out  # an angle integrates small parameter errors
    assert error.improved < 3.0 * NOISE["encoder"] < 0.2 * error.calibrated, reported(verdict)
