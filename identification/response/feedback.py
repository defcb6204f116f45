"""Whether the input follows the output: a closed loop, in which no response can be identified.

Beside its excitation, an input has a remainder. In an open loop the noise of the output is
independent of the remainder; in a closed one it causes the remainder, and G = Y / U tends to -1 / C
where the noise rules (Ljung, System Identification, 2nd ed., section 13.4). So the input without
its excitation is compared with the output without its response to the input: the greatest
correlation over lags, against that of the same two shifted by long, random times.
"""

from dataclasses import dataclass

import numpy as np

from slipbench.identification.response.phase_locked import left_of
from slipbench.identification.response.response import FrequencyResponse
from slipbench.identification.response.swept_run import SweptRun, swept_run
from slipbench.protocol.recording.channel import FloatArray

LONGEST = 0.5  # s, within which a rider or a controller responds
SHARE = 0.01  # of the input's power; less than this cannot bias a response by a percent
SHIFTS, SEED = 200, 1
BEYOND = 1.5  # times the greatest of the shifted correlations


@dataclass(frozen=True)
class Feedback:
    """The input follows the output.

    share        of the input's power that is not excitation
    correlation  greatest, of that with the noise of the output; lag: s, the input behind the output
    """

    share: float
    correlation: float
    lag: float

    @property
    def reason(self) -> str:
        """Return it in words."""
        return (
            f"the input follows the output: {100 * self.share:.0f} % of its power is not the "
            f"excitation and correlates with the output's noise ({self.correlation:.2f} at a lag "
            f"of {1e3 * self.lag:.0f} ms). In a closed loop the response cannot be identified; "
            "open it, or identify from the loop's reference"
        )


def feedback(
    u: FloatArray, y: FloatArray, rate: float, response: FrequencyResponse
) -> Feedback | None:
    """Test a sweep for feedback. u, y: (n,), while it excited. None where there is none to see."""
    run = swept_run(u, y, rate)
    if not isinstance(run, SweptRun):
        return None
    extra = left_of(run, run.u)
    share = float(np.var(extra) / np.var(run.u))
    if share < SHARE:
        return None
    noise = _unexplained(run, response)
    lags = round(LONGEST * rate)
    found = _correlations(extra, noise)
    near = np.concatenate((found[-lags:], found[: lags + 1]))
    at = int(np.argmax(np.abs(near)))
    rng = np.random.default_rng(SEED)
    far = rng.integers(2 * lags, max(extra.size - 2 * lags, 2 * lags + 1), SHIFTS)
    chance = float(np.max(np.abs(found[far])))
    if abs(near[at]) <= BEYOND * chance:
        return None
    return Feedback(share, float(near[at]), (at - lags) / rate)


def _unexplained(run: SweptRun, response: FrequencyResponse) -> FloatArray:
    """Output without its response to the input inside the band, (n,)."""
    f = np.fft.rfftfreq(run.y.size, 1 / run.rate)
    inside = (f >= response.frequency[0]) & (f <= response.frequency[-1])
    value = np.interp(f, response.frequency, response.value.real) + 1j * np.interp(
        f, response.frequency, response.value.imag
    )
    U, Y = np.fft.rfft(run.u - run.u.mean()), np.fft.rfft(run.y - run.y.mean())
    residual = np.where(inside, Y - value * U, 0.0)
    return np.asarray(left_of(run, np.fft.irfft(residual, run.y.size)))


def _correlations(a: FloatArray, b: FloatArray) -> FloatArray:
    """Circular cross-correlation: index k is a behind b by k samples, negative ones wrap. (n,)."""
    a, b = a - a.mean(), b - b.mean()
    product = np.fft.rfft(a) * np.conj(np.fft.rfft(b))
    size = np.sqrt(np.sum(a**2) * np.sum(b**2)) + 1e-300
    return np.asarray(np.fft.irfft(product, a.size) / size)
