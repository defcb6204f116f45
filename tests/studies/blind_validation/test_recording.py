"""A case's recordings go the ordinary way: over the database, the bus, and into run folders."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from slipbench.identification.signals.aligned import aligned
from slipbench.identification.signals.samples import onto
from slipbench.identification.signals.teeth import speed_from_teeth
from slipbench.protocol.recording.run_folder import read
from slipbench.studies.blind_validation.generator.case import draw_case
from slipbench.studies.blind_validation.generator.filters import (
    LAG,
    MEAN,
    Filter,
    filtered,
    low_pass,
    moving_mean,
)
from slipbench.studies.blind_validation.generator.frames import Line, Sent, repeated
from slipbench.studies.blind_validation.generator.instruments import ChannelFaults, sampled
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


def test_every_clock_is_aligned_and_frames_are_lost_or_repeated_only_as_drawn(ridden) -> None:
    case, _, data = ridden
    line = case.training[1].line
    found = {f.fault for f in data.recording.faults}
    assert found <= {"lost", "repeated"}
    assert line.lost > 0.0 or "lost" not in found
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
    shown, step = getattr(course, column), course.time[1] - course.time[0]
    if role in case.truth.filters:
        shown = filtered(shown, step, case.truth.filters[role])
    true = np.interp(time, course.time, shown)
    assert np.std(data.recording.channels[role].value - true) < noise


@pytest.mark.parametrize(("wheel", "column"), [("rear", "wheel_speed"), ("front", "front_speed")])
def test_teeth_tell_the_speed_of_their_wheel(ridden, wheel: str, column: str) -> None:
    case, course, data = ridden
    time = data.time[f"{wheel}_teeth"] - case.truth.noises.latency
    speed = speed_from_teeth(time, data.recording.channels[f"{wheel}_teeth"].value, 16)
    grid = np.arange(1.0, 11.0, 0.01)
    true = np.interp(grid, course.time, getattr(course, column))
    error = onto(speed, grid) - true  # NaN where the logger lost teeth
    assert np.mean(np.isnan(error)) < 0.1
    assert np.nanstd(error) < 2e-3 * np.mean(true)


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


def test_filters_delay_a_ramp_by_their_group_delay_and_keep_a_constant() -> None:
    step = 0.5e-3
    time = step * np.arange(4000)
    for chosen in (Filter(LAG, 7e-3), Filter(MEAN, 13.3e-3)):
        assert np.allclose(filtered(np.full(200, 3.0), step, chosen), 3.0)
        late = time - filtered(time, step, chosen)
        assert late[-1] == pytest.approx(chosen.group_delay, abs=step)


@pytest.mark.parametrize("window", [0.7e-3, 1.0e-3, 1.8223e-3, 13.3e-3])
def test_the_mean_of_a_ramp_is_late_by_half_the_window_whatever_the_step(window: float) -> None:
    time = 0.5e-3 * np.arange(4000)
    late = (time - moving_mean(time, 0.5e-3, window))[100:]
    assert np.allclose(late, 0.5 * window, rtol=1e-6)


def test_a_moving_mean_stops_the_frequency_of_its_window_and_a_low_pass_halves_its_own_power() -> (
    None
):
    step, window = 0.5e-3, 40e-3
    time = step * np.arange(8000)
    stopped = moving_mean(np.sin(2 * np.pi * time / window), step, window)[4000:]
    halved = low_pass(np.sin(time / 20e-3), step, 20e-3)[4000:]
    assert np.max(np.abs(stopped)) < 1e-3
    assert np.max(np.abs(halved)) == pytest.approx(np.sqrt(0.5), rel=0.02)


def test_the_bus_repeats_the_stated_share_of_frames_before_the_next_one() -> None:
    rng = np.random.default_rng(SEED)
    ready = np.cumsum(rng.uniform(0.5e-3, 1.5e-3, 20_000))
    data = np.arange(ready.size, dtype=np.uint32).view(np.uint8).reshape(-1, 4)
    found = repeated(Sent("EcuStatus", ready, data), Line(0.01, 0.0), rng)
    number = np.ascontiguousarray(found.data).view(np.uint32).ravel()
    assert np.all(np.diff(found.ready) >= 0.0)
    assert np.all(np.diff(number.astype(np.int64)) >= 0)
    again = np.flatnonzero(np.diff(number) == 0)
    assert again.size == pytest.approx(200, abs=60)
    # random places: the distances between them are exponential, as wide as they are long
    assert np.std(np.diff(again)) == pytest.approx(np.mean(np.diff(again)), rel=0.3)


def test_held_values_are_renewed_at_random_intervals_around_the_stated_one(ridden) -> None:
    case, course, _ = ridden
    faults = ChannelFaults(hold=20e-3, jitter=0.3)
    rng = np.random.default_rng(SEED)
    noisy = replace(case.truth.noises, throttle=1.0, throttle_quantum=0.0)
    found = sampled("throttle_position", course, noisy, faults, rng)
    held = np.diff(found.true[np.flatnonzero(np.diff(found.value))])
    assert np.mean(held) == pytest.approx(20e-3, rel=0.05)
    assert 13e-3 < np.min(held) < 17e-3
    assert 23e-3 < np.max(held) < 27e-3


def test_recordings_are_8_to_20_s_long_and_end_when_they_say(ridden) -> None:
    case, course, data = ridden
    lengths = [
        t.excitation.seconds
        for n in range(40)
        for c in (draw_case(SEED, n),)
        for t in (*c.training, *c.held_out)
    ]
    assert 8.0 <= min(lengths) < 9.0
    assert 19.0 < max(lengths) <= 20.0
    assert len(set(lengths)) > 200
    seconds = case.training[1].excitation.seconds
    assert course.time[-1] == pytest.approx(seconds, abs=0.01)
    assert data.time["throttle_position"][-1] == pytest.approx(seconds, abs=0.03)
