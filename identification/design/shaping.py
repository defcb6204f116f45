"""Internal model control for an identified model: one number to choose, the bandwidth.

G = G_- G_+: G_- is what can be inverted by something stable and smooth; G_+ has the delay, zeros
outside the unit circle (mirrored in G_-, so that G_+ turns without growing) and zeros that would
make the command ring (real and negative: what sampling makes), both with gain 1 at rest.
Q = F / G_-, F = ((1 - f) / (z - f))^n z^k. (Morari and Zafiriou 1989, chapters 4 and 8.)
"""

import math
from dataclasses import dataclass

import numpy as np

from slipbench.controllers.internal_model import InternalModel
from slipbench.controllers.limits import Range
from slipbench.controllers.linear import in_series
from slipbench.identification.design.sampled import Sampled, answer, sections
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
        """Return the controller, its command inside limits."""
        model, inverse = in_series(self.model), in_series(self.inverse)
        return InternalModel(model, inverse, self.delay, self.period, limits)

    def response(self, frequency: FloatArray) -> ComplexArray:
        """C = Q / (1 - Q G z^-d) at frequencies in Hz: from error to command."""
        q, g = self.inverse_response(frequency), self.model_response(frequency)
        return np.asarray(q / (1 - q * g))

    def inverse_response(self, frequency: FloatArray) -> ComplexArray:
        """Q at frequencies in Hz."""
        return answer(self.inverse, np.exp(2j * np.pi * np.asarray(frequency) * self.period))

    def model_response(self, frequency: FloatArray) -> ComplexArray:
        """G with its delay at frequencies in Hz."""
        z = np.exp(2j * np.pi * np.asarray(frequency) * self.period)
        return np.asarray(answer(self.model, z) * z**-self.delay)

    def reference_response(self, frequency: FloatArray) -> ComplexArray:
        """From reference to command, the loop open: the same as from the error."""
        return self.response(frequency)


def shaped(plant: Sampled, bandwidth: float, extra_order: int = 1) -> Shape:
    """Design a controller. bandwidth: of the filter, Hz (each of its lags at that corner).

    extra_order: lags beyond what makes Q proper; one keeps sensor noise out of the command.
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
