"""A fitted point: residuals, whitened sensitivities, and the score that compares hypotheses.

The score is the log-posterior under the noise model fitted to the residuals, so that hypotheses
with different noise can be compared.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from slipbench.identification.mismatch.fit.candidate import Candidate
from slipbench.identification.mismatch.fit.hypothesis import Hypothesis
from slipbench.identification.mismatch.fit.resolution import step_of
from slipbench.identification.mismatch.fit.sensitivity import change, coordinates_of
from slipbench.identification.mismatch.fit.stack import (
    Integers,
    Nuisances,
    clusters,
    log_likelihood,
    residuals,
    whiten_and_stack,
    whiteners,
)
from slipbench.identification.mismatch.fit.variance_inflation import (
    VarianceInflation,
    fit_variance_inflation,
)
from slipbench.identification.mismatch.fit.whitening import Whitener
from slipbench.identification.mismatch.simulation.model import Model, Point, Series, predict
from slipbench.identification.mismatch.simulation.once import once
from slipbench.plant.signals import Floats


@dataclass(frozen=True, eq=False)
class Fit:
    """A fitted point. slopes: sensitivities (T, m, p), unwhitened, possibly of a nearby point.

    slopes_at: coordinates of the system at that point; None: at this point. strengths: change of
    whitened residuals per unit of each effect parameter, where known from a nearby point
    (resolution.py).
    """

    model: Model
    point: Point
    predicted: Series
    noise: list[Whitener]
    slopes: Series
    candidates: tuple[Hypothesis, ...] = ()
    strengths: tuple[float, ...] = ()
    slopes_at: Floats | None = None

    @once
    def residuals(self) -> Series:
        """Residuals, (T, m) by output group and record, in the unit of each output."""
        return residuals(self.model, self.predicted)

    @once
    def whitened_residuals(self) -> Floats:
        """Whitened residuals, shape (rows,)."""
        return whiten_and_stack(self.model, self.noise, self.residuals)

    @once
    def whitened(self) -> Floats:
        """Whitened sensitivities at `slopes_at`, shape (rows, p)."""
        return whiten_and_stack(self.model, self.noise, self.slopes)

    @property
    def taken_at(self) -> Floats:
        """Coordinates of the system at which the sensitivities were taken, (n,)."""
        return self.point.x if self.slopes_at is None else self.slopes_at

    @property
    def slope_ratio(self) -> Floats:
        """Ratio of the sensitivities here to those at `slopes_at`, (p,).

        Sensitivities to values, not to their logarithms, are assumed to be equal at both points.
        """
        coordinates = zip(self.model.known, self.point.x, self.taken_at, strict=True)
        own = [k.slope(here) / k.slope(there) for k, here, there in coordinates]
        return np.concatenate((own, np.ones(sum(q.size for q in self.point.q))))

    @once
    def nuisances(self) -> Nuisances:
        """Whitened sensitivities at this point."""
        at_own_point = self.taken_at is self.point.x
        return Nuisances(self.whitened if at_own_point else self.whitened * self.slope_ratio)

    @once
    def clusters(self) -> Integers:
        """Index of the time segment of every whitened row, shape (rows,)."""
        return clusters(self.model)

    @once
    def variance_inflation(self) -> VarianceInflation:
        """Variance inflation by serial correlation, fitted to the system's own sensitivities."""
        columns = self.nuisances.columns[:, : max(len(self.point.x), 1)]
        residual = self.nuisances.project_out(self.whitened_residuals)[
            : len(self.whitened_residuals)
        ]
        return fit_variance_inflation(columns, residual, self.clusters)

    @once
    def score(self) -> float:
        """Log-posterior, nats."""
        likelihood = log_likelihood(self.model, self.residuals, self.noise)
        return likelihood - 0.5 * prior(self.point, self.candidates)

    @property
    def effects(self) -> tuple[Candidate, ...]:
        """Candidates that are effects of the library."""
        return tuple(c for c in self.candidates if isinstance(c, Candidate))

    @once
    def coarse(self) -> "Fit":
        """The same point simulated with coarse steps; whitened arrays are shared."""
        if self.model.coarse is self.model:
            return self
        model = self.model.coarse
        new = replace(self, model=model, predicted=predict(model, self.point))
        return with_effect_slopes_of(self, whitened_as(self, new))

    def fine(self, model: Model) -> "Fit":
        """Return the same point simulated with the steps of a model."""
        new = replace(self, model=model, predicted=predict(model, self.point))
        return with_effect_slopes_of(self, new)

    @once
    def effect_slopes(self) -> Series:
        """Sensitivities to the parameters of all effects, (T, m, parameters), unwhitened."""
        return _parameter_slopes(self)

    @once
    def effect_columns(self) -> Floats:
        """Whitened sensitivities to the parameters of all effects, shape (rows, parameters)."""
        return whiten_and_stack(self.model, self.noise, self.effect_slopes)


def renoised(fit: Fit) -> Fit:
    """Return the fit with the noise model fitted to its own residuals."""
    return with_effect_slopes_of(fit, replace(fit, noise=whiteners(fit.model, fit.residuals)))


def with_noise(fit: Fit, white: bool) -> Fit:
    """Return the fit with white noise, or with a fitted autoregression."""
    return renoised(with_effect_slopes_of(fit, replace(fit, model=fit.model.with_noise(white))))


def with_effects(fit: Fit, candidates: Sequence[Hypothesis]) -> Fit:
    """Return the fit with these effects added; nothing is fitted.

    Whitened sensitivities are shared with the given fit. Raises PlantError where it cannot be
    simulated.
    """
    point = replace(fit.point, effects=tuple(c.effect() for c in candidates))
    predicted = predict(fit.model, point)
    new = replace(fit, point=point, predicted=predicted, candidates=tuple(candidates), strengths=())
    return whitened_as(fit, new)


def whitened_as(fit: Fit, new: Fit) -> Fit:
    """Return `new` with the whitened arrays of `fit`, which has the same slopes and noise."""
    new.__dict__["whitened"] = fit.whitened
    if new.point.x is fit.point.x:
        new.__dict__["nuisances"] = fit.nuisances
    return new


def with_effect_slopes_of(fit: Fit, new: Fit) -> Fit:
    """Return `new`, of the same point and effects, with the sensitivities to them, if known."""
    if "effect_slopes" in fit.__dict__:
        new.__dict__["effect_slopes"] = fit.effect_slopes
    return new


def _parameter_slopes(fit: Fit) -> Series:
    """Sensitivities to the effect parameters, (T, m, parameters), unwhitened."""
    model = fit.model.coarse
    base = fit.predicted if model is fit.model else predict(model, fit.point)
    total = sum(len(c.parameters) for c in fit.candidates)
    columns = [[np.zeros((*m.shape, total)) for m in ms] for ms in fit.model.measured]
    column = 0
    for i, candidate in enumerate(fit.candidates):
        responses = candidate.responses
        for d in range(len(candidate.parameters)):
            if responses is not None:
                _put_known(columns, responses, model, d, column)
                column += 1
                continue
            strength = fit.strengths[column] if fit.strengths else 0.0
            for stepped, factor in _difference_step(fit, candidate, d, strength):
                effects = (*fit.point.effects[:i], stepped.effect(), *fit.point.effects[i + 1 :])
                series = change(model, fit.point, effects, base)
                for target, changed in zip(columns, series, strict=True):
                    for r, one in enumerate(changed):
                        if one.size:
                            target[r][:, :, column] += factor * one
            column += 1
    return columns


def _difference_step(
    fit: Fit, candidate: Hypothesis, parameter: int, strength: float
) -> list[tuple[Hypothesis, float]]:
    """Return the candidate with one parameter stepped, and the weight of each change in the slope.

    Effects use central differences, because a one-sided difference is the slope half a step away.
    Sizes determined from the recordings, and hypotheses that are no effects of the library, keep
    their own step and a one-sided difference.
    """
    default, unit = (
        candidate.difference_steps[parameter],
        np.eye(len(candidate.parameters))[parameter],
    )
    fitted = isinstance(candidate, Candidate) and not candidate.fixed_from_data
    step = step_of(default, strength) if fitted or fit.model.system.smooth else default
    forward = candidate.moved(step * unit)
    if not fitted:
        return [(forward, 1.0 / step)]
    backward = candidate.moved(-step * unit)
    span = forward.parameters[parameter] - backward.parameters[parameter]
    return [(forward, 1.0 / span), (backward, -1.0 / span)] if span else []


def _put_known(
    target: Series, responses: Series, model: Model, parameter: int, column: int
) -> None:
    for columns, of_group, counts in zip(target, responses, model.known_bins, strict=True):
        for r, one in enumerate(of_group):
            if one.size:
                columns[r][:, :, column] = one[:, :, parameter] * counts[r]


def parameters(now: Sequence[Hypothesis]) -> Floats:
    """Parameters of all candidates, concatenated, shape (parameters,)."""
    return np.concatenate([c.parameters for c in now]) if now else np.zeros(0)


def deviations(now: Sequence[Hypothesis]) -> Floats:
    """Prior deviation of each of them, shape (parameters,)."""
    return np.concatenate([c.deviations for c in now])


def prior(point: Point, now: Sequence[Hypothesis]) -> float:
    """Return twice the negative log-prior of a point, nats, up to a constant."""
    z = coordinates_of(point)
    return float(z @ z) + (float(np.sum((parameters(now) / deviations(now)) ** 2)) if now else 0.0)
