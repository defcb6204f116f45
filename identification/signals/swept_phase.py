"""The phase of a swept sine, estimated from the sine itself.

Zero crossings give the times at which the phase is a multiple of pi; a sweep law, linear or
logarithmic, is fitted to them and then refined on the waveform. Nothing of the trial file is
needed: the measured signal is the command, and its clock is the clock of its harmonics.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy import optimize

from slipbench.protocol.recording.channel import FloatArray

FEWEST_CROSSINGS = 8
HYSTERESIS = 0.3  # of the root mean square: less than this is no crossing
MOST_STEPS = 30
MOST_UNEXPLAINED = 0.3  # largest residual share of the power; a servo distorts the wave a little


@dataclass(frozen=True)
class SweptPhase:
    """phase: (n,) rad, u is about A cos(phase) + c. frequency: (n,) Hz. law: linear, logarithmic.

    unexplained: share of the power of u that a sine of constant amplitude does not explain.
    """

    phase: FloatArray
    frequency: FloatArray
    law: str
    unexplained: float


@dataclass(frozen=True)
class NoSweep:
    """Why a signal is not a swept sine."""

    reason: str


def linear(x: FloatArray, start: float, stop: float) -> tuple[FloatArray, FloatArray]:
    """Cycles per unit duration (Hz) and frequency (Hz) at share x of a linear sweep, shape (n,)."""
    return start * x + (stop - start) * x**2 / 2, start + (stop - start) * x


def logarithmic(x: FloatArray, start: float, stop: float) -> tuple[FloatArray, FloatArray]:
    """Cycles per unit duration (Hz) and frequency (Hz) at share x of a logarithmic sweep, shape (n,)."""
    growth = np.log(stop / start)
    frequency: FloatArray = start * np.exp(growth * x)
    if abs(growth) < 1e-9:
        return start * x, frequency
    return (frequency - start) / growth, frequency


LAWS = {"linear": linear, "logarithmic": logarithmic}
Law = Callable[[FloatArray, float, float], tuple[FloatArray, FloatArray]]


def swept_phase(u: FloatArray, rate: float) -> SweptPhase | NoSweep:
    """Find the phase of a swept sine. u: (n,), the excitation alone; rate: Hz."""
    wave = u - np.mean(u)
    time = np.arange(u.size) / rate
    crossings = _crossings(wave, time)
    if crossings.size < FEWEST_CROSSINGS:
        return NoSweep(f"the input crosses its mean {crossings.size} times: not a swept sine")
    laws = {name: _through(LAWS[name], crossings, time[-1]) for name in LAWS}
    name = min(laws, key=lambda law: laws[law][1])
    best = _refined(wave, time, name, laws[name][0])
    if best.unexplained > MOST_UNEXPLAINED:
        share = 100 * best.unexplained
        return NoSweep(f"a swept sine leaves {share:.0f} % of the input's power unexplained")
    return best


def _refined(wave: FloatArray, time: FloatArray, name: str, ends: FloatArray) -> SweptPhase:
    """Fit the law's first and last frequency to the waveform itself."""
    law, duration = LAWS[name], time[-1]

    def left(ends: FloatArray) -> FloatArray:
        return _left(wave, 2 * np.pi * duration * law(time / duration, ends[0], ends[1])[0])[0]

    found = optimize.least_squares(
        left, ends, x_scale=1 / duration, bounds=(1e-3 / duration, np.inf), max_nfev=MOST_STEPS
    )
    cycles, frequency = law(time / duration, *found.x)
    residual, offset = _left(wave, 2 * np.pi * duration * cycles)
    unexplained = float(np.sum(residual**2) / np.sum(wave**2))
    return SweptPhase(2 * np.pi * duration * cycles + offset, frequency, name, unexplained)


def _left(wave: FloatArray, phase: FloatArray) -> tuple[FloatArray, float]:
    """Residual of a sine of this phase, and the offset that makes it a cosine."""
    basis = np.stack([np.cos(phase), np.sin(phase), np.ones_like(phase)], axis=1)
    found = np.linalg.solve(basis.T @ basis, basis.T @ wave)
    return wave - basis @ found, float(np.arctan2(-found[1], found[0]))


def _crossings(wave: FloatArray, time: FloatArray) -> FloatArray:
    """Times at which the wave changes sides, after having left its mean by the hysteresis."""
    level = HYSTERESIS * np.sqrt(np.mean(wave**2))
    away = np.flatnonzero(np.abs(wave) > level)
    changes = np.flatnonzero(np.diff(np.sign(wave[away])))
    before, after = away[changes], away[changes + 1]
    share = wave[before] / (wave[before] - wave[after])
    return np.asarray(time[before] + share * (time[after] - time[before]))


def _through(law: Law, crossings: FloatArray, duration: float) -> tuple[FloatArray, float]:
    """Ends of the law (Hz) that passes the crossings half a cycle apart, and what it misses."""
    half = np.arange(crossings.size) / 2
    between, pace = (crossings[1:] + crossings[:-1]) / 2, 0.5 / np.diff(crossings)
    slope, level = np.polyfit(between, pace, 1)
    least = 0.1 * float(pace.min())
    start = np.maximum([level, level + slope * duration], least)

    def residuals(p: FloatArray) -> FloatArray:
        return np.asarray(duration * law(crossings / duration, p[0], p[1])[0] + p[2] - half)

    found = optimize.least_squares(
        residuals,
        [*start, 0.0],
        loss="soft_l1",
        max_nfev=100,
        bounds=([least / 10, least / 10, -np.inf], np.inf),
    )
    return np.asarray(found.x[:2]), float(found.cost)
