"""Location of a mismatch without the library, by free curves f(z).

A curve is fitted at each injection point over each regressor z; f is piecewise linear over seven
knots. The injection point and the regressor of the mismatch follow from the log-likelihood gains on
the training and the held-out recordings. Significance is tested by out-of-sample prediction: in
each fold of the training recordings by the curve fitted to the other folds (cross-validation), on
the held-out recordings by the curve itself.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import chain

import numpy as np
from scipy import linalg

from slipbench.identification.mismatch.curves.curve import Curve
from slipbench.identification.mismatch.curves.scan import (
    CurveCandidate,
    around_turns,
    at_teeth,
    scan_curves,
)
from slipbench.identification.mismatch.curves.tooth_curve import discs, tooth_columns
from slipbench.identification.mismatch.curves.trace import simulated_responses
from slipbench.identification.mismatch.curves.whitened import Waveforms, WhitenedResponses
from slipbench.identification.mismatch.fit.linearization import Linearization
from slipbench.identification.mismatch.fit.stack import whiten_and_stack
from slipbench.identification.mismatch.fit.variance_inflation import amplitude_p
from slipbench.identification.mismatch.simulation.injection_point import InjectionPoint
from slipbench.identification.mismatch.simulation.regressor import DETAIL, TURN, kind_of
from slipbench.identification.mismatch.thresholds import CONFIRMED, LIBRARY_SHARE, PLAIN_SHARE
from slipbench.plant.signals import Floats


@dataclass(frozen=True)
class _Held:
    """Result of a curve on held-out recordings.

    gain: nats; worth: expected gain of a correct curve, nats; course: whitened response, (rows,).
    """

    gain: float = 0.0
    worth: float = 0.0
    course: Floats | None = None


def locate(training: Linearization, held_out: Linearization | None) -> list[Curve]:
    """Fit every curve; the one with the most evidence for its place first.

    The curves of one injection point are tested together; their responses are discarded afterwards
    to limit memory. held_out: linearization of the held-out recordings, if there are any.
    """
    training_whitened = WhitenedResponses(training.fit)
    held_out_whitened = None if held_out is None else (held_out, WhitenedResponses(held_out.fit))
    batches = chain(
        scan_curves(training, training_whitened),
        around_turns(training, training_whitened),
        at_teeth(training),
    )
    found = [
        curve
        for candidates in batches
        for curve in _tested_curves(training, held_out_whitened, candidates)
    ]
    # Curves over quantities with the same waveform are one test: they have the same gain.
    tests = len({(c.place, c.kind, round(c.log_likelihood_gain, 9)) for c in found})
    corrected = [replace(c, p=min(1.0, c.p * tests / (1.0 - LIBRARY_SHARE))) for c in found]
    return _simplest(sorted(corrected, key=lambda c: (not c.significant, -c.evidence)))


def _simplest(curves: list[Curve]) -> list[Curve]:
    """Remove detailed curves if one of few knots at the same place explains nearly as much."""
    plain: dict[str, float] = {}
    for c in curves:
        if c.significant and c.kind == "":
            plain[c.place] = max(plain.get(c.place, 0.0), c.log_likelihood_gain)
    return [
        c
        for c in curves
        if c.kind != DETAIL or plain.get(c.place, 0.0) < PLAIN_SHARE * c.log_likelihood_gain
    ]


def _tested_curves(
    training: Linearization,
    held_out: tuple[Linearization, WhitenedResponses] | None,
    candidates: list[CurveCandidate],
) -> Iterator[Curve]:
    """Yield the curves of one injection point; p without correction for multiple tests."""
    held = [_Held()] * len(candidates) if held_out is None else _confirmed(*held_out, candidates)
    for f, h in zip(candidates, held, strict=True):
        p = _p(f, h, training, held_out[0] if held_out else None)
        yield Curve(
            f.place.name,
            f.place.block,
            f.place.unit,
            f.regressor,
            f.knots,
            f.place.size * f.values,
            f.log_likelihood_gain,
            h.gain,
            p,
            f.place.recorded,
        )


def _p(
    found: CurveCandidate, held: _Held, training: Linearization, held_out: Linearization | None
) -> float:
    """Return p of a curve's out-of-sample prediction.

    It is 1 where the gain is too small or held-out recordings contradict the curve. Held-out
    recordings are weighted by the size of the predicted response.
    """
    if found.cross_predicted is None or (held.worth >= CONFIRMED > held.gain):
        return 1.0
    response, residuals, clusters = found.cross_predicted, training.residuals, training.clusters
    if held_out is not None and held.course is not None:
        response = np.concatenate((response, held.course))
        residuals = np.concatenate((residuals, held_out.residuals))
        clusters = np.concatenate((clusters, held_out.clusters + 1 + clusters.max()))
    negligible_amplitude = found.place.negligible * found.place.size / found.half_range
    return amplitude_p(
        response, residuals, clusters, training.fit.variance_inflation, negligible_amplitude
    )


def _confirmed(
    linear: Linearization, whitened: WhitenedResponses, candidates: list[CurveCandidate]
) -> list[_Held]:
    """Return the results of the fitted curves of one injection point on other recordings."""
    known, columns = _columns(linear, whitened, candidates)
    if not known:
        return [_Held()] * len(candidates)
    energy, correlations = linear.energy_and_correlation(columns)
    held: dict[int, _Held] = {}
    for i, (number, e, correlation) in enumerate(zip(known, energy, correlations, strict=True)):
        response = None
        if candidates[number].cross_predicted is not None:
            response = linear.nuisances.project_out(columns[:, i])
        held[number] = _Held(float(correlation - 0.5 * e), 0.5 * float(e), response)
    return [held.get(i, _Held()) for i in range(len(candidates))]


def _columns(
    linear: Linearization, whitened: WhitenedResponses, candidates: list[CurveCandidate]
) -> tuple[list[int], Floats]:
    """Return the indices of the curves whose regressor exists, and their responses, (rows, k)."""
    place = candidates[0].place
    if kind_of(candidates[0].regressor) == TURN and (place.inputs or place in _discs(linear)):
        found = _periodic_response(linear, whitened, candidates[0])
        return ([0], found[:, None]) if found is not None else ([], np.zeros((0, 0)))
    by_record = whitened.regressors_of(place.subsystem)
    known = [i for i, f in enumerate(candidates) if f.regressor in by_record[0][1]]
    knots = {candidates[i].regressor: candidates[i].knots for i in known}
    if not known:
        return [], np.zeros((0, 0))
    values = linalg.block_diag(*(place.size * candidates[i].values[:, None] for i in known))
    waveforms = Waveforms(
        [
            tents @ values
            for tents in whitened.unit_disturbances(place.subsystem, knots).disturbances
        ]
    )
    return known, whitened.columns(place, waveforms)


def _discs(linear: Linearization) -> list[InjectionPoint]:
    return [place for place, _ in discs(linear.fit)]


def _periodic_response(
    linear: Linearization, whitened: WhitenedResponses, found: CurveCandidate
) -> Floats | None:
    """Return the whitened response of a periodic curve, (rows,); None where there is no angle."""
    fit, place = linear.fit, found.place
    if not place.inputs:
        tooth_responses = whiten_and_stack(fit.model, fit.noise, tooth_columns(fit, place))
        return np.asarray(tooth_responses @ found.values)
    by_record = whitened.regressors_of(place.subsystem)
    if found.regressor not in by_record[0][1]:
        return None
    values = [place.size * found.values]
    responses = simulated_responses(fit, place, found.regressor, found.knots, values, by_record)
    return whiten_and_stack(fit.model, fit.noise, responses)[:, 0]
