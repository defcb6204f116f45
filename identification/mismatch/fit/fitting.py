"""A fitted point: residuals, whitened sensitivities, and the score by which hypotheses compare.

The score is the log-posterior with the noise model that fits it, so that hypotheses with different
noise can be compared.
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
    """A fitted point. slopes: sensitivities (T, m, p), unwhitened, perhaps of a point nearby.

    slopes_at: coordinates of the system at that point; None: here.
    strengths: of the dials, where known from a point nearby (resolution.py).
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
        """Residuals of this point."""
        return residuals(self.model, self.predicted)

    @once
    def whitened_residuals(self) -> Floats:
        """Whitened residuals."""
        return whiten_and_stack(self.model, self.noise, self.residuals)

    @once
    def whitened(self) -> Floats:
        """Whitened sensitivities at `slopes_at`, (rows, p)."""
        return whiten_and_stack(self.model, self.noise, self.slopes)

    @property
    def taken_at(self) -> Floats:
        """Coordinates of the system at which the sensitivities were taken."""
        return self.point.x if self.slopes_at is None else self.slopes_at

    @property
    def slope_ratio(self) -> Floats:
        """Ratio of the sensitivities here to those at `slopes_at`, (p,).

        Sensitivities to values, not to their logarithms, are assumed to be equal at both points.
        """
        both = zip(self.model.known, self.point.x, self.taken_at, strict=True)
        own = [k.slope(here) / k.slope(there) for k, here, there in both]
        return np.concatenate((own, np.ones(sum(q.size for q in self.point.q))))

    @once
    def nuisances(self) -> Nuisances:
        """Whitened sensitivities."""
        there = self.taken_at is self.point.x
        return Nuisances(self.whitened if there else self.whitened * self.slope_ratio)

    @once
    def clusters(self) -> Integers:
        """Number of the stretch of time of every whitened row."""
        return clusters(self.model)

    @once
    def variance_inflation(self) -> VarianceInflation:
        """How errors hang together, told by the system's own sensitivities."""
        own = self.nuisances.columns[:, : max(len(self.point.x), 1)]
        left = self.nuisances.project_out(self.whitened_residuals)[: len(self.whitened_residuals)]
        return fit_variance_inflation(own, left, self.clusters)

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
        """The same point simulated with coarse steps; what is whitened is shared."""
        if self.model.coarse is self.model:
            return self
        model = self.model.coarse
        new = replace(self, model=model, predicted=predict(model, self.point))
        return whitened_as(self, new)

    def fine(self, model: Model) -> "Fit":
        """Return the same point simulated with the steps of a model."""
        return replace(self, model=model, predicted=predict(model, self.point))

    @once
    def effect_columns(self) -> Floats:
        """Whitened sensitivities to the dials of all effects, (rows, dials)."""
        return whiten_and_stack(self.model, self.noise, _parameter_columns(self))


def renoised(fit: Fit) -> Fit:
    """Return the fit with the noise model that its own residuals give."""
    return replace(fit, noise=whiteners(fit.model, fit.residuals))


def with_effects(fit: Fit, candidates: Sequence[Hypothesis]) -> Fit:
    """Return the fit with these effects turned on; nothing is fitted yet.

    Whitened sensitivities are shared with the given fit. Raises PlantError where it cannot run.
    """
    point = replace(fit.point, effects=tuple(c.effect() for c in candidates))
    predicted = predict(fit.model, point)
    new = replace(fit, point=point, predicted=predicted, candidates=tuple(candidates), strengths=())
    return whitened_as(fit, new)


def whitened_as(fit: Fit, new: Fit) -> Fit:
    """Return a fit that shares what is whitened with another of the same slopes and noise."""
    new.__dict__["whitened"] = fit.whitened
    if new.point.x is fit.point.x:
        new.__dict__["nuisances"] = fit.nuisances
    return new


def _parameter_columns(fit: Fit) -> Series:
    """Sensitivities (T, m, dials), unwhitened."""
    model = fit.model.coarse
    base = fit.predicted if model is fit.model else predict(model, fit.point)
    total = sum(len(c.parameters) for c in fit.candidates)
    found = [[np.zeros((*m.shape, total)) for m in ms] for ms in fit.model.measured]
    column = 0
    for i, candidate in enumerate(fit.candidates):
        known = candidate.responses
        for d in range(len(candidate.parameters)):
            if known is not None:
                _put_known(found, known, model, d, column)
                column += 1
                continue
            strength = fit.strengths[column] if fit.strengths else 0.0
            for there, share in _difference_step(fit, candidate, d, strength):
                effects = (*fit.point.effects[:i], there.effect(), *fit.point.effects[i + 1 :])
                series = change(model, fit.point, effects, base)
                for into, changed in zip(found, series, strict=True):
                    for r, one in enumerate(changed):
                        if one.size:
                            into[r][:, :, column] += share * one
            column += 1
    return found


def _difference_step(
    fit: Fit, candidate: Hypothesis, parameter: int, strength: float
) -> list[tuple[Hypothesis, float]]:
    """Return the candidate with one dial nudged, and the share of each change in the slope.

    An effect is nudged to both sides: a difference to one side is the slope half a nudge away. What is
    read off the recordings, and what is no effect of the library, keeps its own nudge.
    """
    usual, way = candidate.difference_steps[parameter], np.eye(len(candidate.parameters))[parameter]
    fitted = isinstance(candidate, Candidate) and not candidate.fixed_from_data
    nudge = step_of(usual, strength) if fitted or fit.model.system.smooth else usual
    there = candidate.moved(nudge * way)
    if not fitted:
        return [(there, 1.0 / nudge)]
    back = candidate.moved(-nudge * way)
    span = there.parameters[parameter] - back.parameters[parameter]
    return [(there, 1.0 / span), (back, -1.0 / span)] if span else []


def _put_known(into: Series, known: Series, model: Model, parameter: int, column: int) -> None:
    for found, answered, counts in zip(into, known, model.known_bins, strict=True):
        for r, one in enumerate(answered):
            if one.size:
                found[r][:, :, column] = one[:, :, parameter] * counts[r]


def parameters(now: Sequence[Hypothesis]) -> Floats:
    """Dials of all candidates, end to end."""
    return np.concatenate([c.parameters for c in now]) if now else np.zeros(0)


def deviations(now: Sequence[Hypothesis]) -> Floats:
    """Prior deviation of each of them."""
    return np.concatenate([c.deviations for c in now])


def prior(point: Point, now: Sequence[Hypothesis]) -> float:
    """What is believed beforehand against a point: twice the nats, up to a constant."""
    z = coordinates_of(point)
    return float(z @ z) + (float(np.sum((parameters(now) / deviations(now)) ** 2)) if now else 0.0)
