"""Switched and linear model, fitted to steps and validated on held-out sweeps.

study = switched_study([identify(read(steps))], [identify(read(sweep)) for sweep in sweeps])
study.rows                     # linear, by u', by torque rate, by twist, scheduled
claims = switched_claims(study)                      # studies/paper/switched_claims.py
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from slipbench.identification.models.experiment import Experiment, NoExperiment, experiment_of
from slipbench.identification.models.model_comparison import Rival, Row, compare, rival
from slipbench.identification.models.scheduled import ScheduledFit
from slipbench.identification.models.steps import NoSteps, Steps, mean_levels, pooled, steps_of
from slipbench.identification.models.switched import IntArray, mode_of, simulate
from slipbench.identification.models.switched_fit import SwitchedFit, fit_by, fit_steps
from slipbench.identification.response.identify import Identification
from slipbench.protocol.recording.channel import FloatArray

RESTING = 0.02  # of a mean signal: less has no sign
# Signals by which a model may switch, and s by which each may act late; twist is the slip's own.
OTHERS = {"torque rate": (0.0, 0.005, 0.010, 0.015), "twist": (0.0,)}


@dataclass(frozen=True)
class SwitchedStudy:
    """Comparison of switched and linear models.

    switched, linear  fitted on the steps, with as many resonances; held_out: trials not fitted on
    rivals            the models in the order of `rows`, the linear one first, the one by u' second
    """

    steps: Steps
    switched: SwitchedFit
    linear: SwitchedFit
    held_out: tuple[Experiment, ...]
    rivals: tuple[Rival, ...]
    rows: tuple[Row, ...]


def switched_study(
    steps: Sequence[Identification],
    sweeps: Sequence[Identification],
    scheduled: ScheduledFit | None = None,
) -> SwitchedStudy | NoSteps:
    """Study: fit on step trials, validation on held-out sweeps. scheduled: model of other trials."""
    cut = [steps_of(found) for found in steps]
    for part in cut:
        if isinstance(part, NoSteps):
            return part
    runs = [experiment_of(found) for found in (*steps, *sweeps)]
    for run in runs:
        if isinstance(run, NoExperiment):
            return NoSteps(run.reason)
    whole = [run for run in runs if isinstance(run, Experiment)]
    parts = [part for part in cut if isinstance(part, Steps)]
    if not parts or not sweeps:
        return NoSteps(f"{len(parts)} step trials and {len(sweeps)} sweeps, one of each is needed")
    return study_of(pooled(parts), whole[: len(parts)], whole[len(parts) :], scheduled)


def study_of(
    steps: Steps,
    runs: Sequence[Experiment],
    held_out: Sequence[Experiment],
    scheduled: ScheduledFit | None = None,
) -> SwitchedStudy:
    """The same study from steps that are cut and prepared trials. runs: the step trials."""
    switched = fit_steps(steps)
    linear = fit_steps(steps, len(switched.model.resonances), split=False)
    rivals = [rival("linear", linear.model), rival("switched by u'", switched.model)]
    recorded = [name for name in OTHERS if all(name in run.signal for run in (*runs, *held_out))]
    rivals += [_by(name, steps, runs[0], switched) for name in recorded]
    if scheduled is not None:
        rivals.append(scheduled_rival(scheduled))
    rows = compare(rivals, held_out)
    return SwitchedStudy(steps, switched, linear, tuple(held_out), tuple(rivals), rows)


def scheduled_rival(fit: ScheduledFit) -> Rival:
    """The linear model at each trial's own speed."""

    def predict(run: Experiment) -> FloatArray:
        return simulate(fit.at(run.speed), run.u, np.zeros(run.u.size, dtype=np.int64), run.rate)

    return Rival("scheduled by speed", predict, fit.coefficient.size)


def _by(name: str, steps: Steps, run: Experiment, first: SwitchedFit) -> Rival:
    """Model switched by a measured signal, with the lag that fits the steps best."""
    modes = _modes(name, steps, run)
    fits = [(lag, fit_by(steps, first, modes, lag)) for lag in OTHERS[name]]
    lag, best = min(fits, key=lambda pair: pair[1].error)
    return rival(f"switched by {name}", best.model, name, lag)


def _modes(name: str, steps: Steps, run: Experiment) -> IntArray:
    """Mode during the mean opening and the mean closing step, (2, n)."""
    part = run.part
    means = mean_levels(run.u[part], run.signal[name][part], run.rate, steps)
    moving = [np.abs(mean) > RESTING * np.abs(mean).max() for mean in means]
    return np.stack([mode_of(np.where(on, m, 0.0)) for on, m in zip(moving, means, strict=True)])
