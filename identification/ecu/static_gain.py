"""The static part of a control law: what it adds to a slip error besides its integral.

Near z = 1 a law with an integral is C(z) = k T / (z - 1) + g + O(z - 1). g is its static gain: the
proportional gain of a PID, the DC gain of what stands beside the integral otherwise.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

from slipbench.controllers.linear import in_series

STEP = 1e-4  # of z from 1, along the imaginary axis: the error is of the order of its square


def static_gain(law: Mapping[str, Any]) -> float:
    """Static gain, command per slip. law: a table [law] of a controller file."""
    if law["kind"] == "pid":
        return float(law["proportional"])
    if law["kind"] == "linear":
        return in_series(law["shaping"]).gain
    z = np.array([1.0 + 1j * STEP])
    q, g = (in_series(law[name]).response(z) for name in ("inverse", "model"))
    whole = q / (1.0 - q * g * z ** -law["delay"])
    return float((whole * (z - 1.0)).imag[0] / STEP)
