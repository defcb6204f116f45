"""Prior plausibility, which ranks effects that recordings cannot distinguish.

Each prior is a statement about vehicles and benches that needs no recording, with its reason. It
never overrules evidence: only effects within the margin of a tie are sorted, and all of them stay
listed, with the reason against them.
"""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from slipbench.identification.mismatch.curves.trace import regressors
from slipbench.identification.mismatch.fit.candidate import Candidate
from slipbench.identification.mismatch.fit.fitting import Fit
from slipbench.identification.mismatch.simulation.sensor import Sensor
from slipbench.identification.mismatch.thresholds import (
    CLOCK_DRIFT,
    HELD_SHARE,
    REST_SHARE,
    REST_TIME,
)
from slipbench.identification.signals.clocks import BUS
from slipbench.plant.signals import Floats

SENSORS = ("optical_sensor", "encoder", "channel")
"""Blocks of the motorcycle that only measure."""
OF_A_READING = ("offset", "scale", "reversed_sign")
"""Effects at an input that mean an error of its recording."""


@dataclass(frozen=True)
class Prior:
    """A prior reason. rank: its weight; doubts: whether it speaks against an effect."""

    reason: str
    rank: int
    doubts: Callable[[Candidate, Fit], bool]


def doubts(candidate: Candidate, fit: Fit) -> list[Prior]:
    """List the priors against an effect, largest weight first."""
    return [p for p in PRIORS if p.doubts(candidate, fit)]


def rank(fit: Fit, shared: int) -> int:
    """Largest weight of the priors against effects of a fit after the first `shared`; 0: none."""
    added = [c for c in fit.candidates[shared:] if isinstance(c, Candidate)]
    return max((p.rank for c in added for p in doubts(c, fit)), default=0)


def plausible_first(fits: Iterable[Fit], shared: int, margin: float) -> Iterator[Fit]:
    """Yield fits, best first, so that ties with the best are in order of plausibility.

    fits: best first; those beyond the margin are taken one by one. shared: number of effects common
    to all; margin: of a tie, nats.
    """
    remaining = iter(fits)
    best = next(remaining, None)
    if best is None:
        return
    ties: list[Fit] = [best]
    others: list[Fit] = []
    for fit in remaining:
        near = best.score - fit.score < margin
        same_number = len(fit.candidates) == len(best.candidates)
        (ties if near and same_number else others).append(fit)
        if not near:
            break
    yield from sorted(ties, key=lambda f: rank(f, shared))
    yield from others
    yield from remaining


def _kind_of_place(candidate: Candidate) -> str:
    return str(getattr(getattr(candidate.kind, "place", None), "kind", ""))


def _of_a_sensor(candidate: Candidate, _: Fit) -> bool:
    return candidate.kind.block in SENSORS or _kind_of_place(candidate) == "output"


def _sensors(candidate: Candidate, fit: Fit) -> list[Sensor]:
    subject = candidate.pattern.subject.partition("/")[0]
    return [r.sensors[subject] for r in fit.model.records if subject in r.sensors]


def _of_the_one_clock(candidate: Candidate, fit: Fit) -> bool:
    sensors = _sensors(candidate, fit)
    return _of_a_clock(candidate) and bool(sensors) and all(s.clock == BUS for s in sensors)


def _of_a_clock(candidate: Candidate) -> bool:
    return candidate.kind.name in ("clock_offset", "clock_drift")


def _too_fast(candidate: Candidate, _: Fit) -> bool:
    if candidate.kind.name != "clock_drift":
        return False
    effect = candidate.effect()
    return any(abs(getattr(effect, p.name)) > CLOCK_DRIFT for p in candidate.kind.parameters())


def _not_at_rest(candidate: Candidate, fit: Fit) -> bool:
    if candidate.kind.name != "offset" or _kind_of_place(candidate) != "output":
        return False
    offset = abs(float(getattr(candidate.effect(), candidate.kind.parameters()[0].name)))
    return any(_is_at_rest(s, REST_SHARE * offset) for s in _sensors(candidate, fit))


def _is_at_rest(sensor: Sensor, threshold: float) -> bool:
    """Return whether a sensor reads zero for some time."""
    count = max(round(REST_TIME / sensor.grid.width), 2)
    quiet: Floats = (sensor.known & (np.abs(sensor.value) < threshold)).astype(float)
    return bool(quiet.size >= count and np.convolve(quiet, np.ones(count), "valid").max() >= count)


def _leak_of_a_speed(candidate: Candidate, _: Fit) -> bool:
    """Return whether the leaking quantity is a speed: its rate has the unit of an acceleration."""
    unit = str(getattr(getattr(candidate.kind, "place", None), "unit", ""))
    return candidate.kind.name == "linear_loss" and unit.endswith("/s/s")


def _of_a_computed_input(candidate: Candidate, fit: Fit) -> bool:
    if _kind_of_place(candidate) != "input" or candidate.kind.name not in OF_A_READING:
        return False
    name = candidate.pattern.subject.partition("/")[0].replace("_", " ")
    subsystem = next(iter(fit.model.partition.subsystems))
    return all(
        _mostly_repeated(record.grid.binned(regressors(fit, subsystem, r)[name]))
        for r, record in enumerate(fit.model.records)
    )


def _mostly_repeated(bins: Floats) -> bool:
    """Return whether most bins repeat the previous value, unlike a measurement."""
    return bool(np.mean(np.abs(np.diff(bins)) <= 1e-9 * np.ptp(bins)) > HELD_SHARE)


PRIORS = (
    Prior("all channels of this recording share one clock", 3, _of_the_one_clock),
    Prior("no clock drifts by more than 1e-3", 3, _too_fast),
    Prior("an offset of the sensor would be seen at rest, where it reads zero", 3, _not_at_rest),
    Prior("a computed input does not err", 2, _of_a_computed_input),
    Prior("a speed is lost to friction, not by leakage", 1, _leak_of_a_speed),
    Prior("a fault of a sensor is rarer than physics that explains as much", 1, _of_a_sensor),
)
