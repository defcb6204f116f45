"""Lines of a frequency response with a known truth and complex normal noise."""

import numpy as np

from slipbench.identification.models.rational_model import RationalModel
from slipbench.identification.response.independent_lines import Lines

W = 2 * np.pi * 8.6


def chain(delay=0.010, damping=0.32, corner=16.0, zeros=(), gain=0.17):
    """Driveline's resonance behind a real pole (Hz) and a delay; unit steady gain times `gain`."""
    pair = np.roots([1 / W**2, 2 * damping / W, 1])
    poles = np.concatenate((pair, [-2 * np.pi * corner]))
    zeros = np.asarray(zeros, dtype=complex)
    steady = np.prod(-zeros) / np.prod(-poles)
    return RationalModel("u", "y", zeros, poles, float((gain / steady).real), delay)


def lines(model, noise=0.01, seed=1, n=40, band=(0.8, 12.0), pace=1.0):
    """noise: standard deviation of the complex value relative to the steady gain."""
    f = np.linspace(*band, n) * pace
    G = model.response(f)
    sd = np.full(n, noise * 0.17)
    rng = np.random.default_rng(seed)
    e = (rng.standard_normal(n) + 1j * rng.standard_normal(n)) * sd / np.sqrt(2)
    return Lines("u", "y", f, G + e, sd)
