"""Ideal observer: log-likelihood gain (nats) of the known hidden effects after recalibration.

For effects of the library: the engine's own fit, started at the truth. For what is in no library:
the true difference that it makes, out of the generator without any noise, off all that calibration
may move. Both with the noise model that fits when the effect is explained.
"""

import math
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from scipy import interpolate

from slipbench.identification.mismatch.fit.calibrate import (
    as_believed,
    calibrate,
    followed,
    strayed,
)
from slipbench.identification.mismatch.fit.candidate import Candidate
from slipbench.identification.mismatch.fit.fitting import Fit, with_effects
from slipbench.identification.mismatch.fit.held_out import carried_over
from slipbench.identification.mismatch.fit.judge import Judge
from slipbench.identification.mismatch.fit.settling import settle
from slipbench.identification.mismatch.fit.sizing import as_shape, as_size, shapes, sizes, wholes
from slipbench.identification.mismatch.fit.stack import flat
from slipbench.identification.mismatch.naming.score import as_recorded
from slipbench.identification.mismatch.naming.tried import half_a_turn_on
from slipbench.identification.mismatch.simulation.model import Model, Series
from slipbench.identification.mismatch.simulation.record import Record
from slipbench.identification.mismatch.simulation.sampling import into_bins
from slipbench.plant.effects.effect import Effect
from slipbench.plant.effects.library import BY_NAME as EFFECTS
from slipbench.plant.errors import PlantError
from slipbench.studies.blind_validation.generator.case import Case
from slipbench.studies.blind_validation.generator.fault_parameters import MotionFaults
from slipbench.studies.blind_validation.generator.fault_types import BY_NAME, SERVO, Hidden
from slipbench.studies.blind_validation.generator.instruments import ChannelFaults, sampled
from slipbench.studies.blind_validation.generator.physics import Floats
from slipbench.studies.blind_validation.generator.recording import (
    FaultSet,
    Trial,
    channel_chance,
    course_of,
)
from slipbench.studies.blind_validation.generator.ride import Course

LEADS_IN = {
    "front": "front_speed",
    "rear": "rear_speed",
    "optical_speed": "optical_speed",
    "engine_speed": "engine_speed",
}
"""Recorded quantities that lead a simulation in, and what they show."""
BY_CHANCE = ("held_frames", "stale_frames")
"""Kinds whose time series no parameter determines: which frames are stale, when a value is updated."""
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


@dataclass(frozen=True)
class Ideal:
    """gain: nats of all hidden effects together; each: of every one, given the others.

    difference: nats of the true difference, with the true formula known; NaN where effects of
    sensors are hidden. fit: with the true effects; None where the library lacks one of them.
    """

    gain: float
    each: tuple[float, ...]
    difference: float = math.nan
    fit: Fit | None = None


def ideal(case: Case, base: Fit) -> Ideal:
    """Gain of the ideal observer for a case. base: fit of the analysis without any effect."""
    if not case.hidden:
        return Ideal(0.0, ())
    if len(case.hidden) == 1 and case.hidden[0].kind in BY_CHANCE:
        gain = sensor_difference(case, base)
        return Ideal(gain, (gain,))
    moves = not any(h.subject for h in case.hidden)
    difference = motion_difference(case, base, case.training) if moves else math.nan
    if all(BY_NAME[h.kind].inside for h in case.hidden):
        return replace(_of_library(case.hidden, base), difference=difference)
    return Ideal(difference, (difference,), difference)


def on_held_out(case: Case, base: Fit, found: Ideal, held_out: Model) -> float:
    """Log-likelihood gain of the true effects on the held-out recordings, nats."""
    before = carried_over(base, held_out)
    if math.isfinite(found.difference):
        return motion_difference(case, before, case.held_out)
    if found.fit is None:
        return math.nan
    return carried_over(found.fit, held_out).score - before.score


def _of_library(hidden: Sequence[Hidden], base: Fit) -> Ideal:
    """Gains of fits with all true effects, and with each left out."""
    candidates = [as_recorded(at_truth(h), base.model) for h in hidden]
    whole = _fitted(base, candidates)
    if whole is None:
        return Ideal(0.0, tuple(0.0 for _ in hidden))
    gain = whole.score - base.score
    if len(candidates) == 1:
        return Ideal(gain, (gain,), fit=whole)
    each = []
    for left_out in candidates:
        less = _fitted(base, [c for c in candidates if c is not left_out])
        each.append(whole.score - (less.score if less else base.score))
    return Ideal(gain, tuple(each), fit=whole)


def _fitted(base: Fit, candidates: Sequence[Candidate]) -> Fit | None:
    """Best of several fits that start at the true effects, with several start angles.

    Angles of rotating parts belong to a recording: an opposite line is half a turn away.
    """
    found = [_fitted_from(base, begun) for begun in product(*map(_either_way_on, candidates))]
    return max((f for f in found if f is not None), key=lambda f: f.score, default=None)


def _either_way_on(candidate: Candidate) -> list[Candidate]:
    turned = half_a_turn_on(candidate) if candidate.kind.unseen_turn else ()
    return [candidate, *turned]


def _fitted_from(base: Fit, candidates: Sequence[Candidate]) -> Fit | None:
    """Better of two fits: started at the engine's calibration, and at the vehicle file."""
    found = []
    with suppress(PlantError):
        found.append(followed(settle(with_effects(base, candidates), noises=2)))
    if strayed(base):
        with suppress(PlantError):
            found.append(followed(settle(as_believed(with_effects(base, candidates)), noises=2)))
    return max(found, key=lambda f: f.score, default=None)


def at_truth(hidden: Hidden) -> Candidate:
    """Effect of the library with the true parameters."""
    pattern = _pattern(EFFECTS[hidden.kind], hidden.subject)
    kind, true = type(pattern), hidden.parameters
    first = sizes(kind)[0]
    size = as_size(first, true[first.name])
    sought = [p.name for p in shapes(kind) if p.sought is not None and p.name in true]
    pattern = replace(pattern, **{name: true[name] for name in sought})
    dials = [
        as_shape(p, p.typical, true[p.name]) if p.name in true and p.sought is None else 0.0
        for p in shapes(kind)
    ]
    whole = tuple(true.get(p.name, p.typical) for p in wholes(kind))
    return Candidate(pattern, (size, *dials), whole)


def _pattern(kind: type[Effect], subject: str) -> Effect:
    found = {c.subject: c for c in kind.candidates()}
    return found[subject] if subject in found else next(iter(found.values()))


@dataclass(frozen=True, eq=False)
class Shown:
    """Trajectory of the generator as columns of the engine's rows. time: s, true."""

    course: Course
    time: Floats

    def __getitem__(self, name: str, /) -> Floats:
        """A column at the rows' ends, SI, shape (T,)."""
        values = getattr(self.course, COLUMNS[name])
        return np.asarray(interpolate.CubicSpline(self.course.time, values)(self.time))


def motion_difference(case: Case, base: Fit, trials: Sequence[Trial]) -> float:
    """Log-likelihood gain of the true difference in the channels, nuisances projected out, nats."""
    model = base.model
    absent = replace(case.faults, motion=MotionFaults())
    there, without = (
        [_shown(case, model, r, t, faults) for r, t in enumerate(trials)]
        for faults in (case.faults, absent)
    )
    places = [h.places == (SERVO,) for h in case.hidden]
    difference: Series = []
    for b, block in enumerate(model.chain.blocks):
        # What the plate does is measured, so that its own secrets are seen in its block alone.
        in_servo = any(places) if block.drive == "servo" else not all(places)
        difference.append(
            [
                (x[b] - y[b]) * (known if in_servo else 0.0)
                for x, y, known in zip(there, without, model.known_bins[b], strict=True)
            ]
        )
    if all(places):
        return _worth(base, difference)
    led = [_led_in(case, model, r, t, absent) for r, t in enumerate(trials)]
    return _worth(base, difference, led)


def _led_in(case: Case, model: Model, r: int, trial: Trial, absent: FaultSet) -> Record:
    """Record with the warm-up of the simulation without hidden effects.

    Otherwise an effect that acts in the first second would start the corrected run at a wrong speed.
    """
    record = model.records[r]
    there, without = (
        Shown(course_of(case.truth, faults, trial, case.faults)[0], record.time + record.start)
        for faults in (case.faults, absent)
    )
    measured = {
        name: value - (there[LEADS_IN[name]] - without[LEADS_IN[name]])
        if name in LEADS_IN
        else value
        for name, value in record.measured.items()
    }
    return replace(record, measured=measured)


def sensor_difference(case: Case, base: Fit) -> float:
    """Log-likelihood gain of the true difference that sensor effects make, without noise, nats."""
    model = base.model
    silent = replace(
        case.truth.noises, throttle=0.0, throttle_quantum=0.0, engine_speed=0.0, optical=0.0
    )
    difference: Series = [[np.zeros(m.shape) for m in ms] for ms in model.measured]
    for r, trial in enumerate(case.training):
        course, _ = course_of(case.truth, case.faults, trial)
        record = model.records[r]
        for channel, hidden in case.faults.sensors.channels.items():
            there, without = (
                sampled(channel, course, silent, t, channel_chance(trial, channel))
                for t in (hidden, ChannelFaults())
            )
            bins = into_bins(there.true - record.start, record.grid)
            for b, block in enumerate(model.chain.blocks):
                if channel in block.outputs:
                    column = block.outputs.index(channel)
                    difference[b][r][:, column] = bins @ (there.value - without.value)
    return _worth(base, difference)


def _shown(case: Case, model: Model, r: int, trial: Trial, faults: FaultSet) -> list[Floats]:
    """Outputs of every output group in a run without noise, each of shape (T, m)."""
    course, _ = course_of(case.truth, faults, trial, case.faults)
    record = model.records[r]
    columns = Shown(course, record.time + record.start)
    return [
        np.column_stack([record.sensors[o].look(columns) for o in b.outputs])
        for b in model.chain.blocks
    ]


def _worth(base: Fit, difference: Series, records: Sequence[Record] | None = None) -> float:
    """Gain of the log-posterior when the difference is subtracted and the model recalibrated.

    What is hidden may have led the first calibration far off, and the file may be far off itself.
    A ride that drifts far away is no longer the same noise beside another course: then the shape of
    the difference tells more, at the size that fits best.
    """
    cleared = replace(base.model, records=tuple(records or base.model.records))
    cleared.__dict__["measured"] = [
        [m - d for m, d in zip(ms, ds, strict=True)]
        for ms, ds in zip(base.model.measured, difference, strict=True)
    ]
    gain = calibrate(cleared, base.point).score - base.score
    if gain <= 0.0:
        gain = calibrate(cleared, cleared.origin()).score - base.score
    return max(gain, _of_its_shape(base, difference))


def _of_its_shape(base: Fit, difference: Series) -> float:
    """Log-likelihood gain of a trajectory of this shape with fitted magnitude, nats."""
    judge = Judge.of(base)
    course = judge.nuisances.off(flat(base.model, base.noise, difference))
    return float(course @ judge.left) ** 2 / max(2.0 * float(course @ course), 1e-300)
