"""Crank phase at the start of each recording, estimated from the torque lines of each order.

No channel measures this angle, and it differs from recording to recording. A torque ripple that is
the same in all recordings is therefore a line of different phase in each, and a common phase
explains little of it. The angle is a parameter of the recording, not of the machine. It is
estimated for each recording, before any effect is tested, from the order with the largest
log-likelihood gain. A line of n periods per turn determines the angle only up to 1/n of a turn. The
other orders resolve the ambiguity: the chosen angle makes the lines of all orders agree best
between the recordings.
"""

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from slipbench.identification.mismatch.fit.fitting import Fit, whitened_as
from slipbench.identification.mismatch.fit.linearization import Linearization
from slipbench.identification.mismatch.fit.optimize import optimize
from slipbench.identification.mismatch.fit.refit import refit_with_updated_jacobian
from slipbench.identification.mismatch.fit.stack import recordings
from slipbench.identification.mismatch.simulation.model import Point, predict
from slipbench.identification.mismatch.simulation.turn import Turn
from slipbench.identification.mismatch.thresholds import LINE_GAIN
from slipbench.plant.effects.effect import Effect
from slipbench.plant.signals import Floats

SCANNED = 33
"""Number of start angles evaluated around a turn; resolves lines up to the tenth order."""
ROUNDING = 1e-9

Complexes = npt.NDArray[np.complex128]


@dataclass(frozen=True, eq=False)
class Lines:
    """Amplitudes of the orders of a turn in each recording.

    orders: (k,), periods per turn. amplitude: (records, k), real part of the sine and imaginary
    part of the cosine, in units of the effects in `Turn`. weight: (records, k), of an amplitude:
    half of the weight times the squared amplitude is the log-likelihood gain, nats.
    """

    orders: Floats
    amplitude: Complexes
    weight: Floats

    @property
    def nats(self) -> Floats:
        """Log-likelihood gain of each order over all recordings, (k,), nats."""
        return np.asarray(0.5 * (self.weight * np.abs(self.amplitude) ** 2).sum(axis=0))

    @property
    def plain(self) -> bool:
        """Whether one of the orders is strong enough to estimate an angle."""
        return bool(self.orders.size and self.nats.max() > LINE_GAIN)

    def begun(self, angles: Floats) -> "Lines":
        """Return the lines of recordings that start later by `angles`, (records,), rad."""
        shifted = self.amplitude * np.exp(-1j * self.orders * angles[:, None])
        return replace(self, amplitude=shifted)


def lines(fit: Fit) -> Lines:
    """Return the amplitudes of every order of an unmeasured crank phase in each recording."""
    turns = fit.model.system.unseen_turns()
    linear = Linearization.of(_silenced(fit)) if turns else None
    estimated = [_line_amplitudes(linear, turn) for turn in turns if linear]
    shape = (len(turns), len(fit.model.records))
    amplitude = (
        np.array([[a for a, _ in of_turn] for of_turn in estimated], np.complex128).reshape(shape).T
    )
    weight = (
        np.array([[w for _, w in of_turn] for of_turn in estimated], np.float64).reshape(shape).T
    )
    return Lines(np.array([turn.per_turn for turn in turns], np.float64), amplitude, weight)


def at_estimated_angles(fit: Fit, own: Lines, reference: Lines | None = None) -> tuple[Fit, Lines]:
    """Return the fit with the recordings starting at the angles estimated from their lines.

    Also return the lines at these angles. own: lines of the fit. reference: lines of other
    recordings of known angles, with which the lines are aligned.
    """
    angles = _angles(own, reference)
    records = tuple(
        replace(r, turned=r.turned + float(angle))
        for r, angle in zip(fit.model.records, angles, strict=True)
    )
    new = replace(fit, model=replace(fit.model, records=records))
    whitened_as(fit, new)
    if _phase_effects(fit):
        new = refit_with_updated_jacobian(
            optimize(replace(new, predicted=predict(new.model, new.point)))
        )
    return new, own.begun(angles)


def scanned(fit: Fit) -> Fit:
    """Return the fit with each recording at the best of the start angles scanned around a turn.

    A local fit converges only from a nearby angle, and initial speeds that compensated for an
    unmodelled ripple place it elsewhere. The fit is returned unchanged if the system has no such
    angle.
    """
    location = fit.model.system.first_angle()
    if location is None:
        return fit
    column, unit = location
    points = [
        _shifted(fit.point, column, angle / unit) for angle in np.linspace(-np.pi, np.pi, SCANNED)
    ]
    fits = [replace(fit, point=p, predicted=predict(fit.model, p)) for p in points]
    best = np.argmin([_squared_errors(f, fit) for f in fits], axis=0)
    q = tuple(points[k].q[r] for r, k in enumerate(best))
    point = replace(fit.point, q=q)
    return replace(fit, point=point, predicted=predict(fit.model, point))


def _squared_errors(fit: Fit, reference: Fit) -> list[float]:
    """Return the squared error of each recording, scaled by the errors of `reference`, (records,).

    Not whitened: a noise model fitted at a wrong angle attributes the ripple to noise.
    """
    sums = [0.0] * len(fit.model.records)
    for residuals, reference_residuals in zip(fit.residuals, reference.residuals, strict=True):
        nonempty = [one for one in reference_residuals if one.size]
        scale = np.mean(np.concatenate(nonempty) ** 2, axis=0) + 1e-300 if nonempty else 1.0
        for r, one in enumerate(residuals):
            sums[r] += float(np.sum(one**2 / scale)) if one.size else 0.0
    return sums


def _shifted(point: Point, column: int, by: float) -> Point:
    shifted = [q.copy() for q in point.q]
    for q in shifted:
        q[column] += by
    return replace(point, q=tuple(shifted))


def _angles(own: Lines, reference: Lines | None) -> Floats:
    """Return the start angle of each recording, rad, (records,)."""
    source = own if reference is None else reference
    best = int(np.argmax(source.nats))
    order = source.orders[best]
    ambiguity = 2.0 * np.pi / order * np.arange(max(round(order / source.orders.min()), 1))
    weight = np.zeros(source.orders.size) if reference is None else reference.weight.sum(axis=0)
    total = (
        weight + 0j if reference is None else (reference.weight * reference.amplitude).sum(axis=0)
    )
    common = 1.0 if reference is None else total[best]
    angles = np.angle(own.amplitude[:, best] * np.conj(common)) / order
    gain = 0.5 * (own.weight * np.abs(own.amplitude) ** 2).sum(axis=1)
    for r in np.argsort(-gain):
        weighted = own.weight[r] * own.amplitude[r]
        candidates = weighted * np.exp(-1j * own.orders * (angles[r] + ambiguity)[:, None])
        both = np.maximum(weight + own.weight[r], 1e-300)
        chosen = int(np.argmax((np.abs(total + candidates) ** 2 / both).sum(axis=1)))
        angles[r] += ambiguity[chosen]
        total, weight = total + candidates[chosen], both
    return np.asarray(angles)


def _line_amplitudes(linear: Linearization, turn: Turn) -> list[tuple[complex, float]]:
    """Return the complex amplitude of a line in each recording, and its weight."""
    responses = linear.effect_responses((turn.sine, turn.cosine))
    recording = recordings(linear.fit.model)
    estimated = []
    for number in range(len(linear.fit.model.records)):
        masked = np.where((recording == number)[:, None], responses, 0.0)
        projected, correlation = (
            linear.nuisances.project_out(masked),
            masked.T @ linear.residuals[: len(masked)],
        )
        normal = projected.T @ projected
        amplitude = np.linalg.solve(
            normal + ROUNDING * (1.0 + np.trace(normal)) * np.eye(2), correlation
        )
        gain, square = 0.5 * float(correlation @ amplitude), float(amplitude @ amplitude)
        estimated.append((complex(*amplitude), 2.0 * gain / square if square > 0.0 else 0.0))
    return estimated


def _phase_effects(fit: Fit) -> list[Effect]:
    """Effects of the file that depend on the unmeasured crank phase."""
    return [e for e in fit.model.system.effects if e.unseen_turn]


def _silenced(fit: Fit) -> Fit:
    phase_effects = _phase_effects(fit)
    if not phase_effects:
        return fit
    point = replace(fit.point, effects=(*fit.point.effects, *(e.silent() for e in phase_effects)))
    return replace(fit, point=point, predicted=predict(fit.model, point))
