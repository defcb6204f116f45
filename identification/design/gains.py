"""PID gains and their frequency response, for the design."""

from dataclasses import dataclass

import numpy as np

from slipbench.controllers.limits import Range
from slipbench.controllers.pid import Pid
from slipbench.identification.response.response import ComplexArray
from slipbench.protocol.recording.channel import FloatArray


@dataclass(frozen=True)
class Gains:
    """Proportional, integral (1/s), derivative (s) gain and filter time (s) of a PID."""

    proportional: float
    integral: float
    derivative: float
    filter_time: float
    period: float
    reference_weight: float = 1.0

    def response(self, frequency: FloatArray) -> ComplexArray:
        """Frequency response from error to command, complex, of `Pid`. frequency: Hz, shape (n,)."""
        z = np.exp(2j * np.pi * np.asarray(frequency) * self.period)
        whole = self.filter_time + self.period
        slope = self.derivative * (1 - 1 / z) / (whole - self.filter_time / z)
        return np.asarray(self.proportional + self.integral * self.period / (z - 1) + slope)

    def reference_response(self, frequency: FloatArray) -> ComplexArray:
        """Open-loop response from reference to command, complex, shape (n,). frequency: Hz, shape (n,).

        The reference is not differentiated.
        """
        z = np.exp(2j * np.pi * np.asarray(frequency) * self.period)
        weighted = self.reference_weight * self.proportional
        return np.asarray(weighted + self.integral * self.period / (z - 1))

    def controller(self, limits: Range) -> Pid:
        """Controller with its command limited."""
        track = max(2 * np.sqrt(abs(self.derivative / self.integral)), 0.02)
        return Pid(
            self.proportional,
            self.integral,
            self.derivative,
            limits,
            filter_time=self.filter_time,
            tracking_time=float(track),
            reference_weight=self.reference_weight,
        )
