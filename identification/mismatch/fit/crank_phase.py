"""Where what turns unseen stood when each recording began, read off the lines that its torque leaves.

No channel tells it, and two trials begin at two angles. So a ripple of the torque that is the same
in all of them is a line of another phase in each, and one phase for all finds little of it. The
angle is a number of the recording, not of the machine: it is read off each recording by itself,
before any name is tried, at the order that shows best. A line of n periods a turn tells the angle
only up to an nth of a turn. Which of them it is, the other orders say: it is that at which all of
them come out alike in all recordings.
"""

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from slipbench.identification.mismatch.fit.fitting import Fit, whitened_as
from slipbench.identification.mismatch.fit.following import refit_with_updated_jacobian
from slipbench.identification.mismatch.fit.linearization import Linearization
from slipbench.identification.mismatch.fit.optimize import optimize
from slipbench.identification.mismatch.fit.stack import recordings
from slipbench.identification.mismatch.simulation.model import Point, predict
from slipbench.identification.mismatch.simulation.turn import Turn
from slipbench.plant.effects.effect import Effect
from slipbench.plant.signals import Floats

PLAIN = 12.0
"""Nats of a line, over all recordings, below which there is nothing to read an angle off."""
SCANNED = 33
"""Angles around a turn at which a recording is begun: lines up to the tenth order are met."""
ROUNDING = 1e-9

Complexes = npt.NDArray[np.complex128]


@dataclass(frozen=True, eq=False)
class Lines:
    """What the orders of a turn show in each recording.

    orders: (k,), periods in a turn. amplitude: (records, k), of sine and, imaginary, cosine, in those
    of `Turn`. weight: (records, k), of an amplitude: what its square times half of this is in nats.
    """

    orders: Floats
    amplitude: Complexes
    weight: Floats

    @property
    def nats(self) -> Floats:
        """What each order is worth over all recordings, (k,)."""
        return np.asarray(0.5 * (self.weight * np.abs(self.amplitude) ** 2).sum(axis=0))

    @property
    def plain(self) -> bool:
        """Tell whether an angle can be read off one of them."""
        return bool(self.orders.size and self.nats.max() > PLAIN)

    def begun(self, angles: Floats) -> "Lines":
        """Return them beside recordings that begin so much later in the turn. angles: (records,)."""
        turned = self.amplitude * np.exp(-1j * self.orders * angles[:, None])
        return replace(self, amplitude=turned)


def lines(fit: Fit) -> Lines:
    """Return what recordings show of every order of what turns unseen."""
    turns = fit.model.system.unseen_turns()
    linear = Linearization.of(_silent(fit)) if turns else None
    read = [_read(linear, turn) for turn in turns if linear]
    shape = (len(turns), len(fit.model.records))
    amplitude = np.array([[a for a, _ in one] for one in read], np.complex128).reshape(shape).T
    weight = np.array([[w for _, w in one] for one in read], np.float64).reshape(shape).T
    return Lines(np.array([turn.per_turn for turn in turns], np.float64), amplitude, weight)


def begun_at(fit: Fit, shown: Lines, like: Lines | None = None) -> tuple[Fit, Lines]:
    """Return the fit beside recordings that begin at the angles that their lines tell.

    And the lines as they are then. shown: lines of the fit; like: lines of other recordings whose
    angles are known, with which these shall be alike.
    """
    angles = _angles(shown, like)
    records = tuple(
        replace(r, turned=r.turned + float(angle))
        for r, angle in zip(fit.model.records, angles, strict=True)
    )
    there = replace(fit, model=replace(fit.model, records=records))
    whitened_as(fit, there)
    if _turning(fit):
        there = refit_with_updated_jacobian(
            optimize(replace(there, predicted=predict(there.model, there.point)))
        )
    return there, shown.begun(angles)


def scanned(fit: Fit) -> Fit:
    """Return the fit with every recording begun at the angle around a turn that suits it best.

    A local fit finds the angle only from nearby, and first speeds that make up for a ripple which was
    not there put it elsewhere. As it is where the system says of no unknown that it is the angle.
    """
    told = fit.model.system.first_angle()
    if told is None:
        return fit
    column, unit = told
    points = [_shifted(fit.point, column, by / unit) for by in np.linspace(-np.pi, np.pi, SCANNED)]
    fits = [replace(fit, point=p, predicted=predict(fit.model, p)) for p in points]
    best = np.argmin([_squares(f, fit) for f in fits], axis=0)
    q = tuple(points[k].q[r] for r, k in enumerate(best))
    point = replace(fit.point, q=q)
    return replace(fit, point=point, predicted=predict(fit.model, point))


def _squares(fit: Fit, usual: Fit) -> list[float]:
    """Square error of each recording, outputs as another fit errs in them, (records,).

    Not whitened: a noise model that has seen a wrong angle takes the ripple for noise.
    """
    found = [0.0] * len(fit.model.records)
    for ones, others in zip(fit.residuals, usual.residuals, strict=True):
        there = [one for one in others if one.size]
        scale = np.mean(np.concatenate(there) ** 2, axis=0) + 1e-300 if there else 1.0
        for r, one in enumerate(ones):
            found[r] += float(np.sum(one**2 / scale)) if one.size else 0.0
    return found


def _shifted(point: Point, column: int, by: float) -> Point:
    there = [q.copy() for q in point.q]
    for q in there:
        q[column] += by
    return replace(point, q=tuple(there))


def _angles(shown: Lines, like: Lines | None) -> Floats:
    """Return where each recording begins, rad, (records,)."""
    of = shown if like is None else like
    best = int(np.argmax(of.nats))
    order = of.orders[best]
    by = 2.0 * np.pi / order * np.arange(max(round(order / of.orders.min()), 1))
    weight = np.zeros(of.orders.size) if like is None else like.weight.sum(axis=0)
    total = weight + 0j if like is None else (like.weight * like.amplitude).sum(axis=0)
    there = 1.0 if like is None else total[best]
    angles = np.angle(shown.amplitude[:, best] * np.conj(there)) / order
    worth = 0.5 * (shown.weight * np.abs(shown.amplitude) ** 2).sum(axis=1)
    for r in np.argsort(-worth):
        own = shown.weight[r] * shown.amplitude[r]
        tried = own * np.exp(-1j * shown.orders * (angles[r] + by)[:, None])
        both = np.maximum(weight + shown.weight[r], 1e-300)
        chosen = int(np.argmax((np.abs(total + tried) ** 2 / both).sum(axis=1)))
        angles[r] += by[chosen]
        total, weight = total + tried[chosen], both
    return np.asarray(angles)


def _read(linear: Linearization, turn: Turn) -> list[tuple[complex, float]]:
    """Return of each recording the amplitude of a line, and its weight."""
    both = linear.effect_responses((turn.sine, turn.cosine))
    recording = recordings(linear.fit.model)
    found = []
    for number in range(len(linear.fit.model.records)):
        own = np.where((recording == number)[:, None], both, 0.0)
        off, push = linear.nuisances.project_out(own), own.T @ linear.residuals[: len(own)]
        normal = off.T @ off
        share = np.linalg.solve(normal + ROUNDING * (1.0 + np.trace(normal)) * np.eye(2), push)
        nats, square = 0.5 * float(push @ share), float(share @ share)
        found.append((complex(*share), 2.0 * nats / square if square > 0.0 else 0.0))
    return found


def _turning(fit: Fit) -> list[Effect]:
    """Effects of the file that go with what turns unseen."""
    return [e for e in fit.model.system.effects if e.unseen_turn]


def _silent(fit: Fit) -> Fit:
    turning = _turning(fit)
    if not turning:
        return fit
    point = replace(fit.point, effects=(*fit.point.effects, *(e.silent() for e in turning)))
    return replace(fit, point=point, predicted=predict(fit.model, point))
