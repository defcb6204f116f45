"""One recorded output, and the same sensor applied to the simulation.

The teeth of a wheel give two outputs: the wheel speed, from which the part that repeats with the
tooth is removed, and the pattern of the teeth, by recorded tooth. Components that are periodic in
the wheel angle are thus compared at the recorded wheel angle.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Protocol, runtime_checkable

import numpy as np
import numpy.typing as npt
from scipy import sparse

from slipbench.identification.mismatch.simulation.quantization import (
    NO_GRID,
    QuantizationGrid,
    fit_quantization,
)
from slipbench.identification.mismatch.simulation.sampling import (
    Grid,
    Matrix,
    at_points,
    interval_means,
    into_bins,
    known_bins,
)
from slipbench.plant.channels import mean_quantised
from slipbench.plant.effects.effect import Effect
from slipbench.plant.sensing import SensorEffect, measure, sensor_effects
from slipbench.plant.update_times import Renewals, renewals, rhythm
from slipbench.protocol.recording.channel import FloatArray

MOVED = 1.5  # quanta between two samples from which a repeated value is not by chance
NEAR = (0.05, 0.08, 0.12, 0.18, 0.27, 0.4)
"""Candidate standard deviations of a simulation before coarse rounding, in steps."""
THE_SAME = 0.02  # share of a step within which the recorded and the effect's step are equal
SMALL_PART = 1e-3  # of a step: finite-difference step for the slope of a rounding
SEGMENT = 3.0  # s, over which a tooth pattern is averaged
Integers = npt.NDArray[np.int_]


@runtime_checkable
class RepeatsFrames(Protocol):
    """An effect that repeats values in its frames."""

    def with_repeats(
        self, known: Renewals, rhythm: float, time: FloatArray, value: FloatArray
    ) -> FloatArray:
        """Return the reported values where it is known which frames were not updated, (k,).

        time: s, of the frames, (k,); value: without this effect, (k,). rhythm: frames from one
        update to the next, 0 if not periodic.
        """
        ...


@runtime_checkable
class Quantizes(Protocol):
    """An effect that rounds values. quantum: in the channel's unit."""

    quantum: float


class Columns(Protocol):
    """Outputs of a simulation: a column by name, one value a row."""

    def __getitem__(self, name: str, /) -> FloatArray:
        """Return a column, (rows,)."""
        ...


@dataclass(frozen=True)
class DelayedColumns:
    """Outputs of a simulation, delayed by some rows."""

    out: Columns
    rows: float

    def __getitem__(self, name: str, /) -> FloatArray:
        """Return a column, (rows,), that begins with the value of its first row."""
        column = self.out[name]
        row = np.arange(column.size)
        return np.asarray(np.interp(row - self.rows, row, column))


@dataclass(frozen=True)
class ExtrapolatedColumns:
    """Outputs of a simulation, extrapolated by a step in one direction of its slopes."""

    out: Columns
    slopes: Columns
    direction: int
    step: float

    def __getitem__(self, name: str, /) -> FloatArray:
        """Return a column, (rows,)."""
        return np.asarray(self.out[name] + self.step * self.slopes[name][:, self.direction])


@dataclass(frozen=True)
class Sensor:
    """name: of the output; value: (bins,) recorded; known: (bins,) False where nothing was.

    observation: matrices by column of the simulation; processing: the last steps, which the
    recorded samples pass through as well. direct: both in one, where no effect acts between them.
    grid: rows of the simulation and bins of the output. time: s, of samples of a point sensor;
    samples_read: their values; repeated: 1 where a sample repeats the value before it;
    update_times: samples from one update to the next, 0 if not periodic; quantization: grid of the
    samples; noise: standard deviation of the white noise before rounding; coarse: whether the grid
    is coarser than stated. offsets: effect of the displacement of every tooth (rad) before the last
    steps. derivatives: derivative of direct, for derivatives of the simulation's columns of shape
    (rows, directions); None: by finite differences.
    """

    name: str
    unit: str
    clock: str
    value: FloatArray
    known: npt.NDArray[np.bool_]
    observation: Mapping[str, Matrix]
    processing: Callable[[FloatArray], FloatArray]
    direct: Callable[[Columns], FloatArray]
    grid: Grid
    offsets: Matrix | None = None
    derivatives: Callable[[Columns, Columns], FloatArray] | None = None
    time: FloatArray | None = None
    samples_read: FloatArray | None = None
    repeated: FloatArray | None = None
    update_times: float = 0.0
    quantization: QuantizationGrid = NO_GRID
    noise: float = 0.0
    coarse: bool = False

    @property
    def teeth(self) -> int:
        """Number of teeth of its disc; 1 without a disc."""
        return 1 if self.offsets is None else int(self.offsets.shape[1])

    def observe(
        self, out: Columns, effects: Iterable[Effect] = (), late: float = 0.0
    ) -> FloatArray:
        """Return the output of the sensor, effects on its channel included, (bins,).

        late: s, clock offset, positive where the clock shows too much. Effects act on the delayed
        values, since a held staircase has no slope by which it could be shifted.
        """
        acting = self._acting(effects)
        if acting:
            observed = _sampled_values(
                self.observation, DelayedColumns(out, late / self.grid.step) if late else out
            )
            return self.processing(self._reported(observed, acting))
        output = self.direct(out)
        return output - late * np.gradient(output, self.grid.width) if late else output

    def observe_derivatives(
        self,
        out: Columns,
        slopes: Columns,
        effects: Iterable[Effect] = (),
        late: float = 0.0,
        step: float = 1.0,
    ) -> FloatArray:
        """Return the derivatives of the output in directions of the simulation.

        Shape (bins, directions). slopes: of its columns, shape (rows, directions). Where an effect
        acts, or without a known derivative, by one finite-difference step in every direction. late:
        clock offset in s, as for `observe`.
        """
        if self.derivatives is None or self._acting(effects):
            base = self.observe(out, effects, late)
            directions = range(next(iter(self._columns(slopes))).shape[1])
            shifted = (ExtrapolatedColumns(out, slopes, d, step) for d in directions)
            columns = [(self.observe(moved, effects, late) - base) / step for moved in shifted]
            return np.column_stack(columns) if columns else np.zeros((base.size, 0))
        output = self.derivatives(out, slopes)
        return output - late * np.gradient(output, self.grid.width, axis=0) if late else output

    def _columns(self, out: Columns) -> list[FloatArray]:
        return [out[column] for column in self.observation]

    def error(self, out: Columns, effects: Iterable[Effect], at: FloatArray) -> FloatArray:
        """Return the error of the reported value by effects on the channel, at given times.

        For a point sensor; zeros for others. at: s since the start, (k,).
        """
        acting = self._acting(effects)
        if not acting or self.time is None:
            return np.zeros(at.size)
        value = _sampled_values(self.observation, out)
        return np.asarray(np.interp(at, self.time, self._reported(value, acting) - value))

    def _acting(self, effects: Iterable[Effect]) -> tuple[SensorEffect, ...]:
        return () if self.time is None else sensor_effects(effects, self.name, "signal", "frame")

    def _reported(self, value: FloatArray, acting: Iterable[SensorEffect]) -> FloatArray:
        """Return the reported values for true values at the sensor's sample times."""
        assert self.time is not None
        remaining: tuple[SensorEffect, ...] = ()
        for effect in acting:
            known = self._as_recorded(effect, value)
            value = value if known is None else known
            remaining += (effect,) if known is None else ()
        return measure(remaining, (), self.time, value)[1]

    def _as_recorded(self, effect: SensorEffect, value: FloatArray) -> FloatArray | None:
        """Return the output of an effect where the recording identifies its action; else None."""
        if self.coarse and self.samples_read is not None and isinstance(effect, Quantizes):
            return self._rounded(effect.quantum, value, self.samples_read)
        if self.repeated is None or self.time is None or not isinstance(effect, RepeatsFrames):
            return None
        known = renewals(value, self.repeated, MOVED * self.quantization.step)
        return (
            None
            if known is None
            else effect.with_repeats(known, self.update_times, self.time, value)
        )

    def _rounded(self, quantum: float, value: FloatArray, recorded: FloatArray) -> FloatArray:
        """Return rounded values, with the noise that fits the recorded samples best.

        Changes from sample to sample are compared: slow drift of a simulation does not count.
        """
        same = abs(quantum / self.quantization.step - 1.0) < THE_SAME
        step = self.quantization.step if same else quantum
        candidates = (
            mean_quantised(
                value, step, max(near * step, self.noise), self.quantization.phase, NEAR[0]
            )
            for near in NEAR
        )
        return min(candidates, key=lambda rounded: float(np.sum(np.diff(recorded - rounded) ** 2)))

    def samples(
        self, out: Columns, effects: Iterable[Effect], late: float, noise: FloatArray
    ) -> FloatArray:
        """Return samples that a point sensor would record of a simulation, (k,) in its unit.

        noise: (k,), added before effects on the channel and before its quantization. late: s, as
        for `observe`.
        """
        acting = self._acting(effects)
        observed = (
            _sampled_values(
                self.observation, DelayedColumns(out, late / self.grid.step) if late else out
            )
            + noise
        )
        reported = self._reported(observed, acting) if acting else observed
        rounds = any(isinstance(e, Quantizes) for e in acting)
        return self.quantization.rounded(reported) if rounds or not self.coarse else reported

    def recording(self, reported: FloatArray) -> "Sensor":
        """Return the sensor with other samples, (k,) in its unit; its quantization is kept."""
        assert self.time is not None
        repeats = _repeats(reported)
        value = into_bins(self.time, self.grid) @ reported
        return replace(
            self, value=value, samples_read=reported, repeated=repeats, update_times=rhythm(repeats)
        )

    def misplaced(self, displacement: FloatArray) -> FloatArray:
        """Return what displaced teeth (rad, by tooth) add to the output; zeros without teeth."""
        if self.offsets is None:
            return np.zeros(self.value.size)
        return self.processing(self.offsets @ displacement)


def _sampled_values(observation: Mapping[str, Matrix], out: Columns) -> FloatArray:
    return np.asarray(sum(m @ out[column] for column, m in observation.items()))


@dataclass(frozen=True)
class Sampled:
    """Samples since the simulation's start. time: (k,) s; value: (k,) SI."""

    time: FloatArray
    value: FloatArray
    clock: str


def point_sensor(
    name: str,
    unit: str,
    column: str,
    factor: float,
    samples: Sampled,
    grid: Grid,
    noise: float = 0.0,
    stated: float = 0.0,
    between: Callable[[FloatArray, Grid], Matrix] = at_points,
) -> Sensor:
    """Return a sensor that samples a column, times a factor, at the times of its samples.

    noise: standard deviation of the white noise of its values before rounding. stated: specified
    quantization step; 0: none. A coarser step is a mismatch. between: interpolation between rows,
    as a matrix (k, rows) for k times in s.
    """
    bins = into_bins(samples.time, grid)
    observation = sparse.csr_array(factor * between(samples.time, grid))
    known = known_bins(samples.time, grid)
    quantization = fit_quantization(samples.value)
    coarse = quantization.coarser_than(stated)
    applied = QuantizationGrid(stated) if coarse else quantization

    def process(values: FloatArray) -> FloatArray:
        return np.asarray(bins @ mean_quantised(values, applied.step, noise, applied.phase))

    combined = sparse.csr_array(bins @ observation)

    def direct(out: Columns) -> FloatArray:
        if applied.step > 0.0:
            return process(observation @ out[column])
        return np.asarray(combined @ out[column])

    def differentiate(out: Columns, slopes: Columns) -> FloatArray:
        if applied.step <= 0.0:
            return np.asarray(combined @ slopes[column])
        values, h = observation @ out[column], SMALL_PART * applied.step
        up, down = (mean_quantised(values + s, applied.step, noise, applied.phase) for s in (h, -h))
        return np.asarray(
            bins @ (((up - down) / (2.0 * h))[:, None] * (observation @ slopes[column]))
        )

    repeats = _repeats(samples.value)
    return Sensor(
        name,
        unit,
        samples.clock,
        bins @ samples.value,
        known,
        {column: observation},
        process,
        direct,
        grid,
        derivatives=differentiate,
        time=samples.time,
        samples_read=samples.value,
        repeated=repeats,
        update_times=rhythm(repeats),
        quantization=quantization,
        noise=noise,
        coarse=coarse,
    )


def _repeats(values: FloatArray) -> FloatArray:
    """Return 1 where a sample exactly repeats the value before it, else 0."""
    return np.concatenate(([0.0], (np.diff(values) == 0.0).astype(float)))


def tooth_sensors(wheel: str, teeth: Sampled, per_turn: int, grid: Grid) -> tuple[Sensor, Sensor]:
    """Return the sensors of a wheel's teeth: its speed, and the pattern of its disc."""
    first = np.flatnonzero((np.diff(teeth.value) == 1) & (np.diff(teeth.time) > 0))
    span = teeth.time[first + 1] - teeth.time[first]
    middle = teeth.time[first] + 0.5 * span
    tooth = teeth.value[first].astype(int) % per_turn
    speed = 2 * np.pi / per_turn / span
    bins = into_bins(middle, grid)
    disc = _disc(middle, tooth, per_turn, np.interp(middle, grid.centre, bins @ speed), grid)
    angle, rate = interval_means(teeth.time, first, grid)
    observation = {f"{wheel}_angle": angle, f"{wheel}_speed": rate}
    offsets = _displacement_matrix(span, tooth, per_turn)

    means = {column: sparse.csr_array(bins @ m) for column, m in observation.items()}
    cells = {column: sparse.csr_array(disc.mean @ m) for column, m in observation.items()}
    back = sparse.csr_array(bins @ disc.back)

    def clean(intervals: FloatArray) -> FloatArray:
        return np.asarray(bins @ intervals - back @ disc.pattern(intervals))

    def direct(out: Columns) -> FloatArray:
        return np.asarray(
            _sampled_values(means, out) - back @ disc.centred(_sampled_values(cells, out))
        )

    def pattern(out: Columns) -> FloatArray:
        return disc.centred(_sampled_values(cells, out))

    def clean_slopes(_: Columns, slopes: Columns) -> FloatArray:
        return direct(slopes)

    def pattern_slopes(_: Columns, slopes: Columns) -> FloatArray:
        return pattern(slopes)

    return (
        Sensor(
            f"{wheel}_teeth",
            "rad/s",
            teeth.clock,
            clean(speed),
            known_bins(middle, grid),
            observation,
            clean,
            direct,
            grid,
            offsets,
            clean_slopes,
        ),
        Sensor(
            f"{wheel}_tooth_pattern",
            "1",
            teeth.clock,
            disc.pattern(speed),
            disc.known,
            observation,
            disc.pattern,
            pattern,
            grid,
            offsets,
            pattern_slopes,
        ),
    )


@dataclass(frozen=True)
class _Disc:
    """Cells of (time segment, tooth). mean: of the relative speed in each, (cells, intervals).

    back: maps a pattern to speeds of the intervals, (intervals, cells).
    """

    mean: Matrix
    back: Matrix
    per_turn: int
    known: npt.NDArray[np.bool_]

    def pattern(self, intervals: FloatArray) -> FloatArray:
        """Mean relative speed of each tooth and segment, less the mean of the segment."""
        return self.centred(self.mean @ intervals)

    def centred(self, cells: FloatArray) -> FloatArray:
        """Return the cells, (cells, ...), less the mean of their segment."""
        table = cells.reshape(-1, self.per_turn, *cells.shape[1:])
        return np.asarray((table - table.mean(axis=1, keepdims=True)).reshape(cells.shape))


def _disc(
    middle: FloatArray, tooth: Integers, per_turn: int, mean_speed: FloatArray, grid: Grid
) -> _Disc:
    end = grid.start + grid.bins * grid.width
    segments = max(int((end - grid.start) / SEGMENT), 1)
    number = np.floor((middle - grid.start) / (end - grid.start) * segments).astype(int)
    inside = (number >= 0) & (number < segments)
    cell = np.where(inside, number * per_turn + tooth, -1)
    kept = np.flatnonzero(inside)
    count = np.bincount(cell[kept], minlength=segments * per_turn)
    weight = 1.0 / count[cell[kept]] / mean_speed[kept]
    mean = sparse.csr_array((weight, (cell[kept], kept)), (count.size, middle.size))
    back = sparse.csr_array((mean_speed[kept], (kept, cell[kept])), (middle.size, count.size))
    return _Disc(mean, back, per_turn, count > 0)


def _displacement_matrix(span: FloatArray, tooth: Integers, per_turn: int) -> Matrix:
    """Measured speed of each interval per displacement of each tooth, positive if it passes late.

    In an interval the wheel turns by the pitch plus (displacement at its end - displacement at its
    start). The measurement assumes the pitch alone, so it is the true speed less that difference.
    """
    lines = np.arange(span.size)
    values = np.concatenate((-1.0 / span, 1.0 / span))
    columns = np.concatenate(((tooth + 1) % per_turn, tooth))
    return sparse.csr_array((values, (np.tile(lines, 2), columns)), (span.size, per_turn))
