"""Which model of the slip predicts held-out sweeps: linear, switched, scheduled.

Every model gets the echoed command and, where it switches, a measured signal; none of them the
slip. Errors in time: root mean square of the residual over that of the slip, a slow trend apart.
Errors in frequency: first three harmonics along the phase of the sweep, of prediction and of
measurement, by the same estimator, over the first harmonic. Ratios of errors carry intervals by a
bootstrap over segments of 1 s, the same segments for both models.

    rivals = rivals_from(steps, runs_of_steps)           # linear, by u', by torque rate, by twist
    rows = compare(rivals, sweeps)                       # tuple[Row, ...]
    rows[1].ratio, rows[1].interval
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from slipbench.identification.models.experiment import Experiment
from slipbench.identification.models.switched import SwitchedModel, simulate
from slipbench.identification.response.describing_function import DescribingFunction
from slipbench.identification.response.harmonics import harmonics
from slipbench.identification.response.swept_run import SweptRun, swept_run
from slipbench.identification.signals.samples import BoolArray
from slipbench.protocol.recording.channel import FloatArray

TREND = 5  # terms of the polynomial removed from a trial: speed drifts, the slip's level too
BLOCK = 1.0  # s; errors a block apart count as independent
DRAWS, SEED = 2000, 1
KNOWN = 0.5  # greatest band beside the first harmonic at which a line is compared

Prediction = Callable[[Experiment], FloatArray]


@dataclass(frozen=True)
class Rival:
    """A model that takes part: its name, what it predicts for a trial, its own parameters."""

    name: str
    predict: Prediction
    parameters: int


@dataclass(frozen=True)
class Row:
    """One model's errors on held-out trials.

    time        NRMSE over all trials, 1
    frequency   error of the first three harmonics over the first harmonic, 1; NaN without sweeps
    per_trial   NRMSE of each trial
    ratio       its `time` error over that of the first model of the table
    interval    95 %, bootstrapped
    """

    name: str
    parameters: int
    time: float
    frequency: float
    per_trial: tuple[float, ...]
    ratio: float
    interval: tuple[float, float]

    @property
    def better(self) -> bool:
        """Whether it is significantly better than the first model."""
        return self.interval[1] < 1


def rival(name: str, model: SwitchedModel, by: str = "command", lag: float | None = None) -> Rival:
    """Make a rival of a linear or switched model. by: the signal whose sign switches; lag: s."""
    both = model.opening != model.closing
    count = (6 if both else 3) + 2 * len(model.resonances) + 1

    def predict(run: Experiment) -> FloatArray:
        mode = run.mode(by) if both else np.zeros(run.u.size, dtype=np.int64)
        return simulate(model, run.u, mode, run.rate, lag)

    return Rival(name, predict, count)


def compare(rivals: Sequence[Rival], runs: Sequence[Experiment]) -> tuple[Row, ...]:
    """Let models predict trials that none was fitted on; the first model is the yardstick."""
    power = np.concatenate([_blocks(without_trend(run.y, run.part), run.rate) for run in runs])
    predicted = [[model.predict(run) for run in runs] for model in rivals]
    errors = [[left(run, y) for run, y in zip(runs, row, strict=True)] for row in predicted]
    blocks = [
        np.concatenate([_blocks(e, run.rate) for e, run in zip(row, runs, strict=True)])
        for row in errors
    ]
    measured = [_harmonics(run, run.y) for run in runs]
    return tuple(
        Row(
            model.name,
            model.parameters,
            float(np.sqrt(own.sum() / power.sum())),
            _in_frequency(measured, [_harmonics(run, y) for run, y in zip(runs, row, strict=True)]),
            tuple(nrmse(run, y) for run, y in zip(runs, row, strict=True)),
            float(np.sqrt(own.sum() / blocks[0].sum())),
            _interval(own, blocks[0]),
        )
        for model, own, row in zip(rivals, blocks, predicted, strict=True)
    )


def nrmse(run: Experiment, predicted: FloatArray) -> float:
    """Normalized root mean square error of a predicted slip, trends removed; dimensionless.

    predicted: slip, shape (n,), over the whole run.
    """
    e, y = left(run, predicted), without_trend(run.y, run.part)
    return float(np.sqrt(np.mean(e**2) / np.mean(y**2)))


def left(run: Experiment, predicted: FloatArray) -> FloatArray:
    """Residual of a prediction of the slip while the excitation lasts, (n,)."""
    return without_trend(run.y - predicted, run.part)


def without_trend(y: FloatArray, part: slice) -> FloatArray:
    """Remove a slow polynomial from y, shape (n,). Returns the samples of `part`, in the unit of y."""
    slow, _ = np.linalg.qr(np.vander(np.linspace(-1, 1, part.stop - part.start), TREND))
    return np.asarray(y[part] - slow @ (slow.T @ y[part]))


def _blocks(e: FloatArray, rate: float) -> FloatArray:
    """Sum of squares in each segment."""
    edges = np.arange(0, e.size, max(1, round(BLOCK * rate)))
    return np.asarray(np.add.reduceat(e**2, edges))


def _interval(own: FloatArray, other: FloatArray) -> tuple[float, float]:
    draw = np.random.default_rng(SEED).integers(0, own.size, (DRAWS, own.size))
    ratio = np.sqrt(own[draw].sum(axis=1) / other[draw].sum(axis=1))
    low, high = np.percentile(ratio, (2.5, 97.5))
    return float(low), float(high)


def _harmonics(run: Experiment, y: FloatArray) -> DescribingFunction | None:
    swept = swept_run(run.u[run.part], y[run.part], run.rate)
    if not isinstance(swept, SweptRun):
        return None
    found = harmonics([swept])
    return found if isinstance(found, DescribingFunction) else None


def _in_frequency(
    measured: Sequence[DescribingFunction | None], predicted: Sequence[DescribingFunction | None]
) -> float:
    """Root of the squared errors of all harmonics over the squared first harmonic, measured."""
    wrong = size = 0.0
    for have, modelled in zip(measured, predicted, strict=True):
        if have is not None and modelled is not None:
            known = _known(have)
            wrong += float(np.sum(np.abs(modelled.value - have.value)[:, known] ** 2))
            size += float(np.sum(have.gain[0, known] ** 2))
    return float(np.sqrt(wrong / size)) if size else float("nan")


def _known(found: DescribingFunction) -> BoolArray:
    return np.asarray(found.gain_band[0] <= KNOWN * found.gain[0])
