"""Noise in what drives a system: its best predictor is smoothed, and no physics smoothes it.

Where an input u is motion s and noise n, what follows s is best foretold not by u but by its
Wiener filter S_s / (S_s + S_n) u, and a simulation that u drives seems to lack a lag, a mode, or
whatever else rounds u off. But noise knows no before and after: that filter is real, so it smoothes
to both sides alike, which no cause does. So for an input whose file tells noise the symmetric
filters

    u + q_k (G_k u - u),   G_k a Gaussian window of k-th width,
    q_k ~ N(0, s_k^2),     s_k = min(1, deviation of n over that of G_k u - u)

vary with the rest, and explain nothing; a lag, which has a direction, remains. s_k: what a filter takes
off is about as much as the noise. Wider, it would take motion off, as a lag does. (Kay,
"Fundamentals of statistical signal processing: estimation theory" (1993), chapter 12; Soederstroem,
"Errors-in-variables methods in system identification", Automatica 43, 2007.)
"""

import numpy as np
from scipy import ndimage

from slipbench.plant.signals import Floats

WIDTHS = (0.7, 1.4, 2.8, 5.6)
"""Standard deviations of the windows, in samples: octaves about the fastest that can be told."""


def smoothings(values: Floats, rows_per_sample: float, noise: float) -> list[Floats]:
    """Return what each window takes off an input and adds to it, (rows,) each, per prior deviation.

    noise: standard deviation of the sensor's noise, in the unit of the values.
    """
    changes = (
        ndimage.gaussian_filter1d(values, width * rows_per_sample, mode="nearest") - values
        for width in WIDTHS
    )
    return [np.asarray(c * min(1.0, noise / max(float(np.std(c)), 1e-300))) for c in changes]


def noise_of(samples: Floats) -> float:
    """Return the deviation that white noise of samples has at most, from their second differences.

    Rice, "Bandwidth choice for nonparametric regression", Annals of Statistics 12 (1984): what is
    smooth from sample to sample has next to none.
    """
    return float(np.sqrt(np.mean(np.diff(samples, 2) ** 2) / 6.0)) if samples.size > 2 else 0.0
