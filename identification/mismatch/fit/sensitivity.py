"""Sensitivities of all outputs to each uncertain parameter."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from slipbench.identification.mismatch.fit.resolution import step_of
from slipbench.identification.mismatch.simulation.model import (
    Model,
    Point,
    Runs,
    Series,
    clock_derivatives,
    misplace,
    output_derivatives,
    predict,
    simulation_input,
)
from slipbench.identification.mismatch.simulation.system import System
from slipbench.identification.mismatch.simulation.threads import in_threads
from slipbench.plant.effects.effect import Effect
from slipbench.plant.errors import PlantError
from slipbench.plant.signals import Floats

DIFFERENCE_STEP = 0.02  # of a coordinate's prior deviation
SLOW_DIFFERENCE_STEP = 0.2


def sensitivities(fine_model: Model, point: Point, strengths: Sequence[float] = ()) -> Series:
    """Return (T, m, p) by output group and record: system parameters, then slow disturbance.

    The slow disturbance has columns for each record. The sensitivities are derivatives of the
    system, or finite differences where it offers none, with coarse steps. strengths: of all
    columns, where known (resolution.py).
    """
    model = fine_model.for_slopes
    columns = none(model, point)
    jobs = [(r, d) for d in model.partition.subsystems for r in range(len(model.records))]
    system = model.at(point)
    if not all(in_threads(lambda job: _derive(model, point, system, *job, columns), jobs)):
        _compare(model, point, columns, strengths)
    return columns


def _derive(
    model: Model, point: Point, system: System, record: int, subsystem: str, columns: Series
) -> bool:
    """Write sensitivities of one subsystem of one record; return False without derivatives."""
    derivatives = system.derivatives(
        simulation_input(model, point, record, subsystem), model.known, point.x
    )
    if derivatives is None:
        return False
    before = len(point.x) + sum(len(q) for q in point.q[:record])
    column_indices = [*derivatives.known, *range(before, before + derivatives.slow)]
    for b, group in enumerate(model.partition.groups):
        if group.subsystem == subsystem:
            known = model.known_bins[b][record]
            target = columns[b][record]
            response = output_derivatives(model, point, system, b, record, derivatives)
            target[:, :, column_indices] = response * known[:, :, None]
            for i, slope in clock_derivatives(
                model, point, system, b, record, derivatives.out
            ).items():
                target[:, :, i] = slope * known
    return True


def _compare(model: Model, point: Point, columns: Series, strengths: Sequence[float]) -> None:
    """Write sensitivities by finite differences."""
    subsystems = frozenset(model.partition.subsystems)
    base = predict(model, point)
    total, of_system = coordinates_of(point).size, len(point.x)
    defaults = [DIFFERENCE_STEP] * of_system + [SLOW_DIFFERENCE_STEP] * (total - of_system)
    difference_steps = [
        step_of(*pair) for pair in zip(defaults, strengths or [0.0] * total, strict=True)
    ]
    jobs = [
        *_system_shifts(model, point, subsystems, difference_steps),
        *_slow_shifts(model, point, subsystems, difference_steps),
    ]
    for job, (shifted, step) in zip(
        jobs, in_threads(lambda job: job.run(model), jobs), strict=True
    ):
        put(model, columns, job.column, shifted, base, step)


@dataclass(frozen=True)
class _Shifted:
    """A point shifted by `step` in one column, and the part that has to be simulated.

    backward: the point shifted to the other side.
    """

    column: int
    point: Point
    step: float
    subsystems: frozenset[str]
    records: tuple[int, ...] | None = None
    backward: Point | None = None

    def run(self, model: Model) -> tuple[Series, float]:
        """Return the prediction at the shifted point, and the step to it.

        The backward point is used where the forward one cannot be simulated; raises PlantError
        where neither can.
        """
        try:
            return predict(model, self.point, self.subsystems, self.records), self.step
        except PlantError:
            if self.backward is None:
                raise
        return predict(model, self.backward, self.subsystems, self.records), -self.step


def _system_shifts(
    model: Model, point: Point, subsystems: frozenset[str], difference_steps: Sequence[float]
) -> Iterator[_Shifted]:
    """Yield a shifted point for every system parameter."""
    for i in range(len(point.x)):
        touched = subsystems.intersection(
            model.system.affected_subsystems(model.partition, model.known[i])
        )
        if touched:
            step = difference_steps[i] * (np.arange(len(point.x)) == i)
            forward, backward = (replace(point, x=point.x + s) for s in (step, -step))
            yield _Shifted(i, forward, difference_steps[i], touched, backward=backward)


def _slow_shifts(
    model: Model, point: Point, subsystems: frozenset[str], difference_steps: Sequence[float]
) -> Iterator[_Shifted]:
    """Yield a shifted point for every coordinate of the slow disturbance."""
    column = len(point.x)
    slow = subsystems.intersection(model.system.slow_subsystems(model.partition))
    for r, q in enumerate(point.q if slow else ()):
        for k in range(len(q)):
            coordinates = q.copy()
            coordinates[k] += difference_steps[column]
            shifted = replace(point, q=(*point.q[:r], coordinates, *point.q[r + 1 :]))
            yield _Shifted(column, shifted, difference_steps[column], slow, (r,))
            column += 1


def none(model: Model, point: Point) -> Series:
    """Return zero sensitivities, (T, m, p) by output group and record."""
    places = coordinates_of(point).size
    return [[np.zeros((*m.shape, places)) for m in ms] for ms in model.measured]


def put(
    model: Model, target: Series, column: int, shifted: Series, base: Series, step: float
) -> None:
    """Write one column of finite-difference sensitivities (T, m, p) of predicted outputs."""
    for b, ks in enumerate(model.known_bins):
        for r, known in enumerate(ks):
            if shifted[b][r].size:
                target[b][r][:, :, column] = (shifted[b][r] - base[b][r]) / step * known


def change(
    model: Model, point: Point, effects: tuple[Effect, ...], base: Series, runs: Runs | None = None
) -> Series:
    """Return the change of the outputs, (T, m) by output group and record, with these effects.

    `effects` replace those of the point. Subsystems that the new effects do not affect are not run,
    and their arrays are empty. runs: cached simulations of the point as it is, for effects that act
    in a sensor alone.
    """
    new = [e for e in effects if e not in point.effects]
    if all(hasattr(e, "tooth_offsets") for e in new) and len(effects) > len(point.effects):
        return _of_the_discs(model, new)
    affected = {d for e in new for d in model.subsystems_changed_by(e)}
    subsystems = [d for d in model.partition.subsystems if d in affected]
    only_sensors = all(model.changes_only_sensors(e) for e in new)
    changed = predict(
        model, replace(point, effects=effects), subsystems, runs=runs if only_sensors else None
    )
    return [
        [(t - s) * k if t.size else t for t, s, k in zip(ts, ss, ks, strict=True)]
        for ts, ss, ks in zip(changed, base, model.known_bins, strict=True)
    ]


def _of_the_discs(model: Model, effects: list[Effect]) -> Series:
    """Change of the outputs by displaced teeth; needs no simulation."""
    changes: Series = [[np.empty(0)] * len(model.records) for _ in model.partition.groups]
    for b, group in enumerate(model.partition.groups):
        for r, record in enumerate(model.records):
            displacement = np.zeros(model.measured[b][r].shape)
            misplace(displacement, group.outputs, record, effects)
            if displacement.any():
                changes[b][r] = displacement * model.known_bins[b][r]
    return changes


def moved(model: Model, point: Point, step: Floats) -> Point:
    """Return the point after a step of all coordinates, (p,), slow disturbance included.

    Parameter values change in proportion to the step, within the bounds of the coordinates.
    """
    ends = np.cumsum([len(point.x), *(len(q) for q in point.q)])
    x, *slow = np.split(step, ends[:-1])
    q = tuple(a + b for a, b in zip(point.q, slow, strict=True))
    bound = model.system.coordinate_bound
    shifted = [k.moved(*pair) for k, *pair in zip(model.known, point.x, x, strict=True)]
    low, high = np.minimum(point.x, -bound), np.maximum(point.x, bound)
    return replace(point, x=np.clip(np.array(shifted), low, high), q=q)


def coordinates_of(point: Point) -> Floats:
    """Return all coordinates of a point, concatenated, (p,)."""
    return np.concatenate([point.x, *point.q])
