"""Effect response of a curve at an injection point, by impulse responses or by simulation.

A sensor is an injection point as well: it responds without simulation and without delay.
"""

from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from slipbench.identification.mismatch.curves.curve import Curve
from slipbench.identification.mismatch.curves.injection import (
    places,
    respond,
    simulated_impulse_responses,
)
from slipbench.identification.mismatch.curves.tooth_curve import SIZE, discs, tooth_columns
from slipbench.identification.mismatch.fit.fitting import Fit
from slipbench.identification.mismatch.fit.linearization import Linearization
from slipbench.identification.mismatch.fit.sensitivity import change
from slipbench.identification.mismatch.simulation.injection_point import InjectionPoint, at_sensor
from slipbench.identification.mismatch.simulation.input_disturbance import InputDisturbance
from slipbench.identification.mismatch.simulation.model import (
    Runs,
    Series,
    predict,
    simulation_input,
)
from slipbench.identification.mismatch.simulation.record import Record
from slipbench.identification.mismatch.simulation.regressor import (
    DETAIL,
    SCALE,
    TURN,
    columns,
    curve_waveform,
    kind_of,
)
from slipbench.identification.mismatch.simulation.sampling import Grid
from slipbench.plant.signals import Floats

RecordRegressors = list[tuple[Record, dict[str, Floats]]]
"""Every record with its regressors by name, (rows,) each."""


def regressors(fit: Fit, subsystem: str, r: int) -> Mapping[str, Floats]:
    """Return the recorded and simulated waveforms of one subsystem by name, SI, in record r.

    Shape (rows,) each; (2, rows) for a scale, see `regressor.scale`.
    """
    system = fit.model.at(fit.point)
    return system.regressors(simulation_input(fit.model, fit.point, r, subsystem))


def regressors_by_record(fit: Fit, subsystem: str) -> RecordRegressors:
    """Return every record with the regressors of a subsystem that all records contain.

    By name, SI, shape (rows,) each; (2, rows) for a scale.
    """
    waveforms = [regressors(fit, subsystem, r) for r in range(len(fit.model.records))]
    shared = sorted(set.intersection(*(set(c) for c in waveforms)))
    return [
        (record, {name: c[name] for name in shared})
        for record, c in zip(fit.model.records, waveforms, strict=True)
    ]


def concatenated_bins(
    name: str, by_record: Sequence[tuple[Record, Mapping[str, Floats]]]
) -> Floats:
    """Return a regressor in the bins of all records, concatenated, SI, shape (bins,).

    by_record: regressors by name, SI, shape (rows,) each. For a scale, (2, rows), the result is the
    quantity on the abscissa.
    """
    waveforms = (
        (record, s[name][0] if kind_of(name) == SCALE else s[name]) for record, s in by_record
    )
    return np.concatenate([record.grid.binned(z) for record, z in waveforms])


def in_bins(record: Record, knots: Mapping[str, Floats], waveforms: Mapping[str, Floats]) -> Floats:
    """Return the disturbance per knot of each regressor, bin by bin, shape (bins, all knots).

    knots: of each regressor, shape (knots,), SI; waveforms: shape (rows,), or (2, rows) for a
    scale, SI.
    """
    return np.concatenate(
        [_in_bins(record.grid, name, waveforms[name], at) for name, at in knots.items()], axis=1
    )


def _in_bins(grid: Grid, name: str, z: Floats, knots: Floats) -> Floats:
    """Return the disturbance per knot of one regressor, bin by bin, (bins, knots)."""
    kind = kind_of(name)
    if kind not in ("", DETAIL, SCALE):
        return np.stack([grid.binned(c) for c in columns(name, z, knots, grid.step)], axis=1)
    abscissa, by = (z[0], z[1]) if kind == SCALE else (z, None)
    return between_knots(grid, abscissa, knots, by)


def between_knots(grid: Grid, z: Floats, knots: Floats, by: Floats | None = None) -> Floats:
    """Return the bin means of the tent functions of a piecewise linear curve.

    Shape (bins, knots). Only the two knots next to a value have nonzero weight. z: shape (rows,),
    in the unit of the knots; by: factor of the weights, shape (rows,), 1 if not given.
    """
    in_bin = grid.in_bins(z)
    interval = np.clip(np.searchsorted(knots, in_bin, side="right") - 1, 0, knots.size - 2)
    fraction = np.clip((in_bin - knots[interval]) / np.diff(knots)[interval], 0.0, 1.0)
    weight = np.full(in_bin.size, 1.0 / grid.rows_per_bin)
    if by is not None:
        weight = weight * grid.in_bins(by)
    cell = np.repeat(np.arange(grid.bins) * knots.size, grid.rows_per_bin) + interval
    size = grid.bins * knots.size
    shares = np.bincount(cell, weight * (1.0 - fraction), size)
    shares += np.bincount(cell + 1, weight * fraction, size)
    return np.asarray(shares.reshape(grid.bins, knots.size), np.float64)


def effect_of(linear: Linearization, curve: Curve) -> Series:
    """Return the effect response of a curve, unwhitened, (T, m) by output group and record."""
    for disc, _ in discs(linear.fit):
        if disc.name == curve.place:
            return _combined(tooth_columns(linear.fit, disc), curve.values / SIZE)
    place = next(
        p for p in (*places(linear.fit), *sensors_as_places(linear.fit)) if p.name == curve.place
    )
    if place.inputs and curve.kind == TURN:
        simulated = simulated_responses(
            linear.fit, place, curve.regressor, curve.knots, [curve.values]
        )
        return [[one[:, :, 0] if one.size else one for one in block] for block in simulated]
    disturbances = [
        record.grid.binned(curve(z[curve.regressor], record.grid.step))[:, None]
        for record, z in regressors_by_record(linear.fit, place.subsystem)
    ]
    responses = responses_to(impulse_responses(linear.fit, place), disturbances)
    return [[one[:, :, 0] if one.size else one for one in block] for block in responses]


def _combined(columns: Series, values: Floats) -> Series:
    return [[one @ values if one.size else one for one in block] for block in columns]


def responses_along(fit: Fit, place: InjectionPoint, regressor: str, knots: Floats) -> Series:
    """Return the responses of the outputs per knot and unit disturbance, (T, m, knots)."""
    binned = [
        in_bins(record, {regressor: knots}, z)
        for record, z in regressors_by_record(fit, place.subsystem)
    ]
    return responses_to(impulse_responses(fit, place), binned)


def sensors_as_places(fit: Fit) -> list[InjectionPoint]:
    """Return every sensor that may be faulty as an injection point."""
    return [
        InjectionPoint(
            at_sensor(o),
            f"{o} sensor",
            s.unit,
            float(np.std(s.value)) + 1e-3,
            b.subsystem,
            negligible=0.002,
            recorded=True,
        )
        for b in fit.model.partition.groups
        if b.sensors_suspected
        for o in b.outputs
        for s in (fit.model.records[0].sensors[o],)
    ]


def impulse_responses(fit: Fit, place: InjectionPoint, plain: Runs | None = None) -> Series:
    """Return impulse responses, (memory, m); of a sensor, an impulse. plain: see `answers`."""
    if place.inputs:
        return simulated_impulse_responses(fit, place, {} if plain is None else plain)
    found: Series = [[np.empty(0)] * len(fit.model.records) for _ in fit.model.partition.groups]
    for b, block in enumerate(fit.model.partition.groups):
        for j, output in enumerate(block.outputs):
            if place.block == f"{output} sensor":
                impulse = np.zeros((1, len(block.outputs)))
                impulse[0, j] = 1.0
                found[b] = [impulse] * len(fit.model.records)
    return found


def responses_to(impulse: Series, disturbances: list[Floats]) -> Series:
    """Return the responses of all outputs, (T, m, k), to disturbances (bins, k) of each record."""
    return [
        [respond(a, d) if a.size else a for a, d in zip(b, disturbances, strict=True)]
        for b in impulse
    ]


def simulated_responses(
    fit: Fit,
    place: InjectionPoint,
    regressor: str,
    knots: Floats,
    curve_values: Iterable[Floats],
    by_record: RecordRegressors | None = None,
) -> Series:
    """Return the simulated responses of the outputs to curves with these values, (T, m, curves).

    by_record: result of `WhitenedResponses.regressors_of` for the subsystem of the point, if
    available. The tooth pattern is excluded: there, tooth tolerances cannot be distinguished from a
    periodic disturbance.
    """
    model, by_record = (
        fit.model.coarse,
        regressors_by_record(fit, place.subsystem) if by_record is None else by_record,
    )
    system, before = model.at(fit.point), predict(model, fit.point)
    changes = []
    for values in curve_values:
        disturbances = tuple(
            system.input_disturbance(
                place, r, curve_waveform(regressor, s[regressor], knots, values, r.grid.step)
            )
            for r, s in by_record
        )
        effects = (*fit.point.effects, InputDisturbance(place.subsystem, disturbances))
        changes.append(change(model, fit.point, effects, before))
    nothing = [np.empty(0)] * len(model.records)
    return [
        [_side_by_side(parts) for parts in zip(*blocks, strict=True)] if block.order else nothing
        for block, blocks in zip(model.partition.groups, zip(*changes, strict=True), strict=True)
    ]


def _side_by_side(parts: Sequence[Floats]) -> Floats:
    return np.stack(parts, axis=-1) if parts[0].size else parts[0]
