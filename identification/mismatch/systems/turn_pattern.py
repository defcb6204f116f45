"""Once a turn a wheel's reading swings by an amount of its own: eccentric ring, tyre out of round.

Such a pattern is no motion that another wheel shares. In an input it goes through the simulation
as if it were, and what predicts an output best from it is then a filter that is not there. Where a
model file says how far a wheel rolls in a turn, the pattern is looked for in the channel alone:

    v = u (1 + a cos(2 pi s / roll) + b sin(2 pi s / roll)),   s = integral of v dt

over all rolls that are believed, and taken out where it stands above its neighbours (as noise it
would once in 100). Neighbours are orders from 0.6 to 1.5 that no believed roll could make: the
power of noise there is exponential about its mean (Fyfe and Munck, "Analysis of computed order
tracking", Mechanical Systems and Signal Processing 11, 1997, on orders).
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
"""Tries for each turn of phase that two rolls differ by over the recording."""
HIGHEST = 0.4
"""Turns a sample: above, the pattern is folded onto other frequencies and cannot be told."""
FEWEST = 30  # turns
SLOW = 3
"""Turns over which motion is taken as slow."""


@dataclass(frozen=True)
class TurnPattern:
    """roll: m a turn. swing: complex a - ib, in shares of the speed."""

    roll: float
    swing: complex

    def course(self, speed: Floats, way: Floats) -> Floats:
        """Return what it adds to a speed, (n,). way: m, (n,)."""
        return np.asarray(speed * np.real(self.swing * np.exp(2j * np.pi * way / self.roll)))


def without_patterns(recording: Recording, file: ModelFile) -> tuple[Recording, tuple[str, ...]]:
    """Return the recording without patterns of wheels that the file tells, and what was found."""
    channels, notes = dict(recording.channels), list[str]()
    wheels: list[tuple[str, Input | Output]] = [*file.inputs.items(), *file.outputs.items()]
    for name, told in wheels:
        channel = channels.get(told.role)
        if told.turn is None or channel is None:
            continue
        pattern, value = _freed(channel, told.turn)
        if pattern is not None:
            channels[told.role] = replace(channel, value=value)
            notes.append(
                f"{name.replace('_', ' ')} varies once every {pattern.roll:.3f} m by"
                f" {100 * abs(pattern.swing):.2g} %: a pattern of the wheel, removed"
            )
    return replace(recording, channels=channels), tuple(notes)


def _freed(channel: Channel, roll: Number) -> tuple[TurnPattern | None, Floats]:
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
    """Return the pattern of a wheel that rolls roll +- plus_minus m a turn, if there is one."""
    way = integrate.cumulative_trapezoid(speed, time, initial=0)
    turns = float(way[-1] - way[0]) / roll
    samples = speed.size / max(turns, 1e-9)
    if turns < FEWEST or samples < 1.0 / HIGHEST:
        return None
    rapid = speed - _slow(speed, samples)
    orders = np.arange(*ORDERS, 1.0 / (FINER * turns))
    swings = np.array([_swing(rapid, speed, way, roll / order) for order in orders])
    power = np.abs(swings) ** 2
    ours = np.abs(roll / orders - roll) <= plus_minus
    near = np.abs(roll / orders - roll) > plus_minus + 3.0 * roll / turns
    if not ours.any() or not near.any():
        return None
    best = int(np.argmax(np.where(ours, power, -1.0)))
    tries = max(ours.sum() / FINER, 1.0)
    if power[best] < np.mean(power[near]) * np.log(tries / CHANCE):
        return None
    return TurnPattern(roll / orders[best], complex(swings[best]))


def _slow(speed: Floats, samples_per_turn: float) -> Floats:
    window = min(2 * round(0.5 * SLOW * samples_per_turn) + 1, speed.size - (speed.size + 1) % 2)
    return np.asarray(signal.savgol_filter(speed, max(window, 5), 2))


def _swing(rapid: Floats, speed: Floats, way: Floats, roll: float) -> complex:
    """Fit a pattern by least squares, whole turns taken as many."""
    turned = np.exp(-2j * np.pi * way / roll)
    return complex(2.0 * np.sum(rapid * speed * turned) / np.sum(speed**2))
