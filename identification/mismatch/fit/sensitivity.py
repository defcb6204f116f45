"""How everything that sensors show changes with each uncertain number."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from slipbench.identification.mismatch.fit.resolution import step_of
from slipbench.identification.mismatch.simulation.model import (
    Model,
    Point,
    Runs,
    Series,
    acting,
    late_slopes,
    look_along,
    misplace,
    predict,
)
from slipbench.identification.mismatch.simulation.system import System
from slipbench.identification.mismatch.simulation.threads import in_threads
from slipbench.plant.effects.effect import Effect
from slipbench.plant.errors import PlantError
from slipbench.plant.signals import Floats

DIFFERENCE_STEP = 0.02  # of a coordinate's prior deviation
SLOW_NUDGE = 0.2


def sensitivities(fine: Model, point: Point, strengths: Sequence[float] = ()) -> Series:
    """Return (T, m, p) by block and record: the system first, then the slow unknown by record.

    Simulations with coarse steps are differentiated, or compared with each other where the system
    offers no derivatives. strengths: of all columns, where known (resolution.py).
    """
    model = fine.for_slopes
    found = none(model, point)
    jobs = [(r, d) for d in model.partition.subsystems for r in range(len(model.records))]
    system = model.at(point)
    if not all(in_threads(lambda job: _derive(model, point, system, *job, found), jobs)):
        _compare(model, point, found, strengths)
    return found


def _derive(
    model: Model, point: Point, system: System, record: int, subsystem: str, found: Series
) -> bool:
    """Write sensitivities of one drive of one record; tell whether the system could."""
    done = system.derivatives(
        model.records[record],
        model.partition,
        subsystem,
        point.q[record],
        acting(model, point, record),
        model.known,
        point.x,
    )
    if done is None:
        return False
    before = len(point.x) + sum(len(q) for q in point.q[:record])
    places = [*done.known, *range(before, before + done.slow)]
    for b, block in enumerate(model.partition.groups):
        if block.subsystem == subsystem:
            known = model.known_bins[b][record]
            into = found[b][record]
            shown = look_along(model, point, system, b, record, done)
            into[:, :, places] = shown * known[:, :, None]
            for i, slope in late_slopes(model, point, system, b, record, done.out).items():
                into[:, :, i] = slope * known
    return True


def _compare(model: Model, point: Point, found: Series, strengths: Sequence[float]) -> None:
    """Write sensitivities by finite differences."""
    subsystems = frozenset(model.partition.subsystems)
    base = predict(model, point)
    total, own = coordinates_of(point).size, len(point.x)
    usual = [DIFFERENCE_STEP] * own + [SLOW_NUDGE] * (total - own)
    difference_steps = [
        step_of(*pair) for pair in zip(usual, strengths or [0.0] * total, strict=True)
    ]
    jobs = [
        *_own(model, point, subsystems, difference_steps),
        *_slow(model, point, subsystems, difference_steps),
    ]
    for job, (there, nudge) in zip(jobs, in_threads(lambda job: job.run(model), jobs), strict=True):
        put(model, found, job.column, there, base, nudge)


@dataclass(frozen=True)
class _Nudged:
    """A point beside another, by `nudge` in one column, and what of it has to be simulated.

    backward: the point on the other side.
    """

    column: int
    point: Point
    nudge: float
    subsystems: frozenset[str]
    records: tuple[int, ...] | None = None
    backward: Point | None = None

    def run(self, model: Model) -> tuple[Series, float]:
        """Return what is predicted there, and the step to it.

        Backward where the system cannot be simulated forward; raises PlantError where neither can.
        """
        try:
            return predict(model, self.point, self.subsystems, self.records), self.nudge
        except PlantError:
            if self.backward is None:
                raise
        return predict(model, self.backward, self.subsystems, self.records), -self.nudge


def _own(
    model: Model, point: Point, subsystems: frozenset[str], difference_steps: Sequence[float]
) -> Iterator[_Nudged]:
    """Yield a point beside another for every number of the system."""
    for i in range(len(point.x)):
        touched = subsystems.intersection(model.system.touched(model.partition, model.known[i]))
        if touched:
            step = difference_steps[i] * (np.arange(len(point.x)) == i)
            forward, backward = (replace(point, x=point.x + s) for s in (step, -step))
            yield _Nudged(i, forward, difference_steps[i], touched, backward=backward)


def _slow(
    model: Model, point: Point, subsystems: frozenset[str], difference_steps: Sequence[float]
) -> Iterator[_Nudged]:
    """Yield a point beside another for every number of the slow unknown."""
    column = len(point.x)
    slow = subsystems.intersection(model.system.slow_subsystems(model.partition))
    for r, q in enumerate(point.q if slow else ()):
        for k in range(len(q)):
            moved = q.copy()
            moved[k] += difference_steps[column]
            there = replace(point, q=(*point.q[:r], moved, *point.q[r + 1 :]))
            yield _Nudged(column, there, difference_steps[column], slow, (r,))
            column += 1


def none(model: Model, point: Point) -> Series:
    """Return sensitivities of where nothing is uncertain: (T, m, p) zeros by block and record."""
    places = coordinates_of(point).size
    return [[np.zeros((*m.shape, places)) for m in ms] for ms in model.measured]


def put(model: Model, into: Series, column: int, there: Series, base: Series, nudge: float) -> None:
    """Write one column of sensitivities where something was predicted."""
    for b, ks in enumerate(model.known_bins):
        for r, known in enumerate(ks):
            if there[b][r].size:
                into[b][r][:, :, column] = (there[b][r] - base[b][r]) / nudge * known


def change(
    model: Model, point: Point, effects: tuple[Effect, ...], base: Series, runs: Runs | None = None
) -> Series:
    """Return what the outputs gain when the point has these effects instead, by block and record.

    Drives that the new effects do not concern are not run and left empty. runs: simulations of the
    point as it is, kept from call to call, for effects that act in a sensor alone.
    """
    new = [e for e in effects if e not in point.effects]
    if all(hasattr(e, "tooth_offsets") for e in new) and len(effects) > len(point.effects):
        return _of_the_discs(model, new)
    concerned = {d for e in new for d in model.subsystems_changed_by(e)}
    subsystems = [d for d in model.partition.subsystems if d in concerned]
    told = all(model.changes_only_sensors(e) for e in new)
    there = predict(model, replace(point, effects=effects), subsystems, runs=runs if told else None)
    return [
        [(t - s) * k if t.size else t for t, s, k in zip(ts, ss, ks, strict=True)]
        for ts, ss, ks in zip(there, base, model.known_bins, strict=True)
    ]


def _of_the_discs(model: Model, effects: list[Effect]) -> Series:
    """What displaced teeth add; nothing has to be simulated for it."""
    found: Series = [[np.empty(0)] * len(model.records) for _ in model.partition.groups]
    for b, block in enumerate(model.partition.groups):
        for r, record in enumerate(model.records):
            seen = np.zeros(model.measured[b][r].shape)
            misplace(seen, block.outputs, record, effects)
            if seen.any():
                found[b][r] = seen * model.known_bins[b][r]
    return found


def moved(model: Model, point: Point, step: Floats) -> Point:
    """Return the point after a step of all coordinates, the slow unknown included.

    Values change in proportion to the step, up to the farthest that a number may be.
    """
    places = np.cumsum([len(point.x), *(len(q) for q in point.q)])
    x, *roads = np.split(step, places[:-1])
    q = tuple(a + b for a, b in zip(point.q, roads, strict=True))
    far = model.system.farthest
    there = [k.moved(*pair) for k, *pair in zip(model.known, point.x, x, strict=True)]
    low, high = np.minimum(point.x, -far), np.maximum(point.x, far)
    return replace(point, x=np.clip(np.array(there), low, high), q=q)


def coordinates_of(point: Point) -> Floats:
    """Lay all coordinates of a point end to end."""
    return np.concatenate([point.x, *point.q])
