"""What a slip controller is to be designed for, and what it must leave in reserve.

The path from command to the slip that the controller sees: an identified model, how far the
motorcycle may be from it, and the delay that the loop adds to what the identification saw.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from slipbench.identification.design.loop import Margins, encircled, margins
from slipbench.identification.design.sampled import held
from slipbench.identification.models.rational_model import RationalModel
from slipbench.identification.models.uncertainty_set import UncertaintySet
from slipbench.identification.response.response import ComplexArray
from slipbench.protocol.recording.channel import FloatArray

TOP = 100.0  # Hz, to which the nominal loop is looked at
Command = Callable[[FloatArray], ComplexArray]
"""From error to command, complex, at frequencies in Hz."""


class Answering(Protocol):
    """What every designed controller tells: its answers at frequencies in Hz, (n,), complex."""

    def response(self, frequency: FloatArray) -> ComplexArray:
        """From error to command."""
        ...

    def reference_response(self, frequency: FloatArray) -> ComplexArray:
        """From reference to command, the loop open."""
        ...


@dataclass(frozen=True)
class Requirements:
    """gain: factor; phase: rad; sensitivity: M_s; noise: largest share of half the command's range
    that sensor noise may shake it by, one standard deviation."""

    gain: float = 2.0
    phase: float = math.radians(40.0)
    sensitivity: float = 2.0
    noise: float = 0.05

    def with_reserve(self, share: float) -> "Requirements":
        """Ask for more of each margin, by a share of it."""
        return replace(
            self,
            gain=self.gain * (1 + share),
            phase=self.phase * (1 + share),
            sensitivity=self.sensitivity * (1 - share),
        )

    def met(self, found: Margins) -> bool:
        """Tell whether a loop keeps these reserves."""
        return (
            found.gain >= self.gain
            and found.phase >= self.phase
            and found.sensitivity <= self.sensitivity
        )


@dataclass(frozen=True, eq=False)
class Problem:
    """model: the nominal path; around: its set, None where only the model is known; extra: s of
    delay that the loop adds; period: s; noise: deviation of a slip sample; swing: half the
    command's range; told: s from one slip sample to the next, for which each is held."""

    model: RationalModel
    around: UncertaintySet | None
    extra: float
    period: float
    noise: float
    swing: float
    required: Requirements = Requirements()
    told: float = 0.001

    @property
    def frequency(self) -> FloatArray:
        """Hz, at which the nominal loop is judged."""
        return np.geomspace(0.02, TOP, 1200)

    def path(self, frequency: FloatArray, model: ComplexArray | None = None) -> ComplexArray:
        """Answer of the seen slip to the computed command; `model` in place of the nominal one."""
        f = np.asarray(frequency)
        value = self.model.response(f) if model is None else model
        return np.asarray(value * held(f, self.period) * np.exp(-2j * np.pi * f * self.extra))

    def nominal(self, command: Command) -> Margins:
        """Margins of the nominal loop."""
        f = self.frequency
        return margins(f, command(f) * self.path(f))

    def loops(self, command: Command) -> dict[str, Margins]:
        """Margins of the nominal loop, and of every member in the band where it was measured."""
        found = {"nominal": self.nominal(command)}
        for name, values in (self.around.members if self.around else {}).items():
            assert self.around is not None
            known = np.isfinite(values)
            at = self.around.frequency[known]
            if at.size > 1:
                found[name] = margins(at, command(at) * self.path(at, values[known]))
        return found

    def robust(self, command: Command) -> float:
        """Greatest |W T| over the set's band: below 1 the loop is stable for the whole set."""
        if self.around is None:
            return 0.0
        f = self.around.frequency
        loop = command(f) * self.path(f)
        return float(np.max(np.abs(self.around.weight.response(f) * loop / (1 + loop))))

    def shaken(self, command: Command) -> float:
        """Deviation of the command for the sensor's noise, the loop closed.

        A sample is held until the next one: its noise lies below the rate of the samples, where a
        controller answers most.
        """
        f = np.linspace(0.25, 0.5 / self.period, 2000)
        answer = command(f)
        answer /= 1 + answer * self.path(f)
        density = 2 * self.told * np.sinc(f * self.told) ** 2
        return float(self.noise * np.sqrt(np.trapezoid(np.abs(answer) ** 2 * density, f)))

    def met(self, command: Command) -> bool:
        """Tell whether all members keep the required reserves, and the set is stable."""
        return (
            not self.encircled(command)
            and self.robust(command) < 1.0
            and all(self.required.met(m) for m in self.loops(command).values())
        )

    def encircled(self, command: Command) -> int:
        """Count how often the nominal loop runs round -1: 0 where it is stable."""
        return encircled(command(self.frequency) * self.path(self.frequency))
