"""Verdict of the quick look: the first rule that applies decides, and gives its reason.

good             the run counts
repeat           something disturbed it: ride the same once more
other amplitude  the same again would give the same; the proposed amplitude would not. The run counts
                 unless the trial tripped or the actuator was at its stop
go on            it counts as far as its reason says; neither repetition nor amplitude would help
"""

from collections.abc import Callable
from typing import Literal, NamedTuple

from slipbench.identification.session.margins import OF_THE_MOTORCYCLE
from slipbench.identification.session.measures import Measures
from slipbench.identification.session.thresholds import THRESHOLDS, Thresholds
from slipbench.identification.signals.trial_window import trip_in_words
from slipbench.protocol.codec.messages import TripReason

BY_AMPLITUDE = frozenset({"slip", "front_wheel", "engine_speed", "amplitude", "range", "rate"})


class Verdict(NamedTuple):
    """Verdict and its reason.

    counts     whether the run may be pooled with others
    amplitude  that is proposed, as a trial file has it; "" where none is
    """

    word: Literal["good", "repeat", "other amplitude", "go on"]
    reason: str
    counts: bool = True
    amplitude: str = ""


Rule = Callable[[Measures, Thresholds], Verdict | None]


def verdict(of: Measures, bounds: Thresholds = THRESHOLDS) -> Verdict:
    """Verdict on a run, by the rules in their order."""
    for rule in RULES:
        found = rule(of, bounds)
        if found is not None:
            return found
    return Verdict("good", _summary(of))


def _tripped_by_amplitude(of: Measures, bounds: Thresholds) -> Verdict | None:
    if of.trip not in BY_AMPLITUDE:
        return None
    return _other(of, bounds.lowered.value, f"it tripped: {of.detail or of.trip}", counts=False)


def _tripped(of: Measures, _: Thresholds) -> Verdict | None:
    if not of.trip:
        return None
    try:
        words = trip_in_words(TripReason[of.trip.upper()])
    except KeyError:
        words = of.trip
    return _repeat(f"it tripped: {words} ({of.detail})")


def _late(of: Measures, _: Thresholds) -> Verdict | None:
    return _repeat(f"its timing is invalid: {of.late}") if of.late else None


def _clipped(of: Measures, bounds: Thresholds) -> Verdict | None:
    if of.clipping <= bounds.clipping.value:
        return None
    why = f"the actuator was at its stop for {of.clipping:.1%} of the excitation"
    return _other(of, bounds.lowered.value, why, counts=False)


def _near_a_limit(of: Measures, bounds: Thresholds) -> Verdict | None:
    near = {
        name: of.margins[name]
        for name in OF_THE_MOTORCYCLE
        if of.margins.get(name, 1.0) < bounds.margin.value
    }
    if not near:
        return None
    name, margin = min(near.items(), key=lambda item: item[1])
    why = f"only {margin:.0%} of the range to limits.{name} was left"
    return _other(of, bounds.lowered.value, why)


def _without_response(of: Measures, _: Thresholds) -> Verdict | None:
    if of.response is not None:
        return None
    if of.actuator and not of.trip:
        return Verdict("go on", f"it has no frequency response: {of.no_response}")
    return _repeat(f"it cannot be identified: {of.no_response}")


def _unclear(of: Measures, bounds: Thresholds) -> Verdict | None:
    if of.covered < bounds.covered.value:
        why = f"only {of.covered:.0%} of the planned band is reliable"
    elif of.coherence < bounds.coherence.value:
        why = f"the median coherence is {of.coherence:.2f}"
    else:
        return None
    room = min((of.margins.get(name, 1.0) for name in OF_THE_MOTORCYCLE), default=1.0)
    factor = min(bounds.raised.value, 0.95 * of.larger)
    if room >= bounds.room.value and factor > 1.1:
        return _other(of, factor, why)
    return _repeat(f"{why}, and the limits leave no room for a larger amplitude")


def _unlike(of: Measures, bounds: Thresholds) -> Verdict | None:
    found = of.repeatability
    if found is None or found.distance <= bounds.distance.value:
        return None
    if found.chance > bounds.chance.value:
        return None
    return _repeat(
        f"it differs by {found.distance:.0%} from the earlier repeats, {found.expected:.0%} is"
        f" noise: check tyre, fuel, gear and wind"
    )


RULES: tuple[Rule, ...] = (
    _tripped_by_amplitude,
    _tripped,
    _late,
    _clipped,
    _near_a_limit,
    _without_response,
    _unclear,
    _unlike,
)


def _other(of: Measures, factor: float, why: str, counts: bool = True) -> Verdict:
    number, _, unit = of.amplitude.partition(" ")
    proposed = f"{float(number) * factor:.3g} {unit}".strip() if of.amplitude else ""
    instead = f"; {proposed} instead of {of.amplitude} is proposed" if proposed else ""
    return Verdict("other amplitude", why + instead, counts, proposed)


def _repeat(why: str) -> Verdict:
    return Verdict("repeat", why, counts=False)


def _summary(of: Measures) -> str:
    band = f"{of.band[0]:.1f} to {of.band[1]:.1f} Hz" if of.band else "nothing"
    return f"{band} reliable, coherence {of.coherence:.2f}"
