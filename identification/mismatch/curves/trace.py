"""What a curve at a place leaves in the outputs: answers to pushes, or simulations of them.

A sensor is a place as well: it answers by itself, at once.
"""

from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from slipbench.identification.mismatch.curves.curve import Curve
from slipbench.identification.mismatch.curves.injection import answers, places, respond
from slipbench.identification.mismatch.curves.tooth_curve import SIZE, discs, tooth_columns
from slipbench.identification.mismatch.fit.fitting import Fit
from slipbench.identification.mismatch.fit.linearization import Linearization
from slipbench.identification.mismatch.fit.sensitivity import change
from slipbench.identification.mismatch.simulation.injection_point import InjectionPoint
from slipbench.identification.mismatch.simulation.input_disturbance import InputDisturbance
from slipbench.identification.mismatch.simulation.model import Runs, Series, acting, predict
from slipbench.identification.mismatch.simulation.record import Record
from slipbench.identification.mismatch.simulation.regressor import (
    DETAIL,
    SCALE,
    TURN,
    columns,
    course,
    kind_of,
)
from slipbench.identification.mismatch.simulation.sampling import Grid
from slipbench.plant.signals import Floats

RecordRegressors = list[tuple[Record, dict[str, Floats]]]
"""Every record with quantities, row by row."""


def regressors(fit: Fit, subsystem: str, r: int) -> Mapping[str, Floats]:
    """Waveforms of what the recording and the fitted simulation tell of one drive, (rows,) each."""
    model = fit.model
    added = acting(model, fit.point, r)
    system, record, q = model.at(fit.point), model.records[r], fit.point.q[r]
    return system.regressors(record, model.partition, subsystem, q, added)


def seen_by(fit: Fit, subsystem: str) -> RecordRegressors:
    """Every record with the regressors of a drive that all records have."""
    courses = [regressors(fit, subsystem, r) for r in range(len(fit.model.records))]
    shared = sorted(set.intersection(*(set(c) for c in courses)))
    return [
        (record, {name: c[name] for name in shared})
        for record, c in zip(fit.model.records, courses, strict=True)
    ]


def over_all(name: str, seen: Sequence[tuple[Record, Mapping[str, Floats]]]) -> Floats:
    """A quantity in the bins of all records, end to end."""
    courses = ((record, s[name][0] if kind_of(name) == SCALE else s[name]) for record, s in seen)
    return np.concatenate([record.grid.binned(z) for record, z in courses])


def in_bins(record: Record, knots: Mapping[str, Floats], seen: Mapping[str, Floats]) -> Floats:
    """Bin by bin what each knot of each regressor pushes, (bins, all knots)."""
    return np.concatenate(
        [_in_bins(record.grid, name, seen[name], at) for name, at in knots.items()], axis=1
    )


def _in_bins(grid: Grid, name: str, z: Floats, knots: Floats) -> Floats:
    """Bin by bin what each knot of one regressor pushes, (bins, knots)."""
    kind = kind_of(name)
    if kind not in ("", DETAIL, SCALE):
        return np.stack([grid.binned(c) for c in columns(name, z, knots, grid.step)], axis=1)
    along, by = (z[0], z[1]) if kind == SCALE else (z, None)
    return between_knots(grid, along, knots, by)


def between_knots(grid: Grid, z: Floats, knots: Floats, by: Floats | None = None) -> Floats:
    """Mean in each bin of the share that each knot of a broken line has, (bins, knots).

    A value lies between two knots, so only these two get a share of it. z, by: row by row, (rows,);
    by: what the shares are multiplied by, 1 if not given.
    """
    inside = grid.in_bins(z)
    place = np.clip(np.searchsorted(knots, inside, side="right") - 1, 0, knots.size - 2)
    far = np.clip((inside - knots[place]) / np.diff(knots)[place], 0.0, 1.0)
    weight = np.full(inside.size, 1.0 / grid.rows_per_bin)
    if by is not None:
        weight = weight * grid.in_bins(by)
    cell = np.repeat(np.arange(grid.bins) * knots.size, grid.rows_per_bin) + place
    size = grid.bins * knots.size
    shares = np.bincount(cell, weight * (1.0 - far), size)
    shares += np.bincount(cell + 1, weight * far, size)
    return np.asarray(shares.reshape(grid.bins, knots.size), np.float64)


def effect_of(linear: Linearization, curve: Curve) -> Series:
    """Return what a curve leaves in the outputs, unwhitened, (T, m) by block and record."""
    for disc, _ in discs(linear.fit):
        if disc.name == curve.place:
            return _combined(tooth_columns(linear.fit, disc), curve.values / SIZE)
    place = next(
        p for p in (*places(linear.fit), *sensors_as_places(linear.fit)) if p.name == curve.place
    )
    if place.inputs and curve.kind == TURN:
        turned = simulated_responses(
            linear.fit, place, curve.regressor, curve.knots, [curve.values]
        )
        return [[one[:, :, 0] if one.size else one for one in block] for block in turned]
    pushes = [
        record.grid.binned(curve(seen[curve.regressor], record.grid.step))[:, None]
        for record, seen in seen_by(linear.fit, place.subsystem)
    ]
    answered = responses_to(impulse_responses(linear.fit, place), pushes)
    return [[one[:, :, 0] if one.size else one for one in block] for block in answered]


def _combined(columns: Series, values: Floats) -> Series:
    return [[one @ values if one.size else one for one in block] for block in columns]


def responses_along(fit: Fit, place: InjectionPoint, regressor: str, knots: Floats) -> Series:
    """Return what each knot of a curve would leave in the outputs, (T, m, knots) per unit push."""
    binned = [
        in_bins(record, {regressor: knots}, seen) for record, seen in seen_by(fit, place.subsystem)
    ]
    return responses_to(impulse_responses(fit, place), binned)


def sensors_as_places(fit: Fit) -> list[InjectionPoint]:
    """Every sensor that may be wrong as a place of its own."""
    return [
        InjectionPoint(
            f"sensor of {o.replace('_', ' ')}",
            f"{o} sensor",
            s.unit,
            float(np.std(s.value)) + 1e-3,
            b.subsystem,
            negligible=0.002,
        )
        for b in fit.model.partition.groups
        if b.sensors_suspected
        for o in b.outputs
        for s in (fit.model.records[0].sensors[o],)
    ]


def impulse_responses(fit: Fit, place: InjectionPoint, plain: Runs | None = None) -> Series:
    """Answers to a push in a bin; a sensor answers by itself, at once. plain: see `answers`."""
    if place.inputs:
        return answers(fit, place, {} if plain is None else plain)
    found: Series = [[np.empty(0)] * len(fit.model.records) for _ in fit.model.partition.groups]
    for b, block in enumerate(fit.model.partition.groups):
        for j, output in enumerate(block.outputs):
            if place.block == f"{output} sensor":
                now = np.zeros((1, len(block.outputs)))
                now[0, j] = 1.0
                found[b] = [now] * len(fit.model.records)
    return found


def responses_to(reply: Series, tents: list[Floats]) -> Series:
    """Answer of all outputs to pushes (bins, k), one set a record: (T, m, k)."""
    return [[respond(a, h) if a.size else a for a, h in zip(b, tents, strict=True)] for b in reply]


def simulated_responses(
    fit: Fit,
    place: InjectionPoint,
    regressor: str,
    knots: Floats,
    pushes: Iterable[Floats],
    seen: RecordRegressors | None = None,
) -> Series:
    """Return what curves of these values leave in the outputs, simulated, (T, m, curves).

    seen: what `seen_by` gives of the place's drive, where it is known already. Nothing counts as left
    in the pattern of teeth: there their tolerance looks like any push that goes round with the wheel.
    """
    model, seen = fit.model.coarse, seen_by(fit, place.subsystem) if seen is None else seen
    system, before = model.at(fit.point), predict(model, fit.point)
    changes = []
    for values in pushes:
        courses = tuple(
            system.input_disturbance(
                place, r, course(regressor, s[regressor], knots, values, r.grid.step)
            )
            for r, s in seen
        )
        effects = (*fit.point.effects, InputDisturbance(place.subsystem, courses))
        changes.append(change(model, fit.point, effects, before))
    nothing = [np.empty(0)] * len(model.records)
    return [
        [_side_by_side(parts) for parts in zip(*blocks, strict=True)] if block.order else nothing
        for block, blocks in zip(model.partition.groups, zip(*changes, strict=True), strict=True)
    ]


def _side_by_side(parts: Sequence[Floats]) -> Floats:
    return np.stack(parts, axis=-1) if parts[0].size else parts[0]
