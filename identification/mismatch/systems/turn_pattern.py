"""Remove the once-per-turn pattern of a wheel speed: eccentric encoder ring, tyre out of round.

Such a pattern is not motion that another wheel shares. In an input it is simulated as if it were
motion, and the best predictor of an output from it seems to contain a filter that does not exist.
Where a model file states the rolling distance of a turn, the pattern is estimated from the channel:

    v = u (1 + a cos(2 pi s / roll) + b sin(2 pi s / roll)),   s = integral of v dt

over all rolls within the stated half width, and removed where its power is significant against
neighbouring orders (false alarms: 1 %). Neighbours are orders from 0.6 to 1.5 outside the stated
half width of the roll; the power of noise is exponentially distributed there (Fyfe and Munck,
"Analysis of computed order tracking", Mechanical Systems and Signal Processing 11, 1997, on
orders).
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy import integrate, signal

from slipbench.identification.mismatch.systems.model_file import Input, ModelFile, Number, Output
from slipbench.plant.signals import Floats
from slipbench.protocol.recording.channel import Channel
from slipbench.protocol.recording.recording import Recording

CHANCE = 0.01
ORDERS = (0.6, 1.5)
FINER = 4
"""Trial orders per turn of phase difference over the recording."""
HIGHEST = 0.4
"""Turns per sample: above, the pattern is aliased and cannot be identified."""
FEWEST = 30  # turns
SLOW = 3
"""Window, in turns, of the filter for slow motion."""


@dataclass(frozen=True)
class TurnPattern:
    """Pattern of a wheel. roll: m per turn. swing: complex amplitude a - ib, share of the speed."""

    roll: float
    swing: complex

    def course(self, speed: Floats, way: Floats) -> Floats:
        """Return its contribution to a speed, (n,). way: distance, m, (n,)."""
        return np.asarray(speed * np.real(self.swing * np.exp(2j * np.pi * way / self.roll)))


def without_patterns(recording: Recording, file: ModelFile) -> tuple[Recording, tuple[str, ...]]:
    """Return the recording without wheel patterns, and a note on each removed one."""
    channels, notes = dict(recording.channels), list[str]()
    wheels: list[tuple[str, Input | Output]] = [*file.inputs.items(), *file.outputs.items()]
    for name, entry in wheels:
        channel = channels.get(entry.role)
        if entry.turn is None or channel is None:
            continue
        pattern, value = _without_pattern(channel, entry.turn)
        if pattern is not None:
            channels[entry.role] = replace(channel, value=value)
            notes.append(
                f"{name.replace('_', ' ')} varies once every {pattern.roll:.3f} m by"
                f" {100 * abs(pattern.swing):.2g} %: a pattern of the wheel, removed"
            )
    return replace(recording, channels=channels), tuple(notes)


def _without_pattern(channel: Channel, roll: Number) -> tuple[TurnPattern | None, Floats]:
    value = np.asarray(channel.value, np.float64)
    keep = np.isfinite(value)
    if keep.sum() < FEWEST:
        return None, value
    pattern = find(channel.time[keep], value[keep], roll.si, roll.si_plus_minus or 0.05 * roll.si)
    if pattern is not None:
        value = value.copy()
        way = integrate.cumulative_trapezoid(value[keep], channel.time[keep], initial=0)
        value[keep] -= pattern.course(value[keep], way)
    return pattern, value


def find(time: Floats, speed: Floats, roll: float, plus_minus: float) -> TurnPattern | None:
    """Return the pattern of a wheel that rolls roll +- plus_minus m per turn; None: not detected.

    time: s, speed: m/s, (n,) each.
    """
    way = integrate.cumulative_trapezoid(speed, time, initial=0)
    turns = float(way[-1] - way[0]) / roll
    samples = speed.size / max(turns, 1e-9)
    if turns < FEWEST or samples < 1.0 / HIGHEST:
        return None
    fast = speed - _slow_motion(speed, samples)
    orders = np.arange(*ORDERS, 1.0 / (FINER * turns))
    amplitudes = np.array([_amplitude(fast, speed, way, roll / order) for order in orders])
    power = np.abs(amplitudes) ** 2
    stated = np.abs(roll / orders - roll) <= plus_minus
    neighbours = np.abs(roll / orders - roll) > plus_minus + 3.0 * roll / turns
    if not stated.any() or not neighbours.any():
        return None
    best = int(np.argmax(np.where(stated, power, -1.0)))
    trials = max(stated.sum() / FINER, 1.0)
    if power[best] < np.mean(power[neighbours]) * np.log(trials / CHANCE):
        return None
    return TurnPattern(roll / orders[best], complex(amplitudes[best]))


def _slow_motion(speed: Floats, samples_per_turn: float) -> Floats:
    window = min(2 * round(0.5 * SLOW * samples_per_turn) + 1, speed.size - (speed.size + 1) % 2)
    return np.asarray(signal.savgol_filter(speed, max(window, 5), 2))


def _amplitude(fast: Floats, speed: Floats, way: Floats, roll: float) -> complex:
    """Return a least-squares amplitude, as over an integer number of turns."""
    phasor = np.exp(-2j * np.pi * way / roll)
    return complex(2.0 * np.sum(fast * speed * phasor) / np.sum(speed**2))
