"""Rolling radii differ from the values in the file: where little torque flows, a wheel rolls without slip.

There the ratio of the two speeds is the ratio of true to nominal radius. It is an estimate to be read,
not a correction: nothing here is applied to the slip.
"""

from dataclasses import dataclass

import numpy as np

from slipbench.protocol.recording.channel import FloatArray

WIDE_RANGE = 0.3  # of throttle, that a drive must show for its low end to mean little torque
LOW_TORQUE = 0.10  # of the observed throttle range, from its lowest
LEAST_SPEED = 5.0  # m/s
FEWEST = 50


@dataclass(frozen=True)
class RadiusEstimate:
    """ratio: driven over reference speed when rolling. deviation: robust, of one sample."""

    ratio: float
    deviation: float
    samples: int
    condition: str


def rolling_ratio(
    driven: FloatArray, reference: FloatArray, throttle: FloatArray | None
) -> RadiusEstimate | None:
    """Median speed ratio at low torque; None where too few samples qualify. (n,) each."""
    with np.errstate(invalid="ignore"):
        rolling = np.isfinite(driven) & (reference > LEAST_SPEED)
        if throttle is None or not np.isfinite(throttle).any():
            return None
        low, high = np.nanpercentile(throttle, (0.5, 99.5))
        rolling &= throttle <= low + LOW_TORQUE * (high - low)
    ratio = driven[rolling] / reference[rolling]
    if ratio.size < FEWEST or high - low < WIDE_RANGE:
        return None
    middle = float(np.median(ratio))
    spread = float(1.4826 * np.median(np.abs(ratio - middle)))
    limit = 100 * (low + LOW_TORQUE * (high - low))
    return RadiusEstimate(middle, spread, int(ratio.size), f"throttle below {limit:.0f} %")
