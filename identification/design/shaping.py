"""Internal model control for an identified model: one number to choose, the bandwidth.

G = G_- G_+: G_- is what can be inverted by something stable and smooth; G_+ has the delay, zeros
outside the unit circle (mirrored in G_-, so that G_+ turns without growing) and zeros that would
make the command ring (real and negative: what sampling makes), both with gain 1 at rest.
Q = F / G_-, F = ((1 - f) / (z - f))^n z^k. (Morari and Zafiriou 1989, chapters 4 and 8.)
"""

import math

import numpy as np

from controllers.internal_model import InternalModel
from controllers.limits import Range
from identification.design.sampled import Sampled, linear
from identification.response.response import ComplexArray
from protocol.channel import FloatArray


def shaped(plant: Sampled, bandwidth: float, limits: Range, extra_order: int = 1) -> InternalModel:
    """Design a controller. bandwidth: of the filter, Hz (each of its lags at that corner).

    extra_order: lags beyond what makes Q proper; one keeps sensor noise out of the command.
    """
    zeros, poles, gain = _inverse(plant, bandwidth, extra_order)
    model = linear(plant.zeros, plant.poles, plant.gain)
    return InternalModel(model, linear(zeros, poles, gain), plant.delay, plant.period, limits)


def command_response(controller: InternalModel, frequency: FloatArray) -> ComplexArray:
    """C = Q / (1 - Q G z^-d) at frequencies in Hz: from error to command."""
    z = np.exp(2j * np.pi * np.asarray(frequency) * controller.period)
    q = _at(controller.inverse, z)
    g = _at(controller.model, z) * z**-controller.delay
    return np.asarray(q / (1 - q * g))


def noise_gain(controller: InternalModel) -> float:
    """Standard deviation of the command for a white measurement of standard deviation 1."""
    f = np.linspace(0.5, 0.5 / controller.period, 2000)
    z = np.exp(2j * np.pi * f * controller.period)
    return float(np.sqrt(np.mean(np.abs(_at(controller.inverse, z)) ** 2)))


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


def _at(system: object, z: ComplexArray) -> ComplexArray:
    A, B, C, D = (getattr(system, name) for name in "ABCD")
    if not B.size:
        return np.full(z.shape, complex(D))
    whole = z[:, None, None] * np.eye(B.size) - A
    return np.asarray(np.linalg.solve(whole, np.broadcast_to(B, (z.size, B.size))[..., None])[..., 0] @ C + D)
