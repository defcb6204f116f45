"""Noise of a measured input: symmetric smoothing filters of the input as nuisances.

Where an input u is motion s plus noise n, the best linear predictor of a response to s uses not u
but its Wiener filter S_s / (S_s + S_n) u. A simulation driven by u then seems to lack a lag, a mode
or another low-pass effect. The transfer function of the Wiener filter is real: it has zero phase,
which no causal effect has. So for an input with sensor noise the symmetric filters

    u + q_k (G_k u - u),   G_k a Gaussian window of k-th width,
    q_k ~ N(0, s_k^2),     s_k = min(1, deviation of n over that of G_k u - u)

are nuisances of the fit; a lag, which is causal, remains identifiable. s_k: a filter removes about
as much as the noise. With a wider prior it would remove motion, as a lag does. (Kay,
"Fundamentals of statistical signal processing: estimation theory" (1993), chapter 12; Soederstroem,
"Errors-in-variables methods in system identification", Automatica 43, 2007.)
"""

import numpy as np
from scipy import ndimage

from slipbench.plant.signals import Floats

WIDTHS = (0.7, 1.4, 2.8, 5.6)
"""Standard deviations of the windows, in samples: octaves from the shortest resolvable one."""


def smoothings(values: Floats, rows_per_sample: float, noise: float) -> list[Floats]:
    """Return G_k u - u of each window, (rows,) each, times its prior deviation s_k.

    values: the input u, (rows,). noise: standard deviation of the sensor's noise, in the unit of u.
    """
    changes = (
        ndimage.gaussian_filter1d(values, width * rows_per_sample, mode="nearest") - values
        for width in WIDTHS
    )
    return [np.asarray(c * min(1.0, noise / max(float(np.std(c)), 1e-300))) for c in changes]


def noise_of(samples: Floats) -> float:
    """Return an upper bound of the deviation of white noise in samples, (n,).

    It is taken from second differences, in which smooth motion is small (Rice, "Bandwidth choice
    for nonparametric regression", Annals of Statistics 12 (1984)).
    """
    return float(np.sqrt(np.mean(np.diff(samples, 2) ** 2) / 6.0)) if samples.size > 2 else 0.0
