"""Waveforms of a trial, of unit amplitude, as pure functions of time.

The bench plays them; an analysis obtains the requested command from them and the trial's file.
"""

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from slipbench.protocol.trial_file import Multisine, Square, Sweep

FloatArray = npt.NDArray[np.float64]
COMMANDS_PER_CYCLE = 20  # fewer make a sine a staircase whose images reach the slip
GROUP = 4  # odd lines of a multisine, of which one is left free to detect odd distortion


def waveform(spec: Sweep | Square | Multisine) -> Callable[[FloatArray], FloatArray]:
    """Return the waveform of an excitation over the time since it began, s."""
    match spec:
        case Sweep(waveform="linear_sweep"):
            return lambda t: linear_sweep(t, spec.start, spec.stop, spec.duration)
        case Sweep():
            return lambda t: logarithmic_sweep(t, spec.start, spec.stop, spec.duration)
        case Square():
            return lambda t: square_wave(t, spec.frequency)
        case Multisine():
            return lambda t: odd_multisine(
                t, spec.period, spec.lowest, spec.highest, spec.seed, spec.detection
            )


def linear_sweep(time: FloatArray, start: float, stop: float, duration: float) -> FloatArray:
    """Sine of unit amplitude whose frequency (Hz) runs linearly; starts at zero."""
    return np.sin(2 * np.pi * (start * time + (stop - start) * time**2 / (2 * duration)))


def logarithmic_sweep(time: FloatArray, start: float, stop: float, duration: float) -> FloatArray:
    """Sine of unit amplitude, the same time in every octave (Farina, AES 2000).

    time: s, shape (n,); start, stop: Hz; duration: s.
    """
    if np.isclose(start, stop):
        return np.sin(2 * np.pi * start * time)
    growth = np.log(stop / start) / duration
    phase: FloatArray = 2 * np.pi * start * np.expm1(growth * time) / growth
    return np.sin(phase)


def square_wave(time: FloatArray, frequency: float) -> FloatArray:
    """Square wave of unit amplitude, +1 first; half periods are half open, so none is doubled.

    time: s, shape (n,); frequency: Hz.
    """
    return np.where(np.floor(2 * frequency * time + 1e-9) % 2 == 0, 1.0, -1.0)


def odd_multisine(
    time: FloatArray,
    period: float,
    lowest: float,
    highest: float,
    seed: int,
    detection: bool = False,
) -> FloatArray:
    """Odd harmonics of 1/`period` with random phases, a peak of one, starting at a zero crossing.

    Even lines stay free, so that even distortion shows in them; with `detection` one random line of
    every `GROUP` odd ones does too, so that odd distortion shows there (Pintelon and Schoukens,
    System Identification: A Frequency Domain Approach, 2nd ed., chapter 4).
    """
    harmonics = np.arange(1, int(np.floor(highest * period + 1e-9)) + 1, 2)
    harmonics = harmonics[harmonics >= lowest * period - 1e-9]
    random = np.random.default_rng(seed)
    phases = random.uniform(0, 2 * np.pi, harmonics.size)
    if detection:
        starts = np.arange(0, harmonics.size - GROUP + 1, GROUP)
        free = starts + random.integers(0, GROUP, starts.size)
        harmonics, phases = np.delete(harmonics, free), np.delete(phases, free)

    def wave(at: FloatArray) -> FloatArray:
        angles = 2 * np.pi * np.outer(at / period, harmonics) + phases
        return np.asarray(np.sum(np.sin(angles), axis=1))

    fine = np.linspace(0.0, period, 64 * int(harmonics[-1]) + 1)
    values = wave(fine)
    rising = np.flatnonzero((values[:-1] <= 0) & (values[1:] > 0))[0]
    share = values[rising] / (values[rising] - values[rising + 1])
    crossing = fine[rising] + share * (fine[1] - fine[0])
    played = wave(time + crossing)
    return np.asarray(played / max(np.max(np.abs(values)), np.max(np.abs(played))))


def end_at_zero(wave: FloatArray) -> FloatArray:
    """Waveform that is zero after its last zero crossing, so that the hand-over does not jump.

    wave: (n,), at each command. One that ends near zero, after whole periods, is unchanged.
    """
    crossings = np.flatnonzero(np.diff(np.signbit(wave)))
    at_rest = wave.size > 1 and abs(wave[-1]) <= 1.01 * abs(wave[-1] - wave[-2])
    if at_rest or not crossings.size:
        return wave
    return np.where(np.arange(wave.size) <= crossings[-1], wave, 0.0)
