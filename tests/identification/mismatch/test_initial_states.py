"""Calibration of correlated parameters and initial states: a lightly damped pendulum."""

from pathlib import Path

import numpy as np
import pytest
from numba import njit

from slipbench.identification.mismatch.analysis import begin
from slipbench.identification.mismatch.fit.calibrate import calibrate
from slipbench.identification.mismatch.systems.system import ModelSystem
from slipbench.protocol.recording.channel import Channel
from slipbench.protocol.recording.recording import Recording
from slipbench.protocol.recording.role_map import RoleMap, Source

PERIOD, SECONDS, FINER = 0.02, 40.0, 16
GAIN, LAG, DAMPING, GRAVITY = 0.667, 0.149, 0.085, 9.81
NOISE = {"drum": 5e-3, "inclinometer": 2e-3}  # m/s, rad
MODEL = """
name = "Crane"
step = "5 ms"
period = "20 ms"

[parameters]
gain = { value = 0.6, unit = "m/s/V", plus_minus = 0.1 }
lag = { value = 0.15, unit = "s", plus_minus = 0.06 }
rope = { value = 2, unit = "m", plus_minus = 0.2 }
damping = { value = 0.08, unit = "1/s", plus_minus = 0.05 }

[inputs.voltage]
role = "voltage"
size = { value = 3, unit = "V" }

[states.speed]
rate = "pull"
size = { value = 1, unit = "m/s" }

[states.swing]
rate = "swing_speed"
size = { value = 15, unit = "deg" }

[states.swing_speed]
rate = "-(9.81 * sin(swing) + pull * cos(swing)) / rope - damping * swing_speed"
size = { value = 30, unit = "deg/s" }

[seams.pull]
value = "(gain * voltage - speed) / lag"
size = { value = 3, unit = "m/s^2" }

[outputs.drum]
role = "drum"
value = "speed"
size = { value = 1, unit = "m/s" }

[outputs.inclinometer]
role = "inclinometer"
value = "swing"
size = { value = 15, unit = "deg" }
"""
ROLES = RoleMap(
    title="crane",
    quantities={"voltage": "V", "drum": "m/s", "inclinometer": "rad"},
    roles={role: Source(column=role) for role in ("voltage", "drum", "inclinometer")},
)


@njit(cache=True)
def speed_and_angle(voltage, rope, swing, speed=0.0, lag=LAG):
    """Speed and angle at each sample: midpoint rule, small steps. swing, speed: initial values."""
    shown = np.zeros((voltage.size, 2))
    x, k = np.array([speed, swing, 0.0]), np.zeros(3)
    h = PERIOD / FINER
    for n in range(voltage.size):
        shown[n] = x[:2]
        for _ in range(FINER):
            there = x.copy()
            for share in (0.5, 1.0):
                pull = (GAIN * voltage[n] - there[0]) / lag
                k[0], k[1] = pull, there[2]
                k[2] = -(GRAVITY * np.sin(there[1]) + pull * np.cos(there[1])) / rope
                k[2] -= DAMPING * there[2]
                there = x + share * h * k
            x = there
    return shown


def recording(seed, rope, swing, speed=0.0, lag=LAG, size=2.0):
    """speed: at the beginning, m/s; size: of the voltage, V."""
    rng = np.random.default_rng(seed)
    count = round(SECONDS / PERIOD)
    voltage = np.repeat(size * rng.standard_normal(count // 75 + 1), 75)[:count]
    values = dict(zip(NOISE, speed_and_angle(voltage, rope, swing, speed, lag).T, strict=True))
    values = {k: y + NOISE[k] * rng.standard_normal(count) for k, y in values.items()}
    values["voltage"] = voltage
    moments = PERIOD * np.arange(count)
    channels = {r: Channel(r, moments, y, ROLES.unit(r), "bus", "made") for r, y in values.items()}
    return Recording(Path(f"run{seed}"), {}, None, ROLES, channels, {})


def calibrated(folder, runs, text=MODEL):
    path = folder / "crane.toml"
    path.write_text(text, encoding="utf-8")
    system = ModelSystem.load(path)
    analysis = begin(system, [system.prepare(run) for run in runs], [])
    return calibrate(analysis.training, analysis.training.origin())


@pytest.mark.parametrize(("rope", "swing"), [(1.88, 0.0), (1.88, 0.15), (2.15, -0.1), (1.8, 0.1)])
def test_what_calibration_leaves_is_the_noise(tmp_path, rope, swing):
    """With usual difference steps of the initial angle the error was ten times the noise, and the
    noise model absorbed it."""
    fit = calibrated(tmp_path, [recording(seed, rope, swing) for seed in (1, 2)])
    for residual, size in zip(fit.residuals, NOISE.values(), strict=True):
        assert np.sqrt(np.mean(np.concatenate(residual) ** 2)) < 1.05 * size
    numbers = {c.name: c.at(float(x)) for c, x in zip(fit.model.known, fit.point.x, strict=True)}
    assert numbers["rope"] == pytest.approx(rope, rel=1e-3)
    assert numbers["gain"] == pytest.approx(GAIN, rel=5e-3)


@pytest.mark.parametrize("speed", [-1.0, -0.3, 0.3, 1.0])
def test_a_recording_that_begins_in_motion_is_predicted_from_its_first_sample(tmp_path, speed):
    """The initial speed decays within the first rows, before the noise model has its full order."""
    lag = 0.03
    text = MODEL.replace("value = 0.15", f"value = {lag}").replace("0.06 }", "0.01 }")
    fit = calibrated(tmp_path, [recording(s, 1.88, 0.0, speed, lag, 0.3) for s in (1, 2)], text)
    for white, residual_series, size in zip(fit.noise, fit.residuals, NOISE.values(), strict=True):
        assert white.order * PERIOD > 5.0 * lag
        for residual in residual_series:
            assert np.abs(residual[: white.order]).max() < 5.0 * size


@pytest.mark.parametrize("speed", [-3.0, -2.0, -1.0, 2.0])
def test_what_begins_in_fast_motion_is_fitted_from_its_beginning_on(tmp_path, speed):
    """From rest, the start of the fit, the pendulum turns over, and Jacobians do not help."""
    fit = calibrated(tmp_path, [recording(seed, 1.88, 0.1, speed) for seed in (1, 2)])
    for residual, size in zip(fit.residuals, NOISE.values(), strict=True):
        assert np.sqrt(np.mean(np.concatenate(residual) ** 2)) < 1.05 * size
