"""Invalid input is rejected with a message; an interrupted analysis reports its results."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from slipbench.identification.mismatch.analysis import begin
from slipbench.identification.mismatch.reporting.conclude import verdict
from slipbench.identification.mismatch.reporting.memo import lines, sentence
from slipbench.identification.mismatch.runs import open_analysis, read_system, same_recording
from slipbench.plant.vehicles import builtin_vehicle
from slipbench.protocol.errors import InputError
from tests.identification.mismatch.conditions import nominal, system
from tests.identification.motorcycle_recording import TRAINING, ride


def test_held_out_runs_must_not_be_training_runs(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot validate"):
        open_analysis(tmp_path / "vehicle.toml", [tmp_path / "a"], [tmp_path / "a"])


def test_a_recording_without_any_output_is_refused() -> None:
    recording = ride(nominal().motorcycle, replace(TRAINING[0], seconds=3.0))
    kept = {"throttle_command": recording.channels["throttle_command"]}
    with pytest.raises(InputError, match="no channel"):
        system().prepare(replace(recording, channels=kept))


def test_an_analysis_that_was_stopped_at_once_concludes_nothing() -> None:
    record = system().prepare(ride(nominal().motorcycle, replace(TRAINING[0], seconds=4.0)))
    found = verdict(begin(system(), [record], []))
    assert lines(found)[0].startswith("Interrupted")
    assert found.mismatch is None
    assert found.p_value is None
    assert "no conclusion" in sentence(found)


def test_a_dead_channel_is_left_out_and_the_others_are_judged() -> None:
    recording = ride(nominal().motorcycle, replace(TRAINING[0], seconds=3.0))
    engine = recording.channels["engine_speed"]
    dead = replace(engine, value=np.full(engine.value.size, 1200.0))
    record = system().prepare(
        replace(recording, channels={**recording.channels, "engine_speed": dead})
    )
    assert "engine_speed" not in record.sensors
    assert "rear_teeth" in record.sensors
    assert any("engine_speed: constant at 1200" in why for why in record.left_out)


def test_channels_whose_clock_cannot_be_aligned_are_left_out_with_the_reason() -> None:
    recording = ride(nominal().motorcycle, replace(TRAINING[0], seconds=3.0))
    optical = recording.channels["optical_speed"]
    rng = np.random.default_rng(8)
    lost = replace(optical, time=np.sort(rng.uniform(0.0, 3e4, optical.time.size)))
    record = system().prepare(
        replace(recording, channels={**recording.channels, "optical_speed": lost})
    )
    assert "rear_teeth" in record.sensors
    if "optical_speed" not in record.sensors:
        assert any(why.startswith("optical_speed: clock") for why in record.left_out)


def test_a_missing_channel_leaves_the_blocks_that_can_be_seen() -> None:
    trial = replace(TRAINING[0], seconds=4.0, drop=("engine_speed", "optical_speed"))
    record = system().prepare(ride(nominal().motorcycle, trial))
    outputs = begin(system(), [record], []).training.partition.groups[1].outputs
    assert outputs == ("rear_teeth", "front_teeth")


def test_a_copy_of_a_training_run_is_recognised() -> None:
    one, again = (
        system().prepare(ride(nominal().motorcycle, replace(TRAINING[0], seconds=3.0)))
        for _ in range(2)
    )
    other = system().prepare(ride(nominal().motorcycle, replace(TRAINING[0], seconds=3.0, seed=9)))
    assert same_recording(one, again)
    assert not same_recording(one, other)


def test_a_recording_of_another_vehicle_is_refused() -> None:
    other = replace(nominal().motorcycle, gears=tuple(1.4 * g for g in nominal().motorcycle.gears))
    record = system().prepare(ride(other, replace(TRAINING[0], engine_speed=1300.0, seconds=3.0)))
    with pytest.raises(InputError, match="another vehicle"):
        system().check(record)


def test_impossible_parameters_are_refused_in_words(tmp_path: Path) -> None:
    text = builtin_vehicle("nominal").read_text(encoding="utf-8")
    path = tmp_path / "vehicle.toml"
    path.write_text(text.replace("mass", "mas"), encoding="utf-8")
    with pytest.raises(InputError, match="mas"):
        read_system(path)
