"""Best linear approximation under random-phase odd multisines, noise and distortion separated.

A nonlinear system responds to a random-phase multisine like a linear one, plus distortion that
looks like noise but repeats with every period and changes with every realisation of the phases:

    Y(l) = G_BLA(l) U(l) + Y_S(l) + noise(l)

What differs between periods is noise; what differs between realisations is noise and distortion
(the robust method). Where only odd lines are excited and some of those are left free, even lines
show even distortion and free odd ones odd distortion (the fast method, one realisation is enough).
Between the lines of a record of P whole periods there is only noise and the transient of its ends;
the transient is smooth and removed by a local parabola, and the residual is the noise
(Pintelon and Schoukens, System Identification: A Frequency Domain Approach, 2nd ed., chapters 4
and 7).

    results = [periodic_record_of(identify(read(folder))) for folder in folders]
    records = [record for record in results if isinstance(record, PeriodicRecord)]
    found = best_linear(records)                  # BestLinearApproximation or NoBestLinear
    found.to_response().to_control()
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy import stats

from slipbench.identification.response.describing_function import against_delay
from slipbench.identification.response.periodic_record import Lines, PeriodicRecord, lines_of
from slipbench.identification.response.response import ComplexArray, FrequencyResponse
from slipbench.identification.signals.samples import BoolArray
from slipbench.protocol.recording.channel import FloatArray

IntArray = npt.NDArray[np.int64]
NEIGHBOURS = 3  # lines on each side, from whose scatter a single realisation is judged
FEWEST = 2 * NEIGHBOURS + 1
STRONG = 0.1  # of the strongest line's amplitude, from which a line counts as excited


@dataclass(frozen=True)
class Level:
    """Distortion at lines that were not excited: frequency (m,) Hz; level (m,), noise (m,).

    Both are root mean squares in the unit of the response: as if the input nearby had caused them.
    """

    frequency: FloatArray
    level: FloatArray
    noise: FloatArray


@dataclass(frozen=True)
class BestLinearApproximation:
    """Response to a class of excitations, with what is noise and what is not linear.

    input, output    roles
    frequency        (n,) Hz, excited lines
    value            (n,) complex, output unit per input unit
    noise_deviation  (n,) standard deviation of the value by noise alone
    total_deviation  (n,) standard deviation by noise and distortion
    freedom          of the total deviation: complex degrees of freedom
    even, odd        distortion at lines left free; empty where there are none
    realisations, periods  that were averaged; method: for people
    """

    input: str
    output: str
    frequency: FloatArray
    value: ComplexArray
    noise_deviation: FloatArray
    total_deviation: FloatArray
    freedom: int
    even: Level
    odd: Level
    realisations: int
    periods: int
    method: str

    def to_response(self) -> FrequencyResponse:
        """Give it as a frequency response whose deviation holds noise and distortion."""
        power = np.abs(self.value) ** 2
        of_one = self.total_deviation**2 * self.realisations
        return FrequencyResponse(
            self.input,
            self.output,
            self.frequency,
            self.value,
            power / (power + of_one),
            self.total_deviation,
            float(stats.t.ppf(0.975, 2 * self.freedom)),
            self.method,
        )


@dataclass(frozen=True)
class NoBestLinear:
    """Why no best linear approximation is given."""

    reason: str


def best_linear(records: Sequence[PeriodicRecord]) -> BestLinearApproximation | NoBestLinear:
    """Average realisations of one multisine: same period and band, other phases."""
    if not records:
        return NoBestLinear("no record of a multisine")
    first = records[0]
    if any(abs(r.period - first.period) > 1e-9 for r in records):
        return NoBestLinear("the multisines have different periods")
    results = [lines_of(record) for record in records]
    several = [lines for lines in results if isinstance(lines, Lines)]
    if len(several) < len(results):
        return NoBestLinear(next(x for x in results if isinstance(x, str)))
    size = min(lines.u.size for lines in several)
    u, y, noise = (
        np.stack([getattr(x, key)[:size] for x in several]) for key in ("u", "y", "noise")
    )
    strong = np.abs(u) > STRONG * np.abs(u).max(axis=1, keepdims=True)
    excited = np.flatnonzero(strong.any(axis=0))
    if excited.size < FEWEST:
        return NoBestLinear(f"{excited.size} lines are excited, at least {FEWEST} are needed")
    return _assembled(records, u, y, noise, strong, several[0].periods)


def _assembled(
    records: Sequence[PeriodicRecord],
    u: ComplexArray,
    y: ComplexArray,
    noise: FloatArray,
    strong: BoolArray,
    periods: int,
) -> BestLinearApproximation:
    count = strong.sum(axis=0)
    excited = np.flatnonzero(count)
    g = np.where(strong, y / np.where(strong, u, 1.0), 0.0)[:, excited]
    used, times = strong[:, excited], count[excited]
    value = g.sum(axis=0) / times
    size = np.where(strong, np.abs(u), np.nan)[:, excited]
    of_noise = np.sqrt(np.nansum(noise[:, excited] / size**2, axis=0)) / times
    lines = np.arange(u.shape[1])
    free = ~strong & (lines > excited[0]) & (lines < excited[-1])
    rest = _unexplained(u, y, excited, value)
    usual = np.interp(lines, excited, np.sqrt(np.nanmean(size**2, axis=0)))
    even, odd = (
        _level(rest / usual, noise / usual**2, free & (lines % 2 == k), records[0].period)
        for k in (0, 1)
    )
    if len(records) == 1 and odd.level.size >= FEWEST:
        total, freedom = _beside(odd, excited / records[0].period), FEWEST
    else:
        total, freedom = _scatter(excited, g, used, value)
    return BestLinearApproximation(
        records[0].input,
        records[0].output,
        excited / records[0].period,
        value,
        of_noise,
        np.maximum(total, of_noise),
        freedom,
        even,
        odd,
        len(records),
        periods,
        f"best linear approximation, {len(records)} realisations of {periods} periods",
    )


def _scatter(
    lines: IntArray, g: ComplexArray, used: BoolArray, value: ComplexArray
) -> tuple[FloatArray, int]:
    """Deviation of the mean over realisations, pooled over neighbouring lines, and its freedom.

    One realisation has no scatter; what a parabola through its neighbouring lines leaves stands in.
    """
    n = value.size
    width = min(2 * NEIGHBOURS + 1, n)
    first = np.clip(np.arange(n) - NEIGHBOURS, 0, n - width)
    near = first[:, None] + np.arange(width)
    times = used.sum(axis=0)
    spread = (times - 1)[near].sum(axis=1)
    if spread.min() > 0:
        squares = np.sum(np.where(used, np.abs(g - value) ** 2, 0), axis=0)
        return np.sqrt(squares[near].sum(axis=1) / spread / times), int(spread.min())
    turned = (value * against_delay(lines.astype(np.float64), value))[near]
    away = (lines[near] - lines[:, None]) / (lines[-1] - lines[0])
    smooth = away[..., None] ** np.arange(3)
    residual = turned - np.einsum("wij,wj->wi", smooth @ np.linalg.pinv(smooth), turned)
    return np.sqrt(np.sum(np.abs(residual) ** 2, axis=1) / (width - 3)), width - 3


def _beside(odd: Level, frequency: FloatArray) -> FloatArray:
    """Deviation by noise and odd distortion, from the free odd lines near some frequencies."""
    power = np.convolve(np.pad(odd.level**2, NEIGHBOURS, mode="reflect"), np.ones(FEWEST), "valid")
    return np.sqrt(np.interp(frequency, odd.frequency, power / FEWEST))


def _unexplained(
    u: ComplexArray, y: ComplexArray, excited: IntArray, value: ComplexArray
) -> ComplexArray:
    """Residual of the approximation, interpolated to lines between. (runs, lines)."""
    lines = np.arange(u.shape[1])
    gain = np.interp(lines, excited, np.abs(value))
    phase = np.interp(lines, excited, np.unwrap(np.angle(value)))
    return np.asarray(y - gain * np.exp(1j * phase) * u)


def _level(rest: ComplexArray, noise: FloatArray, free: BoolArray, period: float) -> Level:
    """Root mean square of the residual at free lines, over realisations that leave them free."""
    lines = np.flatnonzero(free.any(axis=0))
    power, by_noise = (
        np.sum(np.where(free, x, 0.0), axis=0)[lines] / free.sum(axis=0)[lines]
        for x in (np.abs(rest) ** 2, noise)
    )
    return Level(lines / period, np.sqrt(power), np.sqrt(by_noise))
