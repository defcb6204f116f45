"""A case's recordings go the ordinary way: over the database, the bus, and into run folders."""

from pathlib import Path

import numpy as np
import pytest

from slipbench.identification.signals.aligned import aligned
from slipbench.identification.signals.samples import onto
from slipbench.identification.signals.teeth import speed_from_teeth
from slipbench.protocol.recording.run_folder import read
from slipbench.studies.blind_validation.generator.case import draw_case
from slipbench.studies.blind_validation.generator.recording import course_of, write_run
from slipbench.studies.blind_validation.generator.wire import arrivals, packed

SEED = 5


@pytest.fixture(scope="module")
def ridden(tmp_path_factory):
    case = draw_case(SEED, 0)
    trial = case.training[1]
    folder = write_run(
        tmp_path_factory.mktemp("runs") / "one", case.truth, case.faults, trial, dict(case.vehicle)
    )
    return case, course_of(case.truth, case.faults, trial)[0], aligned(read(folder))


def test_no_frame_is_faulty_and_every_clock_is_aligned(ridden) -> None:
    _, _, data = ridden
    assert not data.recording.faults
    wanted = {
        "throttle_command",
        "throttle_position",
        "engine_speed",
        "optical_speed",
        "rear_teeth",
        "front_teeth",
        "trial_phase",
    }
    assert wanted <= set(data.time)


@pytest.mark.parametrize(
    ("role", "column", "noise"),
    [
        ("throttle_position", "plate", 1e-3),
        ("engine_speed", "crank_speed", 0.6),
        ("optical_speed", "optical", 0.05),
    ],
)
def test_channels_tell_what_was_ridden(ridden, role: str, column: str, noise: float) -> None:
    case, course, data = ridden
    time = data.time[role] - case.truth.noises.latency
    true = np.interp(time, course.time, getattr(course, column))
    assert np.std(data.recording.channels[role].value - true) < noise


@pytest.mark.parametrize(("wheel", "column"), [("rear", "wheel_speed"), ("front", "front_speed")])
def test_teeth_tell_the_speed_of_their_wheel(ridden, wheel: str, column: str) -> None:
    case, course, data = ridden
    time = data.time[f"{wheel}_teeth"] - case.truth.noises.latency
    speed = speed_from_teeth(time, data.recording.channels[f"{wheel}_teeth"].value, 16)
    grid = np.arange(1.0, 11.0, 0.01)
    true = np.interp(grid, course.time, getattr(course, column))
    assert np.std(onto(speed, grid) - true) < 2e-3 * np.mean(true)


def test_frames_follow_each_other_on_the_wire_and_the_lowest_identifier_goes_first() -> None:
    rng = np.random.default_rng(SEED)
    ready = np.sort(rng.integers(0, 20_000_000, 150))
    ready[10:20] = ready[10]
    identifier = rng.integers(1, 2000, ready.size)
    length = rng.integers(80_000, 130_000, ready.size)
    ends = arrivals(ready, identifier, length)
    begins = ends - length
    order = np.argsort(begins)
    assert np.all(begins >= ready)
    assert np.all(begins[order][1:] >= ends[order][:-1])
    together = np.arange(10, 20)[np.argsort(ends[10:20])]
    assert np.all(np.diff(identifier[together][1:]) >= 0)


def test_no_tooth_is_lost_between_frames_and_no_frame_is_too_full() -> None:
    rng = np.random.default_rng(SEED)
    tooth = np.cumsum(rng.integers(2_000_000, 9_000_000, 500))
    frame = packed(tooth, 3, 5_000_000)
    assert np.all(np.diff(frame) >= 0)
    assert set(np.unique(frame)) == set(range(frame[-1] + 1))
    assert np.bincount(frame).max() <= 3


def test_a_run_folder_is_written_alike_twice(ridden, tmp_path: Path) -> None:
    case = ridden[0]
    texts = [
        (
            write_run(
                tmp_path / name, case.truth, case.faults, case.held_out[0], dict(case.vehicle)
            )
            / "frames.log"
        ).read_bytes()
        for name in "ab"
    ]
    assert texts[0] == texts[1]
