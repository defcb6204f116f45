"""Design problem of a slip controller: path, uncertainty set, and required margins.

The path leads from the command to the slip that the controller measures: an identified model, its
uncertainty set, and the delay that the loop adds to the identified path.
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

TOP = 100.0  # Hz, highest frequency at which the nominal loop is evaluated
Command = Callable[[FloatArray], ComplexArray]
"""From error to command, complex, at frequencies in Hz."""


class LinearController(Protocol):
    """Frequency responses of a designed controller. frequency: Hz, shape (n,); returns complex."""

    def response(self, frequency: FloatArray) -> ComplexArray:
        """Response from error to command, complex, shape (n,). frequency: Hz, shape (n,)."""
        ...

    def reference_response(self, frequency: FloatArray) -> ComplexArray:
        """Open-loop response from reference to command, complex, shape (n,). frequency: Hz, (n,)."""
        ...


@dataclass(frozen=True)
class Requirements:
    """gain: factor; phase: rad; sensitivity: M_s; noise: largest standard deviation of the
    command due to sensor noise, as a share of half the command range."""

    gain: float = 2.0
    phase: float = math.radians(40.0)
    sensitivity: float = 2.0
    noise: float = 0.05

    def with_reserve(self, share: float) -> "Requirements":
        """Requirements with each margin tightened by a share of it."""
        return replace(
            self,
            gain=self.gain * (1 + share),
            phase=self.phase * (1 + share),
            sensitivity=self.sensitivity * (1 - share),
        )

    def met(self, found: Margins) -> bool:
        """Whether a loop meets these requirements."""
        return (
            found.gain >= self.gain
            and found.phase >= self.phase
            and found.sensitivity <= self.sensitivity
        )


@dataclass(frozen=True, eq=False)
class Problem:
    """model: the nominal path; around: its set, None where only the model is known; extra:
    delay that the loop adds, s; period: s; noise: standard deviation of a slip sample; half_range:
    half the command range; sample_interval: time from one slip sample to the next, s."""

    model: RationalModel
    around: UncertaintySet | None
    extra: float
    period: float
    noise: float
    half_range: float
    required: Requirements = Requirements()
    sample_interval: float = 0.001

    @property
    def frequency(self) -> FloatArray:
        """Frequencies at which the nominal loop is evaluated, Hz, shape (n,)."""
        return np.geomspace(0.02, TOP, 1200)

    def path(self, frequency: FloatArray, model: ComplexArray | None = None) -> ComplexArray:
        """Response from computed command to measured slip, complex, shape (n,). frequency: Hz, (n,).

        model: response of another model at these frequencies, shape (n,), instead of the nominal one.
        """
        f = np.asarray(frequency)
        value = self.model.response(f) if model is None else model
        return np.asarray(value * held(f, self.period) * np.exp(-2j * np.pi * f * self.extra))

    def nominal(self, command: Command) -> Margins:
        """Margins of the nominal loop. command: controller's response at frequencies in Hz, (n,)."""
        f = self.frequency
        return margins(f, command(f) * self.path(f))

    def loops(self, command: Command) -> dict[str, Margins]:
        """Margins of the nominal loop, and of every member over its measured band, by name.

        command: controller's response at frequencies in Hz, shape (n,).
        """
        found = {"nominal": self.nominal(command)}
        for name, values in (self.around.members if self.around else {}).items():
            assert self.around is not None
            known = np.isfinite(values)
            at = self.around.frequency[known]
            if at.size > 1:
                found[name] = margins(at, command(at) * self.path(at, values[known]))
        return found

    def robust(self, command: Command) -> float:
        """Largest |W T| over the band of the set; below 1 the loop is stable for the whole set.

        command: controller's response at frequencies in Hz, shape (n,).
        """
        if self.around is None:
            return 0.0
        f = self.around.frequency
        loop = command(f) * self.path(f)
        return float(np.max(np.abs(self.around.weight.response(f) * loop / (1 + loop))))

    def command_noise(self, command: Command) -> float:
        """Standard deviation of the command due to sensor noise in closed loop, command unit.

        command: controller's response at frequencies in Hz, shape (n,). A sample is held until the next one, so its noise is concentrated below the sample rate.
        """
        f = np.linspace(0.25, 0.5 / self.period, 2000)
        response = command(f)
        response /= 1 + response * self.path(f)
        density = 2 * self.sample_interval * np.sinc(f * self.sample_interval) ** 2
        return float(self.noise * np.sqrt(np.trapezoid(np.abs(response) ** 2 * density, f)))

    def met(self, command: Command) -> bool:
        """Whether all members meet the requirements and the set is robustly stable.

        command: controller's response at frequencies in Hz, shape (n,).
        """
        return (
            not self.encircled(command)
            and self.robust(command) < 1.0
            and all(self.required.met(m) for m in self.loops(command).values())
        )

    def encircled(self, command: Command) -> int:
        """Encirclements of -1 by the nominal loop; 0 if it is stable. command: as in `nominal`, (n,)."""
        return encircled(command(self.frequency) * self.path(self.frequency))
