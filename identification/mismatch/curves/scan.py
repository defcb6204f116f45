"""Screening: every curve fitted at every injection point to the residuals of the training set."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy import linalg

from slipbench.identification.mismatch.curves.injection import places
from slipbench.identification.mismatch.curves.tooth_curve import discs, tooth_columns
from slipbench.identification.mismatch.curves.trace import (
    RecordRegressors,
    concatenated_bins,
    sensors_as_places,
    simulated_responses,
)
from slipbench.identification.mismatch.curves.whitened import WhitenedResponses
from slipbench.identification.mismatch.fit.linearization import Linearization
from slipbench.identification.mismatch.fit.stack import LARGEST, Integers, whiten_and_stack
from slipbench.identification.mismatch.simulation.injection_point import InjectionPoint
from slipbench.identification.mismatch.simulation.model import Series
from slipbench.identification.mismatch.simulation.regressor import (
    ANGLE,
    TURN,
    half_range,
    kind_of,
    knots_for,
)
from slipbench.identification.mismatch.thresholds import CURVE_GAIN
from slipbench.plant.signals import Floats

FOLDS = 4
RIDGE = 0.01
"""Ridge regularization of curve values, relative to the typical disturbance: nearly none."""
SPREADS = 4.0 ** -np.arange(-3.0, 9.0)
"""Prior deviations of curve values, or of their steps from knot to knot, of which one is chosen,
relative to the typical disturbance."""
ROUNDING = 1e-12
"""Relative rounding error of a normal matrix from which nuisances were projected out."""


@dataclass(frozen=True)
class CurveCandidate:
    """One curve at one injection point. values: f at the knots, relative to the point's size.

    half_range: of its waveform, in the unit of the injection point. cross_predicted: whitened
    cross-validated response, (rows,), of the curves fitted to other folds; None: too little gain.
    """

    place: InjectionPoint
    regressor: str
    knots: Floats
    values: Floats
    log_likelihood_gain: float
    half_range: float
    cross_predicted: Floats | None = None


def scan_curves(
    linear: Linearization, whitened: WhitenedResponses
) -> Iterator[list[CurveCandidate]]:
    """Fit every curve to the residuals of the training set; yield them by injection point.

    An injection point occurs several times where its columns exceed the memory limit.
    """
    fit = linear.fit
    points = (*places(fit), *sensors_as_places(fit))
    for subsystem in fit.model.partition.subsystems:
        by_record = whitened.regressors_of(subsystem)
        knots = {
            n: knots_for(n, concatenated_bins(n, by_record))
            for n in by_record[0][1]
            if kind_of(n) != TURN
        }
        varying = {n: k for n, k in knots.items() if k.size > 2}
        for batch in _batches(varying, len(linear.clusters)):
            units = _units(batch, by_record)
            for place in points:
                if place.subsystem == subsystem:
                    yield _at_place(linear, place, batch, units, whitened)


def _batches(knots: Mapping[str, Floats], rows: int) -> Iterator[dict[str, Floats]]:
    """Yield the regressors in batches whose columns stay within the memory limit."""
    part: dict[str, Floats] = {}
    for name, k in knots.items():
        if part and rows * (sum(map(np.size, part.values())) + k.size) > LARGEST:
            yield part
            part = {}
        part[name] = k
    if part:
        yield part


def _at_place(
    linear: Linearization,
    place: InjectionPoint,
    knots: Mapping[str, Floats],
    units: Floats,
    whitened: WhitenedResponses,
) -> list[CurveCandidate]:
    """Fit the curves over these regressors at one injection point. units: see `_units`.

    Nuisances are projected out of the columns only where the gain suffices for cross-validation:
    for the values, products with the nuisances suffice (see `Nuisances.products`).
    """
    tents = whitened.unit_disturbances(place.subsystem, knots)
    columns = place.size * whitened.columns(place, tents) * units
    gradients = columns.T @ linear.residuals[: len(columns)]
    correlations, coordinates = linear.nuisances.products(columns)
    found, first = [], 0
    for regressor, k in knots.items():
        part = slice(first, first + k.size)
        first += k.size
        own = columns[:, part]
        normal = own.T @ own - correlations[:, part].T @ coordinates[:, part]
        scaled = _solved(normal, gradients[part], own)
        gain = 0.5 * float(gradients[part] @ scaled)
        if gain > enough(k.size):
            scaled = _shrunk(normal, gradients[part], own)
        values = units[part] * scaled
        tent_waveforms = np.concatenate([h[:, part] for h in tents.disturbances])
        amplitude = _half_range_of(place.size * tent_waveforms @ values)
        cross_predicted = None
        if gain > enough(k.size):
            projected = linear.nuisances.subtract(own, coordinates[:, part])
            cross_predicted = _cross_predicted(projected, linear.residuals, linear.clusters)
        found.append(CurveCandidate(place, regressor, k, values, gain, amplitude, cross_predicted))
    return found


def _solved(normal: Floats, gradient: Floats, columns: Floats) -> Floats:
    """Return the regularized solution of the normal equations, (p,).

    columns: (rows, p), before nuisances are projected out. What is left of them may be rounding: a
    constant is a curve as well as an offset of the system.
    """
    rounding = ROUNDING * float(np.max(np.sum(columns**2, axis=0), initial=0.0))
    return np.asarray(np.linalg.solve(normal + (RIDGE + rounding) * np.eye(len(normal)), gradient))


def _shrunk(normal: Floats, gradient: Floats, columns: Floats) -> Floats:
    """Return the values under the prior of the largest evidence, (p,).

    The priors are independent values and random walks, each with several spreads. Without them,
    values that hardly any sample determines are arbitrary: a curve over the distance has knots that
    one recording alone reaches, and the folds without it predicted nonsense there. Empirical Bayes:
    MacKay, "Bayesian interpolation", Neural Computation 4 (1992). columns: as for `_solved`.
    """
    rounding = ROUNDING * float(np.max(np.sum(columns**2, axis=0), initial=0.0))
    # Rounding can make eigenvalues negative where nuisances were projected out.
    energies, axes = np.linalg.eigh(normal)
    precise = (axes * (np.maximum(energies, 0.0) + rounding)) @ axes.T
    best, largest = np.zeros(len(gradient)), -np.inf
    for prior, logarithm in _priors(len(gradient)):
        root = linalg.cholesky(precise + prior, lower=True)
        values = linalg.cho_solve((root, True), gradient)
        evidence = float(gradient @ values) + logarithm - 2.0 * float(np.sum(np.log(np.diag(root))))
        if evidence > largest:
            best, largest = values, evidence
    return best


@lru_cache(maxsize=64)
def _priors(knots: int) -> list[tuple[Floats, float]]:
    """Return precision matrices of curve values, (knots, knots), and their log-determinants."""
    level, steps = np.eye(knots), np.diff(np.eye(knots), axis=0)
    walk = steps.T @ steps
    matrices = [*(level / s**2 for s in SPREADS), *(walk / s**2 + RIDGE * level for s in SPREADS)]
    return [(m, float(np.linalg.slogdet(m)[1])) for m in matrices]


def _units(knots: Mapping[str, Floats], by_record: RecordRegressors) -> Floats:
    """Return values for which the waveform of each knot is of order 1, of all curves, (knots,).

    A gain of 1 on a pressure of 1e6 Pa would be 1e6 typical disturbances; the ridge would vanish.
    """
    reached = [
        half_range(n, np.concatenate([z[n] for _, z in by_record], axis=-1), k)
        for n, k in knots.items()
    ]
    size = np.concatenate(reached)
    return np.where(size > 0.0, 1.0 / np.where(size > 0.0, size, 1.0), 1.0)


def around_turns(
    linear: Linearization, whitened: WhitenedResponses
) -> Iterator[list[CurveCandidate]]:
    """Fit a periodic curve of each angle at every injection point.

    A revolution takes only a few bins, so impulse responses in bins are too coarse: each knot is
    simulated. A sensor responds without delay, so its response is exact in bins.
    """
    for place in (*places(linear.fit), *sensors_as_places(linear.fit)):
        by_record = whitened.regressors_of(place.subsystem)
        for regressor in (n for n in by_record[0][1] if kind_of(n) == TURN):
            knots = knots_for(regressor, concatenated_bins(regressor, by_record))
            if knots.size > 2 and place.inputs:
                values = place.size * np.eye(knots.size)
                series = simulated_responses(linear.fit, place, regressor, knots, values, by_record)
                yield [_periodic_candidate(linear, place, regressor, knots, series)]
            elif knots.size > 2 and regressor != ANGLE:  # a wheel sensor is tested at its teeth
                units = np.ones(knots.size)
                yield _at_place(linear, place, {regressor: knots}, units, whitened)


def at_teeth(linear: Linearization) -> Iterator[list[CurveCandidate]]:
    """Fit one value for every tooth of every toothed wheel."""
    for place, angles in discs(linear.fit):
        yield [_periodic_candidate(linear, place, ANGLE, angles, tooth_columns(linear.fit, place))]


def _periodic_candidate(
    linear: Linearization, place: InjectionPoint, regressor: str, angles: Floats, series: Series
) -> CurveCandidate:
    """Fit the values of a periodic curve from the responses to a typical disturbance per knot."""
    columns = whiten_and_stack(linear.fit.model, linear.fit.noise, series)
    projected = linear.nuisances.project_out(columns)
    gradient = projected.T @ linear.residuals
    normal = projected.T @ projected
    values = _solved(normal, gradient, columns)
    gain = 0.5 * float(gradient @ values)
    if gain > enough(len(values)):
        values = _shrunk(normal, gradient, columns)
    half_range = _half_range_of(
        place.size * values * _amplitude_ratio(columns @ values, projected @ values)
    )
    return CurveCandidate(
        place,
        regressor,
        angles,
        values,
        gain,
        half_range,
        _cross_predicted_if_enough(linear, projected, gain),
    )


def _amplitude_ratio(predicted: Floats, projected: Floats) -> float:
    """Return the amplitude ratio of a response after and before projecting out the nuisances.

    A component collinear with the nuisances is arbitrary, so it must not count in the half range.
    """
    energy = float(predicted @ predicted)
    return min(1.0, float(np.sqrt(projected @ projected / energy))) if energy > 0.0 else 1.0


def _half_range_of(waveform: Floats) -> float:
    return max(0.5 * float(np.ptp(waveform)), 1e-300)


def _cross_predicted_if_enough(
    linear: Linearization, projected: Floats, gain: float
) -> Floats | None:
    if gain <= enough(projected.shape[1]):
        return None
    return _cross_predicted(projected, linear.residuals, linear.clusters)


def enough(knots: int) -> float:
    """Return the minimum gain, nats, of a curve with a number of knots, or of additional knots."""
    return CURVE_GAIN + 0.5 * knots


def _cross_predicted(projected: Floats, residuals: Floats, clusters: Integers) -> Floats:
    """Return the cross-validated response, (rows,): each fold predicted from the other folds."""
    predicted = np.zeros(len(residuals))
    parts = [np.flatnonzero(clusters % FOLDS == fold) for fold in range(FOLDS)]
    own = [projected[part] for part in parts]
    normals = [o.T @ o for o in own]
    gradients = [o.T @ residuals[part] for o, part in zip(own, parts, strict=True)]
    for fold, part in enumerate(parts):
        others = [i for i in range(FOLDS) if i != fold]
        normal, gradient = (np.sum([x[i] for i in others], axis=0) for x in (normals, gradients))
        predicted[part] = own[fold] @ _shrunk(normal, gradient, projected)
    return predicted
