"""Moving average: a channel is the mean of the measured quantity over a window.

Optical speed sensors, GNSS receivers and counters of pulses average over a fixed time; a logger that
decimates does the same.

Equation
--------
    y(t) = (1 / T) integral of f over the window from t - T to t,   y' = (f(t) - f(t - T)) / T

Symbols
-------
    T   window   s   0.5 to 20 periods of the recording (absent 0)

Trace
-----
The channel trails by half of the window; what has the window as its period is gone.

Confused with
-------------
Sensor delay (keeps fast motion), lag (keeps a little of all motion): a square excitation whose period
is near the window.

Reference
---------
Oppenheim and Schafer, "Discrete-time signal processing", 3rd edition (2010), section 2.6: frequency
response of the moving average.
"""

from dataclasses import dataclass

from slipbench.identification.mismatch.systems.effects.seam_effect import OUTPUT, SeamEffect
from slipbench.plant.parameters import parameter


def average(
    value: float, past: float, mean: float, window: float, step: float
) -> tuple[float, float]:
    """Return the mean and its rate; within one step the quantity is linear."""
    if window < step:
        return value - 0.5 * (value - past), (value - mean) / step
    return mean, (value - past) / window


@dataclass(frozen=True)
class MovingAverage(SeamEffect):
    """A channel that averages over a window."""

    name = "moving_average"
    block = "seam"
    confused_with = ("sensor_delay", "lag")
    acts_on = (OUTPUT,)
    delay_parameter = "window"
    states = ("mean",)
    starts = ("value",)
    act = average

    window: float = parameter(
        4.0, "[time]", 0.0, 200.0, "over which the channel averages", absent=0.0, smallest=0.5
    )
