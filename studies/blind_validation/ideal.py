"""Ideal observer: log-likelihood gain (nats) of the known hidden effects after recalibration.

The difference that the hidden effects make is taken out of the generator, whose formulas are the
true ones, without noise, and subtracted from the recordings; then the model of the analysis is
calibrated anew, from the values of its file. No effect of the library is fitted, so that an
observation says nothing about the library.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from scipy import interpolate

from slipbench.identification.mismatch.fit.calibrate import calibrate
from slipbench.identification.mismatch.fit.fitting import Fit
from slipbench.identification.mismatch.fit.held_out import refit_on
from slipbench.identification.mismatch.fit.linearization import Linearization
from slipbench.identification.mismatch.fit.optimize import optimize
from slipbench.identification.mismatch.fit.stack import whiten_and_stack
from slipbench.identification.mismatch.simulation.model import Model, Series, predict
from slipbench.identification.mismatch.simulation.record import Record
from slipbench.identification.mismatch.simulation.sampling import into_bins
from slipbench.identification.mismatch.simulation.sensor import Sensor
from slipbench.studies.blind_validation.generator.case import Case, secret_of
from slipbench.studies.blind_validation.generator.fault_type import SERVO
from slipbench.studies.blind_validation.generator.fault_types import BY_NAME, Hidden
from slipbench.studies.blind_validation.generator.filters import LAG, filtered
from slipbench.studies.blind_validation.generator.instruments import (
    TEETH,
    ChannelFaults,
    hidden_errors,
    sampled,
)
from slipbench.studies.blind_validation.generator.physics import Floats
from slipbench.studies.blind_validation.generator.recording import Trial, channel_chance, course_of
from slipbench.studies.blind_validation.generator.ride import Course
from slipbench.studies.blind_validation.generator.vehicle_file import Truth

LEADS_IN = {
    "front": "front_speed",
    "rear": "rear_speed",
    "optical_speed": "optical_speed",
    "engine_speed": "engine_speed",
}
"""Recorded quantities that lead a simulation in, and what they show."""
COLUMNS = {
    "throttle": "plate",
    "engine_speed": "crank_speed",
    "rear_angle": "wheel",
    "rear_speed": "wheel_speed",
    "front_angle": "front",
    "front_speed": "front_speed",
    "optical_speed": "optical",
    "speed": "speed",
}
CHANNELS = {"throttle": "throttle_position"}
"""Channels of columns that bear another name."""
QUADRATURE = np.pi / 4.0
"""Angle of the crank by which the second order is a quarter of its period ahead, rad."""
Effects = tuple[Hidden, ...]


@dataclass(frozen=True)
class Ideal:
    """gain: nats of all hidden effects together; each: of every one, given the others."""

    gain: float
    each: tuple[float, ...]


def ideal(case: Case, base: Fit) -> Ideal:
    """Gain of the ideal observer for a case. base: fit of the analysis without any effect."""
    if not case.hidden:
        return Ideal(0.0, ())
    observer = Observer(case, case.training)
    whole = observer.fitted(base, case.hidden)
    if len(case.hidden) == 1:
        gain = observer.worth(base, case.hidden, whole)
        return Ideal(gain, (gain,))
    others = [tuple(h for h in case.hidden if h is not one) for one in case.hidden]
    fits = [
        max(observer.fitted(base, known), observer.fitted(base, known, whole), key=_score)
        for known in others
    ]
    # Who knows more cannot gain less: a fit that does has stopped on its way.
    further = [observer.fitted(base, case.hidden, f) for f in fits if f.score > whole.score]
    whole = max((whole, *further), key=_score)
    known = [observer.worth(base, k, f) for k, f in zip(others, fits, strict=True)]
    gain = max(observer.worth(base, case.hidden, whole), *known)
    return Ideal(gain, tuple(gain - k for k in known))


def _score(fit: Fit) -> float:
    return fit.score


def on_held_out(case: Case, base: Fit, held_out: Model) -> float:
    """Log-likelihood gain of the true effects on the held-out recordings, nats."""
    return Observer(case, case.held_out).worth(refit_on(base, held_out), case.hidden)


@dataclass(frozen=True, eq=False)
class Shown:
    """Trajectory of the generator as columns of the engine's rows. time: s, true."""

    truth: Truth
    course: Course
    time: Floats

    def __getitem__(self, name: str, /) -> Floats:
        """A column at the rows' ends, SI, shape (T,)."""
        trajectory, values = self.course, getattr(self.course, COLUMNS[name])
        own = self.truth.filters.get(CHANNELS.get(name, name))
        if own and own.kind == LAG:
            values = filtered(values, float(trajectory.time[1] - trajectory.time[0]), own)
        return np.asarray(interpolate.CubicSpline(trajectory.time, values)(self.time))


def crank_angle(course: Course) -> Floats:
    """Angle of the crank since the start at each row of a simulated run, rad, (T,)."""
    mean = 0.5 * (course.crank_speed[1:] + course.crank_speed[:-1])
    return np.concatenate([[0.0], np.cumsum(mean * np.diff(course.time))])


@dataclass(frozen=True, eq=False)
class Observer:
    """Changes by hidden effects in the trials of a case. rides: those simulated so far."""

    case: Case
    trials: Sequence[Trial]
    rides: dict[tuple[int, tuple[str, ...] | None], Course] = field(default_factory=dict)

    def worth(self, base: Fit, known: Effects, fit: Fit | None = None) -> float:
        """Log-likelihood gain of a fit to recordings without the known effects, nats.

        fit: that fit, if there is one. Where another trajectory of the ride makes it worse, the
        shape of the difference counts, at the magnitude that fits best; if it goes with an angle, at
        the phase that fits best, since clocks are off by a part of a turn.
        """
        found = fit or self.fitted(base, known)
        absent = self._absent(known)
        angles = (0.0, QUADRATURE) if self._by_angle else (0.0,)
        shapes = [self.difference(base.model, absent, ahead) for ahead in angles]
        return max(found.score - base.score, of_shapes(base, shapes))

    def fitted(self, base: Fit, known: Effects, start: Fit | None = None) -> Fit:
        """Fit to the recordings without the known effects: a calibration, or from another fit."""
        absent = self._absent(known)
        difference = self.difference(base.model, absent)
        records = [self.led_in(r, i, absent) for i, r in enumerate(base.model.records)]
        cleared = replace(base.model, records=tuple(records))
        cleared.__dict__["measured"] = [
            [m - d for m, d in zip(ms, ds, strict=True)]
            for ms, ds in zip(base.model.measured, difference, strict=True)
        ]
        if start is None:  # the effect may have held the base far from the truth
            return calibrate(cleared, cleared.origin())
        predicted = predict(cleared, start.point)
        begun = Fit(cleared, start.point, predicted, start.noise, start.slopes)
        return optimize(replace(begun, slopes_at=start.taken_at))

    def _absent(self, known: Effects) -> Effects:
        return tuple(h for h in self.case.hidden if h not in known)

    def ride(self, r: int, effects: Effects) -> Course:
        """Simulated run of a trial with some of the hidden effects, without bumps and combustion noise.

        An effect changes the response to them, which no recording shows: they would not cancel in a
        difference. Wind and grade stay, since the motion that they cause is recorded.
        """
        key = r, tuple(h.key for h in effects if not h.subject)
        if key not in self.rides:
            trial, faults = self.trials[r], secret_of(effects)
            still = replace(trial, roughness=replace(trial.roughness, bump=0.0, combustion=0.0))
            self.rides[key], _ = course_of(self.case.truth, faults, still, self.case.faults)
        return self.rides[key]

    def recorded(self, r: int) -> Course:
        """Simulated run of a trial as it was recorded."""
        if (r, None) not in self.rides:
            self.rides[r, None] = course_of(self.case.truth, self.case.faults, self.trials[r])[0]
        return self.rides[r, None]

    @property
    def _by_angle(self) -> bool:
        return any(BY_NAME[h.kind].by_angle for h in self.case.hidden)

    def difference(self, model: Model, absent: Effects, ahead: float = 0.0) -> Series:
        """Contribution of the effects that are not absent to the recordings.

        (T, m) by output group and record, in the unit of each output. What the plate does is
        measured, so effects of the servo appear in its group alone. ahead: rad, by which the crank is
        ahead of the recording, for effects that go with its angle.
        """
        hidden = self.case.hidden
        servo = tuple(h for h in hidden if h in absent or h.places == (SERVO,))
        found: Series = []
        for b, block in enumerate(model.partition.groups):
            without = absent if block.subsystem == "servo" else servo
            found.append([])
            for r, record in enumerate(model.records):
                there, bare = (self._shown(r, record, e, ahead) for e in (hidden, without))
                change = np.column_stack(
                    [
                        record.sensors[o].observe(there) - record.sensors[o].observe(bare)
                        for o in block.outputs
                    ]
                )
                for column, channel in enumerate(block.outputs):
                    change[:, column] += self._of_channel(r, record, channel, absent)
                    change[:, column] += self._of_disc(record.sensors[channel], absent)
                found[b].append(change * model.known_bins[b][r])
        return found

    def _shown(self, r: int, record: Record, effects: Effects, ahead: float = 0.0) -> Shown:
        return Shown(self.case.truth, self.ride(r, effects), self._time(r, record, ahead))

    def _time(self, r: int, record: Record, ahead: float) -> Floats:
        """Time in the rides of each row, s, (T,): that of the row, or where the crank is as recorded.

        Bumps and combustion noise move the crank by radians within seconds. What an effect does at an
        angle, it does in the recording when the crank has that angle there.
        """
        time = record.time + record.start
        if not self._by_angle:
            return time
        ride, recorded = self.ride(r, self.case.hidden), self.recorded(r)
        turned = ahead + np.interp(time, recorded.time, crank_angle(recorded))
        return np.interp(turned, crank_angle(ride), ride.time)

    def _of_disc(self, sensor: Sensor, absent: Effects) -> Floats | float:
        """Change that hidden effects of a toothed disc make in its output, shape (T,); 0: none."""
        wheel = sensor.name.partition("_")[0]
        there, bare = (f.sensors.discs.get(wheel) for f in (self.case.faults, secret_of(absent)))
        if sensor.offsets is None or there == bare:
            return 0.0
        late = [hidden_errors(disc) if disc else np.zeros(TEETH) for disc in (there, bare)]
        return sensor.misplaced(late[0] - late[1])

    def _of_channel(self, r: int, record: Record, channel: str, absent: Effects) -> Floats | float:
        """Change that hidden effects of a channel make in its bins, shape (T,); 0: none.

        Without noise and rounding of the device, which no recording shows apart from the value.
        """
        case, trial = self.case, self.trials[r]
        channels = (f.sensors.channels for f in (case.faults, secret_of(absent)))
        there, bare = (c.get(channel, ChannelFaults()) for c in channels)
        if there == bare:
            return 0.0
        trajectory, own = self.recorded(r), case.truth.filters.get(channel)
        silent = replace(
            case.truth.noises, throttle=0.0, throttle_quantum=0.0, engine_speed=0.0, optical=0.0
        )
        with_it, without = (
            sampled(channel, trajectory, silent, faults, channel_chance(trial, channel), own)
            for faults in (there, bare)
        )
        bins = into_bins(with_it.true - record.start, record.grid)
        return np.asarray(bins @ (with_it.value - without.value))

    def led_in(self, record: Record, r: int, absent: Effects) -> Record:
        """Record with the warm-up of the simulation without the effects.

        Otherwise an effect that acts in the first second would start the corrected run at a wrong
        speed.
        """
        there, bare = (self._shown(r, record, e) for e in (self.case.hidden, absent))
        measured = {
            name: value - (there[LEADS_IN[name]] - bare[LEADS_IN[name]])
            if name in LEADS_IN
            else value
            for name, value in record.measured.items()
        }
        return replace(record, measured=measured)


def of_shapes(base: Fit, shapes: Sequence[Series]) -> float:
    """Log-likelihood gain of trajectories of these shapes with fitted magnitudes, nats."""
    linear = Linearization.of(base)
    whitened = [whiten_and_stack(base.model, base.noise, shape) for shape in shapes]
    projected = np.column_stack([linear.nuisances.project_out(one) for one in whitened])
    size, *_ = np.linalg.lstsq(projected, linear.residuals, rcond=None)
    return 0.5 * float(np.sum((projected @ size) ** 2))
