"""Prove it on recordings that took no part in the fit."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from slipbench.identification.mismatch.fit.crank_phase import scanned
from slipbench.identification.mismatch.fit.fitting import Fit, renoised
from slipbench.identification.mismatch.fit.floor import floors
from slipbench.identification.mismatch.fit.following import refit_with_updated_jacobian
from slipbench.identification.mismatch.fit.optimize import at_fixed_noise, optimize
from slipbench.identification.mismatch.fit.sensitivity import change, sensitivities
from slipbench.identification.mismatch.fit.stack import whiten_and_stack
from slipbench.identification.mismatch.simulation.model import Model, Point, predict
from slipbench.identification.mismatch.simulation.system import System
from slipbench.plant.effects.effect import Effect
from slipbench.plant.errors import PlantError
from slipbench.plant.signals import Floats

DRAWS = 2000
CONFIRMED = 5.0
"""Nats that held-out recordings must gain from what they would show plainly."""
LARGE = 5.0
"""Times its floor beyond which an error is large. Innovations leave out what follows from the errors
before: of motorcycles of which nothing is missing, errors are up to 2.7 times such a floor."""


@dataclass(frozen=True)
class Error:
    """Root mean square error of one output, SI.

    floor: what no model of the commands can explain; floor_from: what tells it (see floor.py).
    interval: 95 %, of improved over nominal, from drawing stretches of time again.
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
        """Whether it is far above its floor with all that was accepted."""
        return self.improved > LARGE * self.floor


@lru_cache(maxsize=4)
def refit_on(fit: Fit, model: Model) -> Fit:
    """Let a fitted system meet other recordings; everything uncertain may move again."""
    begun = replace(model.origin(), x=fit.point.x, effects=fit.point.effects)
    system = fit.model.at(fit.point)
    if system.turns_unseen():
        begun = replace(begun, q=_begun(system, model, fit).point.q)
    there = refit_with_updated_jacobian(optimize(_there(fit, begun, model)))
    return replace(there, candidates=fit.candidates)


def _begun(system: System, model: Model, noise_of: Fit) -> Fit:
    """Return an unchanged system beside recordings, begun at the angles that suit them best.

    First nothing goes with the angle, until the speed is that of the recordings.
    """
    silent = _unchanged(system.silenced(), model)
    met = renoised(at_fixed_noise(_there(noise_of, silent.origin(), silent))).point
    fixed = _unchanged(system, model)
    return scanned(_there(noise_of, replace(met, effects=fixed.origin().effects), fixed))


def _unchanged(system: System, model: Model) -> Model:
    """Return the model of one system in which only the slow unknown and clocks are estimated."""
    clocks = [k for k in model.known if k.of_clock]
    return Model(system, model.records, model.partition, clocks, model.injected)


def _there(fit: Fit, point: Point, model: Model) -> Fit:
    return Fit(model, point, predict(model, point), fit.noise, sensitivities(model, point))


@dataclass(frozen=True)
class Veto:
    """What held-out recordings contradict: an effect or a free curve. gain, least: nats.

    gain: held-out log-likelihood gain, at its best; least: what it would have gained if it were
    right; reason: the same as a sentence.
    """

    name: str
    gain: float
    least: float
    reason: str = ""


def veto(name: str, gain: float, least: float) -> Veto:
    """Say why held-out recordings contradict what these names stand for."""
    reason = (
        f"the held-out log-likelihood changes by {gain:.0f} nats, and would rise by at least"
        f" {least:.0f} nats if it were right"
    )
    return Veto(name, gain, least, reason)


def contradicted(before: Fit, after: Fit, model: Model) -> Veto | None:
    """Return the veto of held-out recordings against what `after` has more than `before`.

    They speak against it where they would show it, if it were right, but gain less than chance may
    take from it. None: they do not.
    """
    known = {e.key for e in before.point.effects}
    name = " + ".join(e.key for e in after.point.effects if e.key not in known)
    bare = refit_on(before, model)
    try:
        there = refit_on(after, model)
    except PlantError as fault:
        return Veto(name, -math.inf, CONFIRMED, f"they cannot be simulated with it: {fault}")
    least = _asked(bare, there)
    best = there.score
    if best < bare.score + least:
        best = max(best, _added(bare, there.point.effects).score)
    if best >= bare.score + least:
        return None
    return veto(name, best - bare.score, least)


def _asked(bare: Fit, there: Fit) -> float:
    """Return the nats that what `there` has more than `bare` must bring on its recordings.

    As much as it would show there if it were right, less what chance may take. Where nothing can be
    simulated without it, it would show plainly.
    """
    model, without = there.model, replace(there.point, effects=bare.point.effects)
    try:
        trace = change(model, without, there.point.effects, predict(model, without))
    except PlantError:
        return CONFIRMED
    course = there.nuisances.project_out(whiten_and_stack(model, there.noise, trace))
    worth = 0.5 * float(course @ course)
    chance = 2.0 * math.sqrt(2.0 * worth)  # 2 sigma of what a right effect of that worth gains
    return min(CONFIRMED, worth - chance)


def _added(bare: Fit, effects: tuple[Effect, ...]) -> Fit:
    """Let effects act where a fit stands without them: the other way may have ended farther off."""
    point = replace(bare.point, effects=effects)
    return optimize(replace(bare, point=point, predicted=predict(bare.model, point), candidates=()))


def simulated_only(model: Model, system: System, noise_of: Fit) -> Fit:
    """Let one system, unchanged, meet recordings; the slow unknown and clocks are estimated."""
    if system.turns_unseen():
        begun = _begun(system, model, noise_of)
        return refit_with_updated_jacobian(_there(noise_of, begun.point, begun.model))
    fixed = _unchanged(system, model)
    return renoised(at_fixed_noise(_there(noise_of, fixed.origin(), fixed)))


def predicted_gain(model: Model, base: Fit, fit: Fit, improved: Model) -> float:
    """Return the nats that a fit gains over a base on recordings, both with unchanged parameters.

    improved: the held-out model in which what was found acts.
    """
    before = simulated_only(model, base.model.at(base.point), fit)
    return simulated_only(improved, fit.model.at(fit.point), fit).score - before.score


def mispredicted(model: Model, base: Fit, fit: Fit, most: float) -> Veto | None:
    """Return the veto against effects with which a simulation predicts recordings worse; None: not.

    most: nats that they may lose. All parameters stay as they are in both.
    """
    name = " + ".join(e.key for e in fit.point.effects if e not in base.point.effects)
    try:
        gain = predicted_gain(model, base, fit, model)
    except PlantError as fault:
        return Veto(name, -math.inf, -most, f"they cannot be simulated with it: {fault}")
    reason = (
        "with the parameters of the training recordings the held-out log-likelihood falls by"
        f" {-gain:.0f} nats"
    )
    return Veto(name, gain, -most, reason) if gain < -most else None


def proof(model: Model, base: Fit, fit: Fit, improved: Model | None = None) -> list[Fit]:
    """Held-out runs of the file's system, of it re-calibrated, and of it with what was found.

    improved: the held-out model in which what was found acts, where that is more than its system.
    """
    return [
        simulated_only(model, model.system, fit),
        simulated_only(model, base.model.at(base.point), fit),
        simulated_only(improved or model, fit.model.at(fit.point), fit),
    ]


def errors(runs: list[Fit]) -> list[Error]:
    """Errors of the three systems of a proof, output by output."""
    return [e for b in range(len(runs[0].model.partition.groups)) for e in _errors(runs, b)]


def _errors(runs: list[Fit], b: int) -> Iterator[Error]:
    least, told_by = floors(runs[-1], b)
    for j, output in enumerate(runs[0].model.partition.groups[b].outputs):
        squares = [_squares(run, b, j) for run in runs]
        nominal, calibrated, improved = (float(np.sqrt(np.mean(s))) for s in squares)
        unit = runs[0].model.records[0].sensors[output].unit
        interval = _ratio(squares[0], squares[2])
        floor = float(least[j])
        yield Error(output, unit, nominal, calibrated, improved, floor, told_by, interval)


def _squares(run: Fit, b: int, j: int) -> Floats:
    """Mean square error of every stretch of time."""
    found = []
    for r, rest in enumerate(run.residuals[b]):
        parts = np.array_split(rest[:, j], run.model.records[r].grid.stretches)
        found += [float(np.mean(part**2)) for part in parts]
    return np.array(found)


def _ratio(nominal: Floats, improved: Floats) -> tuple[float, float]:
    rng = np.random.default_rng(1)
    drawn = rng.integers(0, nominal.size, (DRAWS, nominal.size))
    ratio = np.sqrt(improved[drawn].mean(axis=1) / np.maximum(nominal[drawn].mean(axis=1), 1e-300))
    low, high = np.quantile(ratio, (0.025, 0.975))
    return float(low), float(high)
