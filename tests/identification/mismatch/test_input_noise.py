"""Noise in an input must not be identified as physics, nor physics as noise in an input."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy import ndimage

from slipbench.identification.mismatch.analysis import begin
from slipbench.identification.mismatch.explain import analyse
from slipbench.identification.mismatch.reporting.conclude import verdict
from slipbench.identification.mismatch.systems.input_noise import WIDTHS, noise_of, smoothings
from slipbench.identification.mismatch.systems.model_file import Input, Number
from slipbench.identification.mismatch.systems.system import ModelSystem
from slipbench.protocol.recording.channel import Channel
from slipbench.protocol.recording.recording import Recording
from slipbench.protocol.recording.role_map import RoleMap, Source

PERIOD, NOISE = 0.02, 0.02  # s, m/s
MODEL = """
name = "Two wheels"
step = "20 ms"
period = "20 ms"
stretch = "3 s"

[inputs.left]
role = "left"
held = false
size = { value = 15, unit = "m/s" }
NOISE

[outputs.right]
role = "right"
value = "left"
size = { value = 15, unit = "m/s" }
"""
TOLD, EXACT = (
    MODEL.replace("NOISE", f'noise = {{ value = {noise}, unit = "m/s" }}') for noise in (NOISE, 0.0)
)
ROLES = RoleMap(
    title="wheels",
    quantities={"left": "m/s", "right": "m/s"},
    roles={r: Source(column=r) for r in ("left", "right")},
)
FILTERS = ("lag", "delay", "clock_drift")


def wheels(seed: int, late: float = 0.0, noise: float = NOISE) -> Recording:
    """Ride for 20 s; each wheel has its own bumps, m/s. late: time constant of the right, s."""
    print(f"seed {seed}")
    rng = np.random.default_rng(seed)
    time = PERIOD * np.arange(1000)
    speed = 30.0 + ndimage.gaussian_filter1d(rng.standard_normal(1000), 12) * 4.0
    right, share = speed.copy(), PERIOD / (late + PERIOD)
    for k in range(1, 1000):
        right[k] = right[k - 1] + share * (speed[k] - right[k - 1])
    values_by_role = {"left": speed, "right": right}
    channels = {
        r: Channel(r, time, v + noise * rng.standard_normal(1000), "m/s", "bus", "made")
        for r, v in values_by_role.items()
    }
    return Recording(Path(f"wheels{seed}"), {}, None, ROLES, channels, {})


def named(folder: Path, model: str, *recordings: Recording):
    path = folder / "wheels.toml"
    path.write_text(model.replace("NOISE", ""), encoding="utf-8")
    system = ModelSystem.load(path)
    records = [system.prepare(r) for r in recordings]
    library = [k for k in system.library if k.name in FILTERS]
    return verdict(analyse(begin(system, records[:1], records[1:]), library))


def test_a_window_takes_nothing_off_what_is_slow() -> None:
    line = np.linspace(0.0, 5.0, 200)
    for change in smoothings(line, 1.0, 1.0):
        assert np.abs(change[40:-40]).max() < 1e-9
    sharp = np.zeros(201)
    sharp[100] = 1.0
    assert len(smoothings(sharp, 1.0, 1.0)) == len(WIDTHS)
    for change in smoothings(sharp, 1.0, 1.0):
        assert np.allclose(change, change[::-1])  # no before and after


@pytest.mark.parametrize("noise", [1e-3, 0.1, 10.0])
def test_a_window_takes_no_more_off_than_the_noise(noise) -> None:
    values = ndimage.gaussian_filter1d(np.random.default_rng(3).standard_normal(2000), 3.0)
    unlimited = smoothings(values, 1.0, np.inf)
    for change, most in zip(smoothings(values, 1.0, noise), unlimited, strict=True):
        assert np.std(change) == pytest.approx(min(noise, np.std(most)))


@pytest.mark.parametrize("noise", [0.0, 0.02, 0.5])
def test_noise_is_told_from_samples_of_what_is_smooth(noise) -> None:
    rng = np.random.default_rng(4)
    speed = 30.0 + 4.0 * ndimage.gaussian_filter1d(rng.standard_normal(4000), 12)
    found = noise_of(speed + noise * rng.standard_normal(4000))
    assert found == pytest.approx(noise, rel=0.05, abs=3e-3)


def test_bumps_of_one_wheel_are_no_physics_of_the_other(tmp_path: Path) -> None:
    rides = [wheels(71), wheels(171)]
    for model in (TOLD, MODEL):  # unspecified: an interpolated input was measured
        assert not named(tmp_path, model, *rides).mismatch
    assert named(tmp_path, EXACT, *rides).mismatch


def test_a_command_holds_and_has_no_noise() -> None:
    size = Number(value=1.0, unit="V")
    assert Input(role="left", size=size, held=False).noisy
    assert not Input(role="left", size=size).noisy
    assert Input(role="left", size=size, noise=size).noisy
    assert not Input(role="left", size=size, held=False, smooth=True).noisy


@pytest.mark.parametrize(
    ("every", "held", "said"), [(10, True, True), (10, False, False), (2, True, False)]
)
def test_a_measurement_that_is_held_for_many_bins_is_said(
    tmp_path: Path, every, held, said
) -> None:
    ride = wheels(75)
    left = ride.channels["left"]
    slow = replace(left, time=left.time[::every], value=left.value[::every])
    ride = replace(ride, channels={**ride.channels, "left": slow})
    path = tmp_path / "wheels.toml"
    text = MODEL.replace("NOISE", "").replace("false", str(held).lower())
    path.write_text(text, encoding="utf-8")
    notes = ModelSystem.load(path).prepare(ride).notes
    assert any("held = false" in note for note in notes) == said, notes


@pytest.mark.parametrize(("model", "noise"), [(TOLD, NOISE), (MODEL, NOISE), (MODEL, 0.002)])
def test_a_lag_is_found_all_the_same(tmp_path: Path, model, noise) -> None:
    found = named(tmp_path, model, *(wheels(s, late=0.06, noise=noise) for s in (73, 74)))
    assert [e.name for e in found.effects] == ["lag"]
    constant = found.effects[0].parameters[0]
    assert constant.value == pytest.approx(0.06, rel=0.25)
