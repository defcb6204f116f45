"""Recordings with a known truth: linear slip dynamics, toothed wheels, clocks that drift.

It does not imitate: frames, the CAN database, load on the bus, any nonlinearity.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from scipy import signal

from slipbench.protocol.codec.messages import Phase
from slipbench.protocol.recording.channel import Channel
from slipbench.protocol.recording.recording import Recording
from slipbench.protocol.recording.role_map import Geometry, RoleMap, Source
from slipbench.protocol.trial_file import TrialFile

RATE = 4000.0
RADIUS, TEETH = 0.32, 16


@dataclass(frozen=True)
class Truth:
    """Second-order slip dynamics behind a delay: slip = mean + gain G(s) (u - u0)."""

    frequency: float = 8.0  # Hz
    damping: float = 0.25
    gain: float = 0.15  # slip per opening
    delay: float = 0.010  # s
    mean: float = 0.015
    speed: float = 53.0  # m/s
    noise: float = 0.0  # m/s, white on the wheel, at 4 kHz
    tooth_error: float = 0.0  # relative 1X of the encoder's angle (rad amplitude)
    seed: int = 1
    drift: dict[str, float] = field(
        default_factory=lambda: {"ecu": 30e-6, "rear_encoder": -45e-6, "optical": 12e-6}
    )

    def response(self, frequency):
        w0, s = 2 * np.pi * self.frequency, 2j * np.pi * np.asarray(frequency)
        g = w0**2 / (s**2 + 2 * self.damping * w0 * s + w0**2)
        return self.gain * g * np.exp(-s * self.delay)


def sweep_trial(duration=20.0, start=0.5, stop=15.0, **excitation) -> TrialFile:
    spec = {
        "actuator": "throttle",
        "waveform": "linear_sweep",
        "amplitude": "4 %",
        "duration": f"{duration} s",
        "start": f"{start} Hz",
        "stop": f"{stop} Hz",
    } | excitation
    if "period" in spec or "frequency" in spec:
        del spec["start"], spec["stop"]
    return TrialFile.model_validate(
        {
            "name": "synthetic",
            "vehicle": "none.toml",
            "excitation": spec,
            "operating_point": {"gear": 2, "engine_speed": "14000 rpm"},
            "limits": {
                "throttle_deviation": "6 %",
                "throttle_rate": "600 %/s",
                "spark": ["-12 deg", "4 deg"],
                "spark_rate": "1000 deg/s",
                "engine_speed": ["11000 rpm", "15500 rpm"],
                "speed": ["30 m/s", "70 m/s"],
                "slip": "8 %",
                "distance": "2500 m",
            },
        }
    )


def sweep(t, duration, start=0.5, stop=15.0):
    inside = (t >= 0) & (t < duration)
    phase = 2 * np.pi * (start * t + (stop - start) * t**2 / (2 * duration))
    return np.where(inside, np.sin(phase), 0.0)


def recording(
    truth: Truth = Truth(),
    trial: TrialFile | None = None,
    wave: Callable | None = None,
    phases: bool = True,
    lost_frames: int = 0,
) -> Recording:
    """A trial: 3 s steady, the excitation, 1 s settling, 1 s after it."""
    trial = trial or sweep_trial()
    lasts = trial.excitation.duration
    rng = np.random.default_rng(truth.seed)
    t = np.arange(0, 3 + lasts + 2, 1 / RATE)
    step = np.floor(t / 1e-3 + 1e-9) * 1e-3  # the ECU applies a value and holds it
    u = 0.14 + 0.04 * (wave or (lambda x: sweep(x, lasts)))(step - 3)
    v = np.full_like(t, truth.speed)
    slip = truth.mean + _answer(truth, t, u - 0.14)
    wheel = v * (1 + slip) + truth.noise * rng.standard_normal(t.size)
    maker = _Maker(truth, rng)
    channels = {
        "throttle_command": maker.sampled("throttle_command", t, u, 1e-3, "ecu", "1", 0),
        "throttle_position": maker.sampled("throttle_position", t, u, 1e-3, "ecu", "1"),
        "engine_speed": maker.sampled(
            "engine_speed", t, wheel / RADIUS * 8.8, 5e-3, "ecu", "rad/s"
        ),
        "optical_speed": maker.sampled("optical_speed", t, v, 4e-3, "optical", "m/s"),
        "rear_teeth": maker.teeth("rear_teeth", t, wheel, "rear_encoder", lost_frames),
    }
    if phases:
        at = np.arange(0, t[-1], 0.02)
        phase = np.select(
            [at < 3, at < 3 + lasts, at < 4 + lasts],
            [Phase.ARMED, Phase.EXCITING, Phase.SETTLING],
            Phase.DONE,
        ).astype(float)
        channels["trial_phase"] = Channel("trial_phase", at, phase, "1", "bus", "synthetic")
    roles = {role: Source(column=role, table="synthetic") for role in channels}
    geometry = Geometry(rear_radius=RADIUS, front_radius=0.3, teeth_per_turn=TEETH)
    return Recording(
        Path("synthetic"),
        {"versions": {"slipbench": "0"}},
        trial if phases else None,
        RoleMap(title="synthetic motorcycle", vehicle=geometry, roles=roles),
        channels,
        {},
        0,
        float(t[-1]),
    )


def _answer(truth, t, u):
    w0 = 2 * np.pi * truth.frequency
    if truth.gain == 0:
        return np.zeros_like(t)
    system = ([truth.gain * w0**2], [1, 2 * truth.damping * w0, w0**2])
    late = np.interp(t - truth.delay, t, u, left=0.0)
    b, a, _ = signal.cont2discrete(system, 1 / RATE, method="foh")
    return signal.lfilter(b[0], a, late)


@dataclass
class _Maker:
    truth: Truth
    rng: np.random.Generator

    def stamped(self, role, true_time, value, clock, unit, resolution=1e-6) -> Channel:
        """Device time with offset and drift; arrivals late, never early, at times queued."""
        n = true_time.size
        device = true_time * (1 + self.truth.drift.get(clock, 0.0)) + 17.25
        latency = 150e-6 + self.rng.exponential(200e-6, n)
        latency += np.where(self.rng.random(n) < 0.02, self.rng.exponential(5e-3, n), 0.0)
        device = np.round(device / resolution) * resolution
        return Channel(role, device, value, unit, clock, f"synthetic {role}", true_time + latency)

    def sampled(self, role, t, x, period, clock, unit, begin=None) -> Channel:
        begin = self.rng.random() * period if begin is None else begin
        at = np.arange(begin, t[-1], period)
        return self.stamped(role, at, np.interp(at, t, x), clock, unit)

    def teeth(self, role, t, wheel, clock, lost_frames) -> Channel:
        angle = np.concatenate(([0.0], np.cumsum(wheel[:-1]))) / RATE / RADIUS
        read = angle + self.truth.tooth_error * np.sin(angle)
        count = np.arange(1, int(read[-1] * TEETH / (2 * np.pi)))
        at = np.interp(count * 2 * np.pi / TEETH, read, t)
        keep = np.ones(count.size, bool)
        for start in self.rng.integers(200, count.size - 200, lost_frames):
            keep[start : start + 4] = False
        return self.stamped(role, at[keep], count[keep].astype(float), clock, "count")
