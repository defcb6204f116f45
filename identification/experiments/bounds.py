"""Bounds of a designed trial: the limits of a trial file, and the straight."""

from dataclasses import dataclass

import numpy as np

from slipbench.identification.mismatch.motorcycle.menu import BEGINS, Choice
from slipbench.plant.signals import Floats
from slipbench.protocol.straight import AFTERWARDS, BEFORE, DRIFT, MARGIN, longest_excitation, room
from slipbench.protocol.trial_file import Limits
from slipbench.protocol.waveforms import COMMANDS_PER_CYCLE

INSIDE = 0.999
"""Share of a limit on what is commanded that is used at most: rounding must not exceed it."""
RAMPS = 16.0
"""Rate of a square wave's ramps over its frequency: a quarter of each half period at most."""


@dataclass(frozen=True)
class Bounds:
    """Limits of a trial file that was reviewed with the rider; the straight, m; command period, s."""

    limits: Limits
    straight: float
    period: float = 1e-3

    @property
    def highest(self) -> float:
        """Highest frequency that the command rate carries, Hz."""
        return 1.0 / (COMMANDS_PER_CYCLE * self.period)

    def seconds(self, speed: float) -> float:
        """Longest excitation at a speed (m/s), s: on the straight and within the limit on distance."""
        return longest_excitation(speed, self.distance(speed))

    def straight_left(self, speed: float) -> float:
        """Way from the button to where the rider has to brake, at a speed (m/s), m."""
        return room(speed, self.straight)[1]

    def distance(self, speed: float) -> float:
        """The same within the limit on the distance, less what the speed may rise, m."""
        return min(self.straight_left(speed), float(self.limits.distance) / (1.0 + DRIFT))

    def rate(self, actuator: str) -> float:
        """Fastest change of a command, 1/s or rad/s."""
        limits = self.limits
        return float(limits.throttle_rate if actuator == "throttle" else limits.spark_rate)

    def amplitude(self, choice: Choice, opening: float) -> float:
        """Largest amplitude of a waveform about an opening (0..1) that the commands may have."""
        if choice.actuator == "spark":
            most = min(-self.limits.spark[0], self.limits.spark[1])
        else:
            low, high = self.limits.throttle
            deviation = (1.0 - MARGIN) * self.limits.throttle_deviation
            most = min(deviation, opening - low, high - opening)
        return INSIDE * min(most, self.rate(choice.actuator) / steepness(choice))


def steepness(choice: Choice) -> float:
    """Fastest change of a waveform per amplitude, 1/s, between commands of a millisecond.

    Of a square wave what its steps must have: a ramp of a quarter of its half period.
    """
    if choice.waveform == "square":
        return RAMPS * choice.low
    time: Floats = np.asarray(BEGINS + 1e-3 * np.arange(round(choice.seconds / 1e-3)))
    return float(np.abs(np.diff(choice.wave(time))).max()) / 1e-3 / choice.amplitude


def riding_seconds(choice: Choice) -> float:
    """Seconds on the straight that a trial takes, without the way to brake."""
    return BEFORE + choice.seconds + AFTERWARDS
