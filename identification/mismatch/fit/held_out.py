"""Validation on held-out recordings."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from slipbench.identification.mismatch.fit.crank_phase import scanned
from slipbench.identification.mismatch.fit.fitting import Fit, renoised
from slipbench.identification.mismatch.fit.floor import floors
from slipbench.identification.mismatch.fit.optimize import at_fixed_noise, optimize
from slipbench.identification.mismatch.fit.predictive import predictive
from slipbench.identification.mismatch.fit.refit import refit_with_updated_jacobian
from slipbench.identification.mismatch.fit.sensitivity import change, sensitivities
from slipbench.identification.mismatch.fit.stack import whiten_and_stack
from slipbench.identification.mismatch.simulation.kept import last_results
from slipbench.identification.mismatch.simulation.model import Model, Point, predict
from slipbench.identification.mismatch.simulation.system import System
from slipbench.identification.mismatch.thresholds import CONFIRMED, LARGE_ERROR
from slipbench.plant.effects.effect import Effect
from slipbench.plant.errors import PlantError
from slipbench.plant.signals import Floats

DRAWS = 2000


@dataclass(frozen=True)
class Error:
    """Root mean square error of one output, SI.

    floor: error that no model of the commands can explain; floor_from: source of the floor (see
    floor.py). interval: 95 % bootstrap interval of improved over nominal, by resampling time
    segments.
    """

    output: str
    unit: str
    nominal: float
    calibrated: float
    improved: float
    floor: float
    floor_from: str
    interval: tuple[float, float]

    @property
    def large(self) -> bool:
        """Whether the error with all accepted effects is far above its floor."""
        return self.improved > LARGE_ERROR * self.floor


@last_results(4)
def refit_on(fit: Fit, model: Model) -> Fit:
    """Refit a fitted system on other recordings; all uncertain parameters are free again."""
    start = replace(model.origin(), x=fit.point.x, effects=fit.point.effects)
    system = fit.model.at(fit.point)
    if system.turns_unseen():
        start = replace(start, q=_at_start_angles(system, model, fit).point.q)
    refitted = refit_with_updated_jacobian(optimize(_fit_at(fit, start, model)))
    return replace(refitted, candidates=fit.candidates)


def _at_start_angles(system: System, model: Model, noise_source: Fit) -> Fit:
    """Return an unchanged system on recordings, started at the crank phases that fit best.

    The speed is fitted first, without the effects that depend on the crank phase.
    """
    silent = _with_fixed_parameters(system.without_unseen_turns(), model)
    silent_point = renoised(at_fixed_noise(_fit_at(noise_source, silent.origin(), silent))).point
    fixed = _with_fixed_parameters(system, model)
    return scanned(
        _fit_at(noise_source, replace(silent_point, effects=fixed.origin().effects), fixed)
    )


def _with_fixed_parameters(system: System, model: Model) -> Model:
    """Return the model of a system with only slow disturbance and clocks estimated."""
    clocks = [k for k in model.known if k.of_clock]
    return Model(system, model.records, model.partition, clocks, model.injected, white=model.white)


def _fit_at(fit: Fit, point: Point, model: Model) -> Fit:
    return Fit(model, point, predict(model, point), fit.noise, sensitivities(model, point))


@dataclass(frozen=True)
class Veto:
    """An effect or curve contradicted by held-out recordings. gain, least: nats.

    gain: largest held-out log-likelihood gain. least: gain required if the effect were right.
    reason: the same as a sentence.
    """

    name: str
    gain: float
    least: float
    reason: str = ""


def veto(name: str, gain: float, least: float) -> Veto:
    """Return a veto with its reason. gain, least: nats, see `Veto`; -inf: no simulation."""
    if gain == -math.inf:
        return Veto(name, gain, least, "they cannot be simulated with it")
    reason = (
        f"the held-out log-likelihood changes by {gain:.0f} nats, and would rise by at least"
        f" {least:.0f} nats if it were right"
    )
    return Veto(name, gain, least, reason)


def contradicted(before: Fit, after: Fit, model: Model) -> Veto | None:
    """Return the veto of held-out recordings against the effects that only `after` has, or None.

    They contradict the effects if the gain is below the one expected of correct effects, less two
    standard deviations.
    """
    known = {e.key for e in before.point.effects}
    name = " + ".join(e.key for e in after.point.effects if e.key not in known)
    reference = refit_on(before, model)
    try:
        refitted = refit_on(after, model)
    except PlantError as fault:
        return Veto(name, -math.inf, CONFIRMED, f"they cannot be simulated with it: {fault}")
    least = _required_gain(reference, refitted)
    best = refitted.score
    if best < reference.score + least:
        best = max(best, _with_effects(reference, refitted.point.effects).score)
    if best >= reference.score + least:
        return None
    return veto(name, best - reference.score, least)


def _required_gain(reference: Fit, refitted: Fit) -> float:
    """Return the gain required of the effects of a fit on its recordings, nats.

    This is the gain expected if they were right, less two standard deviations. If nothing can be
    simulated without the effects, their response counts as strong.
    """
    model, without = refitted.model, replace(refitted.point, effects=reference.point.effects)
    try:
        trace = change(model, without, refitted.point.effects, predict(model, without))
    except PlantError:
        return CONFIRMED
    response = refitted.nuisances.project_out(whiten_and_stack(model, refitted.noise, trace))
    expected = 0.5 * float(response @ response)
    chance = 2.0 * math.sqrt(2.0 * expected)  # 2 sigma of the gain of a correct effect
    return min(CONFIRMED, expected - chance)


def _with_effects(reference: Fit, effects: tuple[Effect, ...]) -> Fit:
    """Return the fit started from the fit without effects: the other start may end farther off."""
    point = replace(reference.point, effects=effects)
    return optimize(
        replace(reference, point=point, predicted=predict(reference.model, point), candidates=())
    )


def simulated_only(model: Model, system: System, noise_source: Fit) -> Fit:
    """Simulate an unchanged system; only slow disturbance and clocks are estimated."""
    if system.turns_unseen():
        start = _at_start_angles(system, model, noise_source)
        return refit_with_updated_jacobian(_fit_at(noise_source, start.point, start.model))
    fixed = _with_fixed_parameters(system, model)
    return renoised(at_fixed_noise(_fit_at(noise_source, fixed.origin(), fixed)))


@last_results(2)
def predicted_gain(model: Model, base: Fit, fit: Fit, improved: Model) -> float:
    """Return the held-out gain of a fit over a base, nats; see predictive.py.

    improved: the held-out model in which the identified effects act.
    """
    before, after = _simulations(model, base, fit, improved)
    return predictive(fit, after, improved) - predictive(base, before, model)


def error_ratio(model: Model, base: Fit, fit: Fit, improved: Model) -> float:
    """Return the held-out error of a fit over that of a base, of the output where it is largest.

    Both have unchanged parameters; improved: as for `predicted_gain`. Outputs that are not recorded
    there do not count.
    """
    before, after = _simulations(model, base, fit, improved)
    squares = (
        [float(np.mean(_segment_squares(run, b, j))) for run in (before, after)]
        for b, group in enumerate(model.partition.groups)
        for j in range(len(group.outputs))
    )
    return max((math.sqrt(two / one) for one, two in squares if one > 0.0), default=1.0)


@last_results(2)
def _simulations(model: Model, base: Fit, fit: Fit, improved: Model) -> tuple[Fit, Fit]:
    return (
        simulated_only(model, base.model.at(base.point), fit),
        simulated_only(improved, fit.model.at(fit.point), fit),
    )


def mispredicted(model: Model, base: Fit, fit: Fit, most: float) -> Veto | None:
    """Return the veto against effects that worsen the prediction of recordings, or None.

    most: largest acceptable loss, nats. Parameters keep their posterior of the training recordings.
    """
    name = " + ".join(e.key for e in fit.point.effects if e not in base.point.effects)
    try:
        gain = predicted_gain(model, base, fit, model)
    except PlantError as fault:
        return Veto(name, -math.inf, -most, f"they cannot be simulated with it: {fault}")
    reason = (
        "with the parameters of the training recordings, within their uncertainty, the held-out"
        f" log-likelihood falls by {-gain:.0f} nats"
    )
    return Veto(name, gain, -most, reason) if gain < -most else None


@last_results(1)
def held_out_simulations(
    model: Model, base: Fit, fit: Fit, improved: Model | None = None
) -> list[Fit]:
    """Held-out simulations of the file's system, the calibrated one, and that with all effects.

    improved: the held-out model in which the identified effects act, where it is more than the
    system.
    """
    return [
        simulated_only(model, model.system, fit),
        simulated_only(model, base.model.at(base.point), fit),
        simulated_only(improved or model, fit.model.at(fit.point), fit),
    ]


def errors(runs: list[Fit]) -> list[Error]:
    """Errors of the three held-out simulations, for each output."""
    return [e for b in range(len(runs[0].model.partition.groups)) for e in _errors(runs, b)]


def _errors(runs: list[Fit], b: int) -> Iterator[Error]:
    floor_values, source = floors(runs[-1], b)
    for j, output in enumerate(runs[0].model.partition.groups[b].outputs):
        squares = [_segment_squares(run, b, j) for run in runs]
        nominal, calibrated, improved = (float(np.sqrt(np.mean(s))) for s in squares)
        unit = runs[0].model.records[0].sensors[output].unit
        interval = _ratio_interval(squares[0], squares[2])
        floor = float(floor_values[j])
        yield Error(output, unit, nominal, calibrated, improved, floor, source, interval)


def _segment_squares(run: Fit, b: int, j: int) -> Floats:
    """Mean square error of every time segment."""
    squares = []
    for r, residual in enumerate(run.residuals[b]):
        parts = np.array_split(residual[:, j], run.model.records[r].grid.stretches)
        squares += [float(np.mean(part**2)) for part in parts]
    return np.array(squares)


def _ratio_interval(nominal: Floats, improved: Floats) -> tuple[float, float]:
    rng = np.random.default_rng(1)
    resampled = rng.integers(0, nominal.size, (DRAWS, nominal.size))
    ratio = np.sqrt(
        improved[resampled].mean(axis=1) / np.maximum(nominal[resampled].mean(axis=1), 1e-300)
    )
    low, high = np.quantile(ratio, (0.025, 0.975))
    return float(low), float(high)
