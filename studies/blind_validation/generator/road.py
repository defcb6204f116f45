"""Disturbances of a motorcycle: wind, road roughness, cycle-to-cycle variation of combustion.

None of it is in any model of the other side. Gusts follow Dryden's spectrum of first order
(MIL-F-8785C) with a second, faster one on top; the road undulates. Both have correlation times from
one second to the length of a recording. Bumps change the tyre's load between 1 and 15 Hz; every power stroke differs from the one before (Heywood, Internal Combustion
Engine Fundamentals, section 9.4).
"""

from dataclasses import dataclass

import numpy as np
from scipy import signal

from slipbench.studies.blind_validation.generator.physics import Floats, G

PERIOD = 1e-3  # s


@dataclass(frozen=True)
class Road:
    """wind: m/s from ahead; shove: N along the road; bump: relative load; one value a period.

    scatter: relative torque of every power stroke.
    """

    wind: Floats
    shove: Floats
    bump: Floats
    scatter: Floats
    period: float = PERIOD


@dataclass(frozen=True)
class Roughness:
    """Standard deviations. wind: m/s; grade: 1; bump: of the load; shake: N; combustion: 1.

    wind_time, grade_time: correlation times, s.
    """

    wind: float = 0.5
    wind_time: float = 2.0
    grade: float = 0.0015
    grade_time: float = 3.0
    bump: float = 0.02
    shake: float = 5.0
    combustion: float = 0.03


def draw_road(rng: np.random.Generator, seconds: float, rough: Roughness, mass: float) -> Road:
    """Random disturbances of one run."""
    n = round(seconds / PERIOD) + 2
    slow = _coloured(rng, n, rough.wind, rough.wind_time)
    fast = _coloured(rng, n, 0.3 * rough.wind, 0.1 * rough.wind_time)
    grade = _coloured(rng, n, rough.grade, rough.grade_time)
    shake = _band(rng, n, rough.shake)
    strokes = rng.standard_normal(1 << 14)
    strokes = signal.lfilter([1.0], [1.0, 0.2], strokes)  # a weak one follows a strong one
    return Road(
        slow + fast,
        shake - mass * G * grade,
        _band(rng, n, rough.bump),
        rough.combustion * strokes / float(np.std(strokes)),
    )


def _coloured(rng: np.random.Generator, n: int, deviation: float, time: float) -> Floats:
    keep = np.exp(-PERIOD / time)
    kicks = deviation * np.sqrt(1.0 - keep**2) * rng.standard_normal(n)
    kicks[0] = deviation * rng.standard_normal()
    return np.asarray(signal.lfilter([1.0], [1.0, -keep], kicks))


def _band(rng: np.random.Generator, n: int, deviation: float) -> Floats:
    sections = signal.butter(2, (1.0, 15.0), "bandpass", fs=1.0 / PERIOD, output="sos")
    noise = signal.sosfilt(sections, rng.standard_normal(n + 2000))[2000:]
    return np.asarray(deviation * noise / np.std(noise))
