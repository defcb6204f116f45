"""One recorded output, and the same sensor put on the simulation.

A wheel's teeth give two outputs: the speed of the wheel, from which what repeats with the tooth is
taken off, and the pattern of the teeth itself, by the recorded tooth. What is periodic in the
recorded wheel angle is so judged at the recorded wheel angle.
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

MOVED = 1.5  # quanta between two samples from which on telling a value again is no chance
NEAR = (0.05, 0.08, 0.12, 0.18, 0.27, 0.4)
"""Of a coarse step, how near a simulation may come to what was rounded."""
THE_SAME = 0.02  # share of a step within which a recording's own steps are meant
SMALL_PART = 1e-3  # of a step, over which the slope of a rounding is taken
SEGMENT = 3.0  # s, over which a tooth pattern is averaged
Integers = npt.NDArray[np.int_]


@runtime_checkable
class ToldAgain(Protocol):
    """An effect that repeats values in its frames."""

    def with_repeats(
        self, known: Renewals, rhythm: float, time: FloatArray, value: FloatArray
    ) -> FloatArray:
        """Return what it tells where it is known which frames were not renewed."""
        ...


@runtime_checkable
class Rounds(Protocol):
    """An effect that tells whole steps, in the channel's unit."""

    quantum: float


class Columns(Protocol):
    """What a simulation did: a column by name, one value a row."""

    def __getitem__(self, name: str, /) -> FloatArray:
        """Return a column, (rows,)."""
        ...


@dataclass(frozen=True)
class Later:
    """What a simulation did, some rows later."""

    out: Columns
    rows: float

    def __getitem__(self, name: str, /) -> FloatArray:
        """Return a column, (rows,), that begins with what there was in its first row."""
        column = self.out[name]
        place = np.arange(column.size)
        return np.asarray(np.interp(place - self.rows, place, column))


@dataclass(frozen=True)
class Moved:
    """What a simulation would do a step further in one direction of its slopes."""

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

    observation: matrices by column of the simulation; processing: the last steps, which the recorded samples go
    through as well. direct: both in one, where no effect acts between them. grid: the rows that it
    sees and the bins that it fills. time: s, of samples of a point sensor; samples_read: by them; repeated: 1
    where they told a value again; lattice: steps of what is told; noise: deviation of the white
    noise before it was rounded; coarse: whether the steps are coarser than promised. offsets: what
    the displacement of every tooth (rad) does before the last steps. derivatives: derivative of direct
    where the simulation's columns change by others, of shape (rows, directions); None: by differences.
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
        """Number of teeth of the disc that it reads; 1 where it reads none."""
        return 1 if self.offsets is None else int(self.offsets.shape[1])

    def observe(
        self, out: Columns, effects: Iterable[Effect] = (), late: float = 0.0
    ) -> FloatArray:
        """Return what the sensor shows, effects on its channel included, (bins,).

        late: s by which its clock tells more than it should. An effect finds what was late already:
        stairs that are held have no slope by which they could be moved.
        """
        acting = self._acting(effects)
        if acting:
            seen = _seen(self.observation, Later(out, late / self.grid.step) if late else out)
            return self.processing(self._told(seen, acting))
        shown = self.direct(out)
        return shown - late * np.gradient(shown, self.grid.width) if late else shown

    def observe_derivatives(
        self,
        out: Columns,
        slopes: Columns,
        effects: Iterable[Effect] = (),
        late: float = 0.0,
        step: float = 1.0,
    ) -> FloatArray:
        """Return how what the sensor shows changes with the simulation, (bins, directions).

        slopes: of its columns, (rows, directions). Where an effect acts, or nothing else is known,
        it is looked at twice, a step apart in every direction.
        """
        if self.derivatives is None or self._acting(effects):
            base = self.observe(out, effects, late)
            directions = range(next(iter(self._columns(slopes))).shape[1])
            there = (Moved(out, slopes, d, step) for d in directions)
            changed = [(self.observe(moved, effects, late) - base) / step for moved in there]
            return np.column_stack(changed) if changed else np.zeros((base.size, 0))
        shown = self.derivatives(out, slopes)
        return shown - late * np.gradient(shown, self.grid.width, axis=0) if late else shown

    def _columns(self, out: Columns) -> list[FloatArray]:
        return [out[column] for column in self.observation]

    def error(self, out: Columns, effects: Iterable[Effect], at: FloatArray) -> FloatArray:
        """Return by how much effects on its channel make the sensor tell too much, at given times.

        For a point sensor; at: s since the start, (k,).
        """
        acting = self._acting(effects)
        if not acting or self.time is None:
            return np.zeros(at.size)
        value = _seen(self.observation, out)
        return np.asarray(np.interp(at, self.time, self._told(value, acting) - value))

    def _acting(self, effects: Iterable[Effect]) -> tuple[SensorEffect, ...]:
        return () if self.time is None else sensor_effects(effects, self.name, "signal", "frame")

    def _told(self, value: FloatArray, acting: Iterable[SensorEffect]) -> FloatArray:
        """Return what is told of the values at the sensor's instants."""
        assert self.time is not None
        left: tuple[SensorEffect, ...] = ()
        for effect in acting:
            known = self._as_recorded(effect, value)
            value = value if known is None else known
            left += (effect,) if known is None else ()
        return measure(left, (), self.time, value)[1]

    def _as_recorded(self, effect: SensorEffect, value: FloatArray) -> FloatArray | None:
        """Return what an effect makes of values where the recording tells what it did there."""
        if self.coarse and self.samples_read is not None and isinstance(effect, Rounds):
            return self._rounded(effect.quantum, value, self.samples_read)
        if self.repeated is None or self.time is None or not isinstance(effect, ToldAgain):
            return None
        known = renewals(value, self.repeated, MOVED * self.quantization.step)
        return (
            None
            if known is None
            else effect.with_repeats(known, self.update_times, self.time, value)
        )

    def _rounded(self, quantum: float, value: FloatArray, told: FloatArray) -> FloatArray:
        """Round values on the recording's own steps, as sharply as that tells what was told.

        From one sample to the next: a simulation may drift for long and be sharp all the same.
        """
        own = abs(quantum / self.quantization.step - 1.0) < THE_SAME
        step = self.quantization.step if own else quantum
        tried = (
            mean_quantised(
                value, step, max(near * step, self.noise), self.quantization.phase, NEAR[0]
            )
            for near in NEAR
        )
        return min(tried, key=lambda shown: float(np.sum(np.diff(told - shown) ** 2)))

    def samples(
        self, out: Columns, effects: Iterable[Effect], late: float, noise: FloatArray
    ) -> FloatArray:
        """Samples that a point sensor would have recorded of a simulation, (k,) in its unit.

        noise: (k,), added before effects on the channel and before the steps of the channel. late:
        s, as for `look`.
        """
        acting = self._acting(effects)
        seen = _seen(self.observation, Later(out, late / self.grid.step) if late else out) + noise
        told = self._told(seen, acting) if acting else seen
        rounds = any(isinstance(e, Rounds) for e in acting)
        return self.quantization.rounded(told) if rounds or not self.coarse else told

    def recording(self, told: FloatArray) -> "Sensor":
        """The same point sensor with other samples, (k,) in its unit; its steps are kept."""
        assert self.time is not None
        again = _again(told)
        value = into_bins(self.time, self.grid) @ told
        return replace(
            self, value=value, samples_read=told, repeated=again, update_times=rhythm(again)
        )

    def misplaced(self, displacement: FloatArray) -> FloatArray:
        """Return what displaced teeth (rad, by tooth) add to the output; zeros without teeth."""
        if self.offsets is None:
            return np.zeros(self.value.size)
        return self.processing(self.offsets @ displacement)


def _seen(see: Mapping[str, Matrix], out: Columns) -> FloatArray:
    return np.asarray(sum(m @ out[column] for column, m in see.items()))


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
    promised: float = 0.0,
    between: Callable[[FloatArray, Grid], Matrix] = at_points,
) -> Sensor:
    """Make a sensor that shows a column, times a factor, at its instants.

    noise: deviation of the white noise that its values had before they were rounded. promised:
    steps in which they should be told; 0: nobody told. Coarser ones are something missing. between:
    how instants between the rows are read.
    """
    bins = into_bins(samples.time, grid)
    see = sparse.csr_array(factor * between(samples.time, grid))
    known = known_bins(samples.time, grid)
    quantization = fit_quantization(samples.value)
    coarse = quantization.coarser_than(promised)
    usual = QuantizationGrid(promised) if coarse else quantization

    def then(values: FloatArray) -> FloatArray:
        return np.asarray(bins @ mean_quantised(values, usual.step, noise, usual.phase))

    at_once = sparse.csr_array(bins @ see)

    def direct(out: Columns) -> FloatArray:
        if usual.step > 0.0:
            return then(see @ out[column])
        return np.asarray(at_once @ out[column])

    def along(out: Columns, slopes: Columns) -> FloatArray:
        if usual.step <= 0.0:
            return np.asarray(at_once @ slopes[column])
        values, h = see @ out[column], SMALL_PART * usual.step
        up, down = (mean_quantised(values + s, usual.step, noise, usual.phase) for s in (h, -h))
        return np.asarray(bins @ (((up - down) / (2.0 * h))[:, None] * (see @ slopes[column])))

    again = _again(samples.value)
    return Sensor(
        name,
        unit,
        samples.clock,
        bins @ samples.value,
        known,
        {column: see},
        then,
        direct,
        grid,
        derivatives=along,
        time=samples.time,
        samples_read=samples.value,
        repeated=again,
        update_times=rhythm(again),
        quantization=quantization,
        noise=noise,
        coarse=coarse,
    )


def _again(values: FloatArray) -> FloatArray:
    """Return 1 where a sample tells exactly what the one before it told."""
    return np.concatenate(([0.0], (np.diff(values) == 0.0).astype(float)))


def tooth_sensors(wheel: str, teeth: Sampled, per_turn: int, grid: Grid) -> tuple[Sensor, Sensor]:
    """Make the sensors of a wheel's teeth: its speed, and the pattern of its disc."""
    first = np.flatnonzero((np.diff(teeth.value) == 1) & (np.diff(teeth.time) > 0))
    span = teeth.time[first + 1] - teeth.time[first]
    middle = teeth.time[first] + 0.5 * span
    tooth = teeth.value[first].astype(int) % per_turn
    speed = 2 * np.pi / per_turn / span
    bins = into_bins(middle, grid)
    disc = _disc(middle, tooth, per_turn, np.interp(middle, grid.centre, bins @ speed), grid)
    angle, rate = interval_means(teeth.time, first, grid)
    see = {f"{wheel}_angle": angle, f"{wheel}_speed": rate}
    late = _late(span, tooth, per_turn)

    means = {column: sparse.csr_array(bins @ m) for column, m in see.items()}
    cells = {column: sparse.csr_array(disc.mean @ m) for column, m in see.items()}
    back = sparse.csr_array(bins @ disc.back)

    def clean(intervals: FloatArray) -> FloatArray:
        return np.asarray(bins @ intervals - back @ disc.pattern(intervals))

    def direct(out: Columns) -> FloatArray:
        return np.asarray(_seen(means, out) - back @ disc.centred(_seen(cells, out)))

    def pattern(out: Columns) -> FloatArray:
        return disc.centred(_seen(cells, out))

    def clean_along(_: Columns, slopes: Columns) -> FloatArray:
        return direct(slopes)

    def pattern_along(_: Columns, slopes: Columns) -> FloatArray:
        return pattern(slopes)

    return (
        Sensor(
            f"{wheel}_teeth",
            "rad/s",
            teeth.clock,
            clean(speed),
            known_bins(middle, grid),
            see,
            clean,
            direct,
            grid,
            late,
            clean_along,
        ),
        Sensor(
            f"{wheel}_tooth_pattern",
            "1",
            teeth.clock,
            disc.pattern(speed),
            disc.known,
            see,
            disc.pattern,
            pattern,
            grid,
            late,
            pattern_along,
        ),
    )


@dataclass(frozen=True)
class _Disc:
    """Cells of (segment of time, tooth). mean: of the relative speed in each, (cells, intervals).

    back: puts a pattern back onto the intervals that it came from, as speeds, (intervals, cells).
    """

    mean: Matrix
    back: Matrix
    per_turn: int
    known: npt.NDArray[np.bool_]

    def pattern(self, intervals: FloatArray) -> FloatArray:
        """Mean relative speed over each tooth and segment, less the segment's own mean."""
        return self.centred(self.mean @ intervals)

    def centred(self, cells: FloatArray) -> FloatArray:
        """Return the cells, (cells, ...), less the mean of their segment."""
        table = cells.reshape(-1, self.per_turn, *cells.shape[1:])
        return np.asarray((table - table.mean(axis=1, keepdims=True)).reshape(cells.shape))


def _disc(
    middle: FloatArray, tooth: Integers, per_turn: int, usual: FloatArray, grid: Grid
) -> _Disc:
    end = grid.start + grid.bins * grid.width
    segments = max(int((end - grid.start) / SEGMENT), 1)
    number = np.floor((middle - grid.start) / (end - grid.start) * segments).astype(int)
    inside = (number >= 0) & (number < segments)
    cell = np.where(inside, number * per_turn + tooth, -1)
    places = np.flatnonzero(inside)
    count = np.bincount(cell[places], minlength=segments * per_turn)
    weight = 1.0 / count[cell[places]] / usual[places]
    mean = sparse.csr_array((weight, (cell[places], places)), (count.size, middle.size))
    back = sparse.csr_array((usual[places], (places, cell[places])), (middle.size, count.size))
    return _Disc(mean, back, per_turn, count > 0)


def _late(span: FloatArray, tooth: Integers, per_turn: int) -> Matrix:
    """Speed seen over each interval per displacement of each tooth: a late tooth ends it late.

    The recorded wheel has turned by the pitch plus (late at its end - late at its start); it is
    read as if it had turned by the pitch, so what is seen is the true speed less that.
    """
    lines = np.arange(span.size)
    values = np.concatenate((-1.0 / span, 1.0 / span))
    columns = np.concatenate(((tooth + 1) % per_turn, tooth))
    return sparse.csr_array((values, (np.tile(lines, 2), columns)), (span.size, per_turn))
