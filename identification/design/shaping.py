"""Internal model control for an identified model, with the bandwidth as the only parameter.

G = G_- G_+: G_- has a stable, well-damped inverse; G_+ has the delay, the zeros outside the unit
circle (mirrored in G_-, so that G_+ is all-pass) and the zeros that would make the command ring
(real and negative, from sampling). G_+ has DC gain 1.
Q = F / G_-, F = ((1 - f) / (z - f))^n z^k. (Morari and Zafiriou 1989, chapters 4 and 8.)
"""

import math
from dataclasses import dataclass

import numpy as np

from slipbench.controllers.internal_model import InternalModel
from slipbench.controllers.limits import Range
from slipbench.controllers.linear import in_series
from slipbench.identification.design.sampled import Sampled, sections, sections_response
from slipbench.identification.response.response import ComplexArray
from slipbench.protocol.recording.channel import FloatArray


@dataclass(frozen=True)
class Shape:
    """model, inverse: sections of G without its delay and of Q; delay: whole periods; period: s."""

    model: tuple[tuple[float, ...], ...]
    inverse: tuple[tuple[float, ...], ...]
    delay: int
    period: float

    def controller(self, limits: Range) -> InternalModel:
        """Controller with its command limited."""
        model, inverse = in_series(self.model), in_series(self.inverse)
        return InternalModel(model, inverse, self.delay, self.period, limits)

    def response(self, frequency: FloatArray) -> ComplexArray:
        """Frequency response from error to command, C = Q / (1 - Q G z^-d). frequency: Hz, (n,)."""
        q, g = self.inverse_response(frequency), self.model_response(frequency)
        return np.asarray(q / (1 - q * g))

    def inverse_response(self, frequency: FloatArray) -> ComplexArray:
        """Frequency response of Q. frequency: Hz, shape (n,)."""
        return sections_response(
            self.inverse, np.exp(2j * np.pi * np.asarray(frequency) * self.period)
        )

    def model_response(self, frequency: FloatArray) -> ComplexArray:
        """Frequency response of G with its delay. frequency: Hz, shape (n,)."""
        z = np.exp(2j * np.pi * np.asarray(frequency) * self.period)
        return np.asarray(sections_response(self.model, z) * z**-self.delay)

    def reference_response(self, frequency: FloatArray) -> ComplexArray:
        """Open-loop response from reference to command, the same as from the error. Hz, shape (n,)."""
        return self.response(frequency)


def shaped(plant: Sampled, bandwidth: float, extra_order: int = 1) -> Shape:
    """Internal model controller. bandwidth: corner frequency of each lag of the filter, Hz.

    extra_order: lags beyond those that make Q proper; one attenuates sensor noise.
    """
    model = sections(plant.zeros, plant.poles, plant.gain)
    inverse = sections(*_inverse(plant, bandwidth, extra_order))
    return Shape(model, inverse, plant.delay, plant.period)


def _inverse(
    plant: Sampled, bandwidth: float, extra: int
) -> tuple[ComplexArray, ComplexArray, float]:
    """Zeros, poles and gain of Q."""
    z0 = plant.zeros
    ringing = (np.abs(z0.imag) < 1e-9) & (z0.real < 0.0)
    outside = ~ringing & (np.abs(z0) > 1.0)
    kept = np.concatenate((z0[~ringing & ~outside], 1.0 / np.conj(z0[outside])))
    lag = math.exp(-2 * math.pi * bandwidth * plant.period)
    order = max(plant.poles.size - kept.size + extra, 1)
    poles = np.concatenate((kept, np.full(order, lag)))
    steady = np.prod(1 - plant.poles) / np.prod(1 - poles)
    return plant.poles, poles, float(np.real(1.0 / plant.steady / steady))
