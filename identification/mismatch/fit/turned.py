"""Where what turns unseen stood when each recording began, read off the line that its torque leaves.

No channel tells it, and two trials begin at two angles. So a ripple of the torque that is the same
in all of them is a line of another phase in each, and one phase for all finds little of it. The
angle is a number of the recording, not of the motorcycle: it is read off each recording by itself,
before any name is tried, at the order that shows best.
"""

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from slipbench.identification.mismatch.fit.fitting import Fit
from slipbench.identification.mismatch.fit.following import followed
from slipbench.identification.mismatch.fit.judge import Judge
from slipbench.identification.mismatch.fit.settling import settle
from slipbench.identification.mismatch.fit.stack import recordings
from slipbench.identification.mismatch.simulation.model import predict
from slipbench.identification.mismatch.simulation.turn import Turn
from slipbench.plant.effects.effect import Effect

PLAIN = 12.0
"""Nats of a line, over all recordings, below which there is nothing to read an angle off."""
ROUNDING = 1e-9


def plainest_turn(fit: Fit) -> Turn | None:
    """Return what makes the line that recordings show best; None where none is plain."""
    turns = fit.model.system.unseen_turns()
    if not turns:
        return None
    judge = Judge.of(_silent(fit))
    gains = [sum(gain for gain, _ in _read(judge, turn)) for turn in turns]
    best = int(np.argmax(gains))
    return turns[best] if gains[best] > PLAIN else None


def begun_at(fit: Fit, turn: Turn) -> Fit:
    """Return the fit beside recordings that begin at the angles at which a line says they did."""
    read = _read(Judge.of(_silent(fit)), turn)
    records = tuple(
        replace(r, turned=r.turned + angle)
        for r, (_, angle) in zip(fit.model.records, read, strict=True)
    )
    there = replace(fit, model=replace(fit.model, records=records))
    there.__dict__["nuisances"] = fit.nuisances
    if not _turning(fit):
        return there
    return followed(settle(replace(there, predicted=predict(there.model, there.point))))


def _read(judge: Judge, turn: Turn) -> Iterator[tuple[float, float]]:
    """Yield of each recording what the line is worth, nats, and the angle that it tells, rad."""
    both = judge.signatures((turn.sine, turn.cosine))
    recording = recordings(judge.fit.model)
    for number in range(len(judge.fit.model.records)):
        own = np.where((recording == number)[:, None], both, 0.0)
        off, push = judge.nuisances.off(own), own.T @ judge.left[: len(own)]
        normal = off.T @ off
        share = np.linalg.solve(normal + ROUNDING * (1.0 + np.trace(normal)) * np.eye(2), push)
        yield 0.5 * float(push @ share), math.atan2(share[1], share[0]) / turn.per_turn


def _turning(fit: Fit) -> list[Effect]:
    """Effects of the file that go with what turns unseen."""
    return [e for e in fit.model.system.effects if e.unseen_turn]


def _silent(fit: Fit) -> Fit:
    turning = _turning(fit)
    if not turning:
        return fit
    silent = (e.silent() for e in turning)
    point = replace(fit.point, effects=(*fit.point.effects, *silent))
    return replace(fit, point=point, predicted=predict(fit.model, point))
