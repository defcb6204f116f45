"""Whole periods of a multisine, and their lines with the noise between them.

The DFT of P periods has P - 1 lines between each two harmonics. There, only noise and the transient
of the record's ends remain; the transient is smooth over a few lines and is removed by a parabola.
"""

from dataclasses import dataclass

import numpy as np

from slipbench.identification.response.identify import Identification
from slipbench.identification.response.response import ComplexArray
from slipbench.identification.response.swept_recording import signals_of
from slipbench.identification.signals.swept_phase import NoSweep
from slipbench.protocol.recording.channel import FloatArray
from slipbench.protocol.trial_file import Multisine

SETTLING = 1  # periods left out at the start, in which the distortion settles
FEWEST_PERIODS = 2
REACH = 2  # harmonics on each side, between which transient and noise are found
ORDER = 3  # terms of the parabola


@dataclass(frozen=True)
class PeriodicRecord:
    """Input and output under a periodic excitation.

    u, y: (n,) from its start on, without unknown samples; rate: Hz; period: s.
    input, output: roles.
    """

    u: FloatArray
    y: FloatArray
    rate: float
    period: float
    input: str = "u"
    output: str = "y"


@dataclass(frozen=True)
class Lines:
    """u, y: (m,) complex amplitudes at multiples 0, 1, 2... of 1 / period, means of all periods.

    noise: (m,) variance of y by noise; periods: that were averaged.
    """

    u: ComplexArray
    y: ComplexArray
    noise: FloatArray
    periods: int


def lines_of(record: PeriodicRecord) -> Lines | str:
    """Find the lines of a record, or say why not."""
    length = record.rate * record.period
    count = int(np.floor(record.y.size / length + 1e-6))
    periods = count - SETTLING
    if periods < FEWEST_PERIODS:
        return (
            f"{record.input}: {max(count, 0)} periods of {record.period:g} s, at least "
            f"{FEWEST_PERIODS + SETTLING} are needed"
        )
    start, n = round(SETTLING * length), round(periods * length)
    taken = (x[start : start + n] for x in (record.u, record.y))
    u, y = (_harmonics(2 / n * np.fft.rfft(x - np.mean(x)), periods) for x in taken)
    return Lines(u[0], *y, periods)


def _harmonics(y: ComplexArray, periods: int) -> tuple[ComplexArray, FloatArray]:
    """Each harmonic without the transient, and its noise variance. y: DFT of whole periods."""
    reach = max(REACH, int(np.ceil((ORDER + 3) / (2 * (periods - 1)))))
    harmonics = int((y.size - 1) / periods) - reach
    offset = np.arange(-reach * periods, reach * periods + 1)
    at = np.arange(harmonics + 1)[:, None] * periods + offset[offset % periods != 0]
    near = np.where(at >= 0, y[np.abs(at)], y[np.abs(at)].conj())
    x = offset[offset % periods != 0] / offset[-1]
    shape = np.polynomial.polynomial.polyvander(x, ORDER - 1)
    solve = np.linalg.pinv(shape)
    found = near @ solve.T
    variance = np.sum(np.abs(near - found @ shape.T) ** 2, axis=1) / (x.size - ORDER)
    middle = y[: (harmonics + 1) * periods : periods]
    return middle - found[:, 0], variance * (1 + np.sum(solve[0] ** 2))


def periodic_record_of(
    found: Identification, given: str | None = None, taken: str = "slip"
) -> PeriodicRecord | NoSweep:
    """Cut the multisine out of a recording whose trial file gives its period."""
    trial = found.recording.trial
    if trial is None or not isinstance(trial.excitation, Multisine):
        return NoSweep("the recording has no trial file with a multisine")
    parts = signals_of(found, given, taken)
    if isinstance(parts, NoSweep):
        return parts
    (u, y, _), names = parts
    return PeriodicRecord(u, y, found.base.rate, trial.excitation.period, *names[:2])
