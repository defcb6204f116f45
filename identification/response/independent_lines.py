"""Lines of a measured response that share no noise: what a fit may count as evidence.

Neighbouring windows of a local polynomial overlap, and so their estimates err together: fitted as
if independent, 190 lines would pretend to six times the evidence. Taken a stride apart the weights
of the windows are orthogonal but for a few percent, and nothing is lost, because what lies between
follows from the rest.

A very quiet recording is not as accurate as it is repeatable: interpolation between teeth, the
curvature of engine and tyre, the slow drift of the speed each leave some tenths of a percent, which
a fit of high order would take for dynamics. `ACCURACY` is added to the deviation of every line, and
`floor` keeps it: where the residuals of a fit are smaller, the bound was too cautious for this
recording, and the intervals of the fit become narrower.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy import optimize, stats

from slipbench.identification.response.response import ComplexArray, FrequencyResponse
from slipbench.identification.signals.samples import BoolArray
from slipbench.protocol.recording.channel import FloatArray

FEWEST = 8  # lines
ACCURACY = 0.005  # of the gain; no line is trusted further, see above
SERIAL = 0.25  # of a sweep: see models/serial_correlation.py; chosen on seeds below 400000
COMMON = 0.001  # of the gain at the mean operating point of the run: radius and sensor scale


@dataclass(frozen=True)
class Lines:
    """Independent lines of a frequency response.

    frequency  (n,) Hz, increasing
    value      (n,) complex
    deviation  (n,) standard deviation of the complex value
    freedom    real degrees of freedom of which each deviation was estimated; inf where known
    floor      part of each deviation that is a bound on the accuracy, relative to the gain
    serial     variance of gain errors that are smooth along frequency, over that of the others
    common     relative standard deviation that the gain of all lines has in common: wind and fuel
               move the operating point within a run, and what is not known of the sensors' scale
    """

    input: str
    output: str
    frequency: FloatArray
    value: ComplexArray
    deviation: FloatArray
    freedom: float = float("inf")
    common: float = 0.0
    floor: float = 0.0
    serial: float = 0.0

    @property
    def measured_share(self) -> float:
        """Mean share of the lines' variance that was measured; the rest is the bound `floor`."""
        bound = (self.floor * np.abs(self.value) / self.deviation) ** 2
        return float(np.mean(np.maximum(1 - bound, 0.0)))

    @property
    def inflation(self) -> float:
        """Mean of chi-square per degree of freedom under a right model: above 1 by the scatter
        of the deviations themselves, the mean of an F distribution.
        """
        return 1 / (1 - 2 / self.freedom) if self.freedom > 4 else 2.0


@dataclass(frozen=True)
class KnownPath:
    """A path known beforehand: prod(1 + s lead) / prod(1 + s lag) e^(-s delay).

    lags   s: the filling time of the intake, a sensor's lag
    leads  s: damping over stiffness of the driveline
    delay  s: of instruments; below zero where a channel is stamped late
    doubt  s: standard deviation of the sum of lags less leads, as well as it is known

    A lag that is short beside the band and a dead time are indistinguishable: what is known of the
    one determines the other.
    """

    lags: tuple[float, ...] = ()
    leads: tuple[float, ...] = ()
    delay: float = 0.0
    doubt: float = 0.0

    def response(self, frequency: FloatArray) -> ComplexArray:
        """The complex response at frequencies in Hz, (n,)."""
        s = 2j * np.pi * frequency
        value = np.exp(-s * self.delay)
        for lead in self.leads:
            value = value * (1 + lead * s)
        for lag in self.lags:
            value = value / (1 + lag * s)
        return np.asarray(value)


def without(lines: Lines, path: KnownPath) -> Lines:
    """Take a known path off a response; the residual is to be fitted."""
    known = path.response(lines.frequency)
    return replace(lines, value=lines.value / known, deviation=lines.deviation / np.abs(known))


def subset(lines: Lines, kept: BoolArray) -> Lines:
    """Lines that are kept. kept: (n,) bool."""
    return replace(
        lines,
        frequency=lines.frequency[kept],
        value=lines.value[kept],
        deviation=lines.deviation[kept],
    )


@dataclass(frozen=True)
class NoRational:
    """Why no rational function is given."""

    reason: str


def independent_lines(
    response: FrequencyResponse, low: float = 0.0, high: float = float("inf")
) -> Lines | NoRational:
    """Take the reliable lines between low and high (Hz) that share no noise.

    The first and last stride are left out where windows overlap: there they are cut off.
    """
    n, stride = response.frequency.size, response.stride
    ends = stride if stride > 1 else 0
    chosen = np.arange(ends, n - ends, stride)
    f = response.frequency[chosen]
    chosen = chosen[response.reliable[chosen] & (f >= low) & (f <= high)]
    if chosen.size < FEWEST:
        return NoRational(
            f"{chosen.size} independent lines of the response from {response.input} to "
            f"{response.output} are reliable, at least {FEWEST} are needed"
        )
    return Lines(
        response.input,
        response.output,
        response.frequency[chosen],
        response.value[chosen],
        np.hypot(response.deviation[chosen], ACCURACY * np.abs(response.value[chosen])),
        freedom(response.quantile),
        COMMON,
        ACCURACY,
        SERIAL if response.stride > 1 else 0.0,
    )


def freedom(quantile: float) -> float:
    """Degrees of freedom of the Student distribution with this two-sided 95 % quantile."""
    limit = float(stats.norm.ppf(0.975))
    if quantile <= limit + 1e-4:
        return float("inf")
    return float(optimize.brentq(lambda n: float(stats.t.ppf(0.975, n)) - quantile, 0.5, 1e5))
