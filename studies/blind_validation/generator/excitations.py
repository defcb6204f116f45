"""Excitation of throttle or spark in a trial, and the steady state at its start.

Each recording is 8 to 20 s long, to the hundredth of a second.
"""

import math
from dataclasses import dataclass, replace

import numpy as np
from scipy import optimize

from slipbench.studies.blind_validation.generator import physics as p
from slipbench.studies.blind_validation.generator.fault_parameters import MotionFaults
from slipbench.studies.blind_validation.generator.machine import Machine
from slipbench.studies.blind_validation.generator.physics import Floats, G
from slipbench.studies.blind_validation.generator.tyres import force
from slipbench.studies.blind_validation.generator.vehicle_file import RPM, Truth

SHORTEST, LONGEST = 8.0, 20.0  # s, of a recording
BEFORE, AFTER = 1.5, 0.5  # s, of a recording around its excitation


@dataclass(frozen=True)
class Excitation:
    """kind: sweep, multisine, steps, blips, coast; amplitude: opening, or rad of spark.

    low, high: Hz; engine_speed: rad/s at the beginning; seed: of its phases; seconds: of the
    recording.
    """

    kind: str
    actuator: str
    gear: int
    engine_speed: float
    amplitude: float
    low: float
    high: float
    seed: int
    seconds: float

    @property
    def duration(self) -> float:
        """Length of the excitation, s."""
        return self.seconds - BEFORE - AFTER

    def wave(self, t: Floats) -> Floats:
        """Deviation from the operating point, shape (n,). t: s since the excitation began, (n,)."""
        inside = (t >= 0.0) & (t < self.duration)
        return np.where(inside, self.amplitude * getattr(self, f"_{self.kind}")(t), 0.0)

    def _sweep(self, t: Floats) -> Floats:
        rate = (self.high - self.low) / self.duration
        return np.asarray(np.sin(2 * np.pi * (self.low * t + 0.5 * rate * t * t)))

    def _multisine(self, t: Floats) -> Floats:
        rng = np.random.default_rng(self.seed)
        lines = np.arange(self.low, self.high, 0.4)
        phases = rng.uniform(0.0, 2 * np.pi, lines.size)
        waves = np.sin(2 * np.pi * np.outer(t, lines) + phases)
        return np.asarray(waves.sum(axis=1) / np.sqrt(lines.size))

    def _steps(self, t: Floats) -> Floats:
        return np.where(np.floor(2.0 * self.low * t) % 2 == 0, 1.0, -1.0)

    def _blips(self, t: Floats) -> Floats:
        """Short opening, then longer closing below the operating point."""
        place = (t * self.low) % 1.0
        return np.where(place < 0.25, 1.0, np.where(place < 0.85, -0.5, 0.0))

    def _coast(self, t: Floats) -> Floats:
        """Long closing, then an opening that restores the mean."""
        place = (t * self.low) % 1.0
        return np.where(place < 0.55, -1.0, 1.0)


def draw_excitations(rng: np.random.Generator, gentle: bool) -> tuple[list[Excitation], ...]:
    """Four training trials and three held-out trials, of different speeds and waveforms.

    gentle: small and slow ones, as without a hypothesis.
    """
    if gentle:
        return [_gentle(rng, i) for i in range(4)], [_gentle(rng, i + 4) for i in range(3)]
    training = [
        _one(rng, "sweep", "throttle", 2, (12500, 14500), (0.025, 0.04), (0.5, 0.8), (11, 15)),
        _one(rng, "blips", "throttle", 2, (10000, 12500), (0.09, 0.14), (0.55, 0.8), (1, 1)),
        _one(rng, "multisine", "throttle", 3, (8500, 10500), (0.03, 0.045), (0.6, 0.8), (12, 15)),
        _one(rng, "sweep", "spark", 2, (11500, 14000), (0.09, 0.14), (0.5, 0.8), (11, 15)),
    ]
    held_out = [
        _one(rng, "multisine", "throttle", 2, (11000, 14000), (0.025, 0.04), (0.6, 0.8), (12, 15)),
        _one(
            rng,
            "coast",
            "throttle",
            int(rng.integers(2, 4)),
            (9000, 11500),
            (0.07, 0.1),
            (0.3, 0.5),
            (1, 1),
        ),
        _one(
            rng,
            "steps",
            "spark",
            int(rng.integers(2, 4)),
            (9500, 13000),
            (0.07, 0.12),
            (0.6, 1.1),
            (1, 1),
        ),
    ]
    return training, held_out


def _one(
    rng: np.random.Generator,
    kind: str,
    actuator: str,
    gear: int,
    rpm: tuple[float, float],
    amplitude: tuple[float, float],
    low: tuple[float, float],
    high: tuple[float, float],
) -> Excitation:
    draw = rng.uniform
    return Excitation(
        kind,
        actuator,
        gear,
        float(draw(*rpm)) * RPM,
        float(draw(*amplitude)),
        float(draw(*low)),
        float(draw(*high)),
        int(rng.integers(1 << 30)),
        round(float(draw(SHORTEST, LONGEST)), 2),
    )


def _gentle(rng: np.random.Generator, number: int) -> Excitation:
    kind = "sweep" if number % 2 else "multisine"
    first = _one(
        rng, kind, "throttle", 2 + number % 2, (11500, 14000), (0.006, 0.01), (0.4, 0.6), (5, 8)
    )
    return replace(first, engine_speed=first.engine_speed * (0.85 if first.gear == 3 else 1.0))


def steady(truth: Truth, missing: MotionFaults, excitation: Excitation) -> tuple[Machine, Floats]:
    """Machine in its gear, and its steady state without the hidden effects, SI, (STATES,)."""
    m = truth.machine._replace(ratio=truth.gears[excitation.gear - 1])
    w = excitation.engine_speed
    v = w / m.ratio * m.radius / 1.012
    drag = 0.5 * m.air_density * m.drag_area * v * v + m.mass * G * m.rolling_resistance
    C, D = m.slip_stiffness, m.grip * m.load
    slip = optimize.brentq(
        lambda s: force(truth.formula, s, C, D, m.shape) - drag, 0.0, 1.2 * D / C
    )
    torque = (drag * m.radius + m.rolling) / m.ratio
    throttle = _opening(
        m, w, torque / (1.0 - min(missing.loss, 0.2)) + missing.brake_drag / m.ratio
    )
    x = np.zeros(p.STATES)
    for place in (p.PLATE, p.AIR, p.FILM, p.RUNNER):
        x[place] = throttle
    x[p.CRANK_SPEED], x[p.WHEEL_SPEED] = w, w / m.ratio
    radius = m.radius * (1.0 + missing.growth * v * v)
    x[p.SPEED] = x[p.SEEN] = w / m.ratio * radius / (1.0 + slip)
    x[p.TWIST] = torque * m.ratio / m.stiffness + 0.5 * missing.slack
    x[p.SLIP], x[p.SQUAT] = slip, drag
    x[p.WARMTH] = missing.heating * drag * slip * v
    return m, x


def _opening(m: Machine, w: float, torque: float) -> float:
    friction = m.friction + m.friction_rise * w
    full = m.peak_torque / (1.0 + ((w - m.peak_speed) / m.torque_width) ** 2)
    share = (torque / m.torque_scale + friction) / (full + friction)
    return -m.opening_scale * math.log(1.0 - min(share, 0.9))
