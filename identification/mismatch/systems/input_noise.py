"""Noise in what drives a system: its best predictor is smoothed, and no physics smoothes it.

Where an input u is motion s and noise n, what follows s is best foretold not by u but by its
Wiener filter S_s / (S_s + S_n) u, and a simulation that u drives seems to lack a lag, a mode, or
whatever else rounds u off. But noise knows no before and after: that filter is real, so it smoothes
to both sides alike, which no cause does. So for an input whose file tells noise the symmetric
filters

    u + q_k (G_k u - u),   G_k a Gaussian window of k-th width, q_k ~ N(0, 1)

vary freely with the rest, and explain nothing; a lag, which has a direction, remains. (Kay,
"Fundamentals of statistical signal processing: estimation theory" (1993), chapter 12; Soederstroem,
"Errors-in-variables methods in system identification", Automatica 43, 2007.)
"""

import numpy as np
from scipy import ndimage

from slipbench.plant.signals import Floats

WIDTHS = (0.7, 1.4, 2.8, 5.6)
"""Standard deviations of the windows, in samples: octaves about the fastest that can be told."""


def smoothings(values: Floats, rows_per_sample: float) -> list[Floats]:
    """Return what each window takes off an input and adds to it, (rows,) each."""
    return [
        np.asarray(
            ndimage.gaussian_filter1d(values, width * rows_per_sample, mode="nearest") - values
        )
        for width in WIDTHS
    ]
