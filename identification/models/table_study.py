"""A model of any input and output that were recorded in tables, and what it predicts.

runs = [read_run(path, "u", "theta") for path in paths]
study = table_study(runs, [read_run(path, "u", "theta") for path in others])
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from slipbench.identification.models.held_out import HeldOut, Rest, held_out
from slipbench.identification.models.output_error import OutputError, output_error
from slipbench.identification.response.repeated_runs import excited_band, repeated_response, repeats
from slipbench.identification.response.response import FrequencyResponse
from slipbench.protocol.errors import InputError
from slipbench.protocol.recording.channel import FloatArray
from slipbench.protocol.recording.role_map import TableRules
from slipbench.protocol.tables import read_table, samples

LARGEST = 1e30  # of a sample: sums of squares stay finite
FEWEST = 200  # samples in a run
FAR = 0.3  # share of an unseen input outside the band from which it is said
UNEVEN = 0.01  # of a sample period, that the time may be off


@dataclass(frozen=True)
class TableRun:
    """One file: u, y (n,) at `rate` Hz."""

    name: str
    u: FloatArray
    y: FloatArray
    rate: float


@dataclass(frozen=True)
class TableStudy:
    """Model, response and predictions.

    names      input, output; runs: that the model was fitted to, cut to the shortest
    response   None where the runs do not repeat one excitation
    noise      rms by which the output differs between runs that repeat one input; NaN else
    trained    the runs of the fit, predicted; unseen: the others
    beyond     shares of the power of each unseen input that lie outside the band
    """

    names: tuple[str, str]
    runs: tuple[TableRun, ...]
    band: tuple[float, float]
    found: OutputError
    response: FrequencyResponse | None
    noise: float
    trained: tuple[HeldOut, ...]
    unseen: tuple[HeldOut, ...]
    beyond: tuple[float, ...] = ()

    @property
    def words(self) -> tuple[str, ...]:
        """What has to be known before the model is used, a sentence each."""
        said = [
            f"The model holds from {self.band[0]:.2g} to {self.band[1]:.3g} Hz, which is what "
            "the runs excite, and from rest."
        ]
        error = self.found.fit.error
        if np.isfinite(self.noise) and error > 1.5 * self.noise / np.sqrt(len(self.runs)):
            said.append(
                f"It leaves {error:.3g} rms of the runs' mean, where {self.noise:.3g} is the noise "
                f"of one run: the residual is curvature or a higher order, not noise. The "
                "intervals count all of it as noise."
            )
        far = [
            f"{run.name} ({100 * share:.0f} %)"
            for run, share in zip(self.unseen, self.beyond, strict=False)
            if share > FAR
        ]
        if far:
            said.append(
                "Much of the input of these unseen runs lies outside that band, where the model is "
                f"a guess and its error no measure of it inside: {', '.join(far)}."
            )
        if self.response is None:
            said.append("No frequency response is given: the runs do not repeat one excitation.")
        return tuple(said)


def read_run(path: Path, input: str, output: str) -> TableRun:
    """Read two columns of a table.

    Raises InputError where they are not even samples, or hold what nothing measures.
    """
    table = read_table(path)
    u, y = (samples(table, column, "", TableRules()) for column in (input, output))
    for column, one in ((input, u), (output, y)):
        _check_magnitude(path, column, one.time, one.value)
    time, value = u.time, u.value
    if time.size != y.time.size or not np.array_equal(time, y.time):
        value, time = np.interp(y.time, u.time, u.value), y.time
    if time.size < FEWEST:
        raise InputError(
            f"{time.size} samples are too few for a model",
            where=str(path),
            expected=f"at least {FEWEST} samples of {input!r} and {output!r}",
            remedy="record a longer run",
        )
    step = (time[-1] - time[0]) / (time.size - 1)
    uneven = float(np.max(np.abs(time - time[0] - step * np.arange(time.size))))
    if not step > 0 or uneven > UNEVEN * step:
        even = time[0] + step * np.arange(time.size)
        if not step > 0 or uneven > 2 * step:
            raise InputError(
                "the samples are not evenly spaced in time",
                where=str(path),
                expected=f"one every {1e3 * step:.3g} ms",
                found=f"off by {1e3 * uneven:.3g} ms",
                remedy="resample the table at an even rate",
            )
        value, y_value = np.interp(even, time, value), np.interp(even, time, y.value)
        return TableRun(path.stem, value, y_value, 1 / step)
    return TableRun(path.stem, value, y.value, 1 / step)


def _check_magnitude(path: Path, column: str, time: FloatArray, value: FloatArray) -> None:
    at = int(np.argmax(np.abs(value))) if value.size else 0
    if value.size and not abs(value[at]) <= LARGEST:
        raise InputError(
            f"a value of column {column!r} is too large for a measurement",
            where=str(path),
            expected=f"at most {LARGEST:g}",
            found=f"{value[at]:g} at {time[at]:.6g} s",
            remedy="correct or remove the row in a copy of the table",
        )


def table_study(runs: list[TableRun], unseen: list[TableRun], names: tuple[str, str]) -> TableStudy:
    """Fit a model to runs and let it predict others. Raises InputError where they carry none."""
    rate = _one_rate([*runs, *unseen])
    n = min(run.u.size for run in runs)
    u, y = (np.stack([getattr(run, key)[:n] for run in runs]) for key in ("u", "y"))
    if not np.ptp(u) > 0 or not np.ptp(y) > 0:
        still = names[0] if not np.ptp(u) > 0 else names[1]
        raise InputError(
            f"{still!r} stands still in every run",
            where=", ".join(run.name for run in runs),
            expected="an excitation and a response",
            remedy="choose other columns or runs",
        )
    rest = Rest(float(np.mean(u[:, 0])), float(np.mean(y[:, 0])))
    band = excited_band(u, rate)
    found = output_error(u, y, rate, band, names)
    response, noise = None, float("nan")
    if repeats(u):
        longer = np.concatenate((u[0] - rest.u, np.full(n, u[0, -1] - rest.u)))
        tail = found.model.simulate(longer, rate)[n:]
        response = repeated_response(u - rest.u, y - rest.y, tail, rate, names)
        noise = float(np.sqrt(np.mean(np.var(y, axis=0, ddof=1))))
    trained, others = (
        tuple(held_out(found.model, run.name, run.u, run.y, rate, rest) for run in several)
        for several in (runs, unseen)
    )
    beyond = tuple(outside(run.u - rest.u, rate, band) for run in unseen)
    return TableStudy(names, tuple(runs), band, found, response, noise, trained, others, beyond)


def outside(u: FloatArray, rate: float, band: tuple[float, float]) -> float:
    """Share of the power of u, (n,) at `rate` Hz, that lies outside a band (Hz)."""
    f = np.fft.rfftfreq(u.size, 1 / rate)
    power = np.abs(np.fft.rfft(u)) ** 2 * np.where(f > 0, 2, 1)
    apart = (f < band[0] - f[1] / 2) | (f > band[1] + f[1] / 2)
    return float(np.sum(power[apart]) / max(np.sum(power), 1e-300))


def _one_rate(runs: list[TableRun]) -> float:
    rate = runs[0].rate
    for run in runs:
        if abs(run.rate / rate - 1) > 1e-3:
            raise InputError(
                "the runs have different rates",
                where=run.name,
                expected=f"{rate:.6g} Hz",
                found=f"{run.rate:.6g} Hz",
                remedy="resample them at one rate",
            )
    return rate
