"""Unusable recordings of a model file's system are rejected with a message."""

import re
from dataclasses import replace

import numpy as np
import pytest

from slipbench.identification.mismatch.runs import open_analysis, read_system
from slipbench.identification.mismatch.systems.recording_check import FREE
from slipbench.protocol.errors import InputError
from tests.identification.mismatch.spring import MODEL, recorded, system

SECONDS = 4.0


@pytest.fixture(scope="module")
def spring(tmp_path_factory):
    return system(tmp_path_factory.mktemp("spring"))


@pytest.fixture(scope="module")
def ridden():
    return recorded(5, seconds=SECONDS)


def but(ridden, role, **changes):
    channel = replace(ridden.channels[role], **changes)
    return replace(ridden, channels={**ridden.channels, role: channel})


def without(ridden, *roles):
    kept = {r: c for r, c in ridden.channels.items() if r not in roles}
    return replace(ridden, channels=kept)


def test_a_recording_without_its_drive_is_refused(spring, ridden):
    with pytest.raises(InputError, match="'force' was not recorded"):
        spring.prepare(without(ridden, "force"))


def test_a_recording_without_any_output_is_refused(spring, ridden):
    with pytest.raises(InputError, match="no output of the model file"):
        spring.prepare(without(ridden, "place"))


def test_a_recording_of_another_system_is_refused(spring, ridden):
    with pytest.raises(InputError, match=r"unit of place(.|\n)*expected: m\n(.|\n)*found: m/s"):
        spring.prepare(but(ridden, "place", unit="m/s"))


def test_a_dead_output_is_left_out_and_none_is_left(spring, ridden):
    dead = but(ridden, "place", value=np.full_like(ridden.channels["place"].value, 0.25))
    with pytest.raises(InputError, match=r"place: constant at 0.25"):
        spring.prepare(dead)


def test_a_recording_in_which_nothing_changes_is_refused(spring, ridden):
    rests = np.full_like(ridden.channels["force"].value, 0.5)
    still = but(but(ridden, "tilt", value=rests), "force", value=rests)
    assert spring.prepare(still).sensors
    with pytest.raises(InputError, match="nothing changes in the recording"):
        spring.prepare(but(still, "place", value=rests))


@pytest.mark.parametrize("constant", [0.0, 1.0])
def test_inputs_may_be_constant_where_an_output_changes_and_it_is_said(spring, constant):
    swings = recorded(5, seconds=SECONDS, released=0.8)
    rests = np.full_like(swings.channels["force"].value, constant)
    record = spring.prepare(but(swings, "force", value=rests))
    assert record.sensors
    assert FREE in record.notes


def test_samples_that_are_no_numbers_are_passed_over(spring, ridden):
    value = ridden.channels["force"].value.copy()
    value[100:103] = np.nan
    record = spring.prepare(but(ridden, "force", value=value))
    assert np.isfinite(record.inputs).all()


def test_a_gap_in_a_drive_cuts_the_recording_to_its_longest_piece(ridden, tmp_path):
    path = tmp_path / "spring.toml"
    path.write_text(MODEL.replace('role = "force"', 'role = "force"\nheld = false'), "utf-8")
    force = ridden.channels["force"]
    keep = (force.time < 1.0) | (force.time > 2.5)
    gappy = but(ridden, "force", time=force.time[keep], value=force.value[keep])
    record = read_system(path).prepare(gappy)
    assert record.start == pytest.approx(2.5, abs=0.02)
    assert "inputs have gaps (0.99 to 2.51 s): 2.51 to 3.99 s is analysed" in record.notes


def test_a_clock_that_cannot_be_laid_onto_the_drive_is_told(spring, ridden):
    rng = np.random.default_rng(6)
    place = ridden.channels["place"]
    noise = rng.standard_normal(place.value.size)
    strange = but(ridden, "place", clock="logger", time=place.time + 1e4, value=noise)
    with pytest.raises(InputError, match=r"correlation with the simulation is at most"):
        spring.prepare(strange)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_clock_is_laid_where_the_channel_tells_the_same_or_the_opposite(spring, ridden, sign):
    place = ridden.channels["place"]
    late = but(ridden, "place", clock="logger", time=place.time + 17.0, value=sign * place.value)
    ahead = re.search(r"is ([\d.]+) s ahead", spring.prepare(late).notes[0])
    assert ahead is not None
    assert float(ahead[1]) == pytest.approx(17.0, abs=0.02)


def test_a_model_file_that_cannot_run_is_refused(ridden, tmp_path):
    path = tmp_path / "spring.toml"
    path.write_text(MODEL.replace("damping = { value = 0.1", "damping = { value = -5"), "utf-8")
    with pytest.raises(InputError, match="cannot be simulated with its nominal parameters"):
        read_system(path).prepare(ridden)


def test_held_out_pieces_must_not_be_training_pieces(tmp_path):
    with pytest.raises(InputError, match="cannot validate"):
        open_analysis(tmp_path / "m.toml", [tmp_path / "a@0:60"], [tmp_path / "a@30:90"])
