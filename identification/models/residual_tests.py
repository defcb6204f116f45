"""Residual tests of a model in the excited band: whiteness and cross-correlation with the input.

The discrete Fourier transform of the residual at the L lines of the band, shifted to zero frequency,
is a complex time series of L samples. Under noise of equal power over the band its lines are
independent complex normal variables. Then the autocorrelation at lag k / (high - low) is

    r(k) = sum |E_l|^2 e^(2 pi i k l / L) / sum |E_l|^2,    L |r(k)|^2 -> exponential of mean 1,

and 2 L sum_k |r(k)|^2 over M lags -> chi-square with 2 M degrees of freedom, as the portmanteau test
of Ljung and Box (Biometrika 65 (1978) 297). The cross-correlation with the input is tested after both
are whitened, so that the bounds do not depend on their spectra (Box, Jenkins and Reinsel, Time Series
Analysis, 4th ed., section 12.1). A residual that depends on the input is a fault of the model; one
that is not white is not: it says that the noise has dynamics of its own (Ljung, System Identification,
2nd ed., section 16.6).

    tests = residual_tests(measured - simulated, u, rate, (0.5, 12.0))
    tests.autocorrelation.probability, tests.cross_correlation.passed
"""

from dataclasses import dataclass

import numpy as np
from scipy import stats

from slipbench.identification.response.response import ComplexArray
from slipbench.protocol.recording.channel import FloatArray

LEVEL = 0.01  # probability under which a test rejects
CONFIDENCE = 0.95  # of the bounds that are drawn
LAGS = 25
FEWEST = 60  # lines; with fewer the chi-square law does not hold
HALF_WIDTH = 12  # lines to each side, over which a spectrum is smoothed


@dataclass(frozen=True)
class CorrelationTest:
    """Correlation of the residual over lags, and the test that all of it is chance.

    lag          s, (m,); value: magnitude of the correlation coefficient, (m,), 0..1
    bound        that 95 % of the values are below, each by itself, where the test's law holds
    probability  of so much correlation by chance, over all lags
    share        of the residual's amplitude that is correlated beyond chance, 0..1
    """

    lag: FloatArray
    value: FloatArray
    bound: float
    probability: float
    share: float

    @property
    def passed(self) -> bool:
        """Whether chance explains the correlation at the level of the test, 1 %."""
        return self.probability >= LEVEL


@dataclass(frozen=True)
class ResidualTests:
    """Whiteness of a residual and its cross-correlation with the input, in a band (Hz)."""

    band: tuple[float, float]
    lines: int
    autocorrelation: CorrelationTest
    cross_correlation: CorrelationTest


@dataclass(frozen=True)
class NoTests:
    """Why residual tests are not given."""

    reason: str


def residual_tests(
    residual: FloatArray, u: FloatArray, rate: float, band: tuple[float, float], parameters: int = 0
) -> ResidualTests | NoTests:
    """Residual tests of one record. residual, u: (n,) at `rate` Hz; band: Hz.

    parameters: number that was fitted to this record, which uses up as many degrees of freedom of the
    whiteness test; 0 on held-out data.
    """
    E, U = (in_band(x, rate, band) for x in (residual, u))
    if E.size < FEWEST:
        return NoTests(
            f"the record has {E.size} lines in the band of {band[0]:.2g} to {band[1]:.3g} Hz, at least "
            f"{FEWEST} are needed"
        )
    if not (np.any(E) and np.any(U)):
        return NoTests("the residual or the input is zero in the band")
    spacing = 1 / (band[1] - band[0])
    return ResidualTests(
        band, E.size, _autocorrelation(E, spacing, parameters), _cross_correlation(E, U, spacing)
    )


def in_band(x: FloatArray, rate: float, band: tuple[float, float]) -> ComplexArray:
    """Lines of the transform of x, (n,), in a band, after the slower part is removed."""
    f = np.fft.rfftfreq(x.size, 1 / rate)
    return np.asarray(np.fft.rfft(without_slow(x, rate, band[0]))[(f >= band[0]) & (f <= band[1])])


def without_slow(x: FloatArray, rate: float, low: float) -> FloatArray:
    """x, (n,), without its mean, its straight line and cosines slower than 0.8 of a frequency (Hz).

    Cosines with a level end at both ends, as in the discrete cosine transform, hold a drift without
    the step that its periodic continuation has.
    """
    from scipy import fft

    t = np.linspace(-1.0, 1.0, x.size)
    level = x - np.polyval(np.polyfit(t, x, 1), t)
    cosines = fft.dct(level, norm="ortho")
    cosines[: int(2 * 0.8 * low * x.size / rate) + 1] = 0.0
    return np.asarray(fft.idct(cosines, norm="ortho"))


def _autocorrelation(E: ComplexArray, spacing: float, parameters: int) -> CorrelationTest:
    power = np.abs(E) ** 2
    lags = min(LAGS, E.size // 8)
    value = np.abs(np.fft.ifft(power)[1 : lags + 1]) * E.size / power.sum()
    return _judged(value, E.size, spacing * np.arange(1.0, lags + 1), parameters)


def _cross_correlation(E: ComplexArray, U: ComplexArray, spacing: float) -> CorrelationTest:
    """Correlation of what both are after whitening, at lags of both signs; positive: input first."""
    product = _whitened(E) * np.conj(_whitened(U))
    lags = min(LAGS, E.size // 8)
    around = np.fft.ifft(product)
    value = np.abs(np.concatenate((around[-lags:], around[: lags + 1])))
    return _judged(value, E.size, spacing * np.arange(-lags, lags + 1.0))


def _whitened(X: ComplexArray) -> ComplexArray:
    """Lines over the root of their smoothed power, of mean square 1."""
    kernel = np.ones(2 * HALF_WIDTH + 1)
    count = np.convolve(np.ones(X.size), kernel, "same")
    power = np.convolve(np.abs(X) ** 2, kernel, "same") / count
    white = X / np.sqrt(np.maximum(power, 1e-30 * power.max()))
    return np.asarray(white / np.sqrt(np.mean(np.abs(white) ** 2)))


def _judged(value: FloatArray, lines: int, lag: FloatArray, parameters: int = 0) -> CorrelationTest:
    statistic = 2 * lines * float(np.sum(value**2))
    return CorrelationTest(
        lag,
        value,
        float(np.sqrt(-np.log(1 - CONFIDENCE) / lines)),
        float(stats.chi2.sf(statistic, max(2 * value.size - parameters, 1))),
        float(np.sqrt(np.clip(np.sum(value**2) - value.size / lines, 0.0, 1.0))),
    )
