"""What cannot be explained is refused in words, and what was interrupted says what it has."""

from dataclasses import replace
from pathlib import Path

import pytest

from identification.mismatch.explain import begin, verdict
from identification.mismatch.memo import lines
from identification.mismatch.runs import open_analysis
from protocol.errors import InputError
from tests.identification.mismatch.conditions import nominal, system
from tests.identification.motorcycle_recording import TRAINING, ride


def test_held_out_runs_must_not_be_training_runs(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="prove nothing"):
        open_analysis(tmp_path / "vehicle.toml", [tmp_path / "a"], [tmp_path / "a"])


def test_a_recording_without_any_output_is_refused() -> None:
    recording = ride(nominal().motorcycle, replace(TRAINING[0], seconds=3.0))
    kept = {"throttle_command": recording.channels["throttle_command"]}
    with pytest.raises(InputError, match="no channel"):
        system().prepare(replace(recording, channels=kept))


def test_an_analysis_that_was_stopped_at_once_still_says_something() -> None:
    record = system().prepare(ride(nominal().motorcycle, replace(TRAINING[0], seconds=4.0)))
    said = lines(verdict(begin(system(), [record], [])))
    assert said[0].startswith("Interrupted")
