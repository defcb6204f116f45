"""Score of a signal for a role, by its name, its unit and its message."""

import re
from dataclasses import dataclass
from functools import cache

from slipbench.protocol.binding.words import NEUTRAL, concepts_in, concepts_of, is_noise, words_of
from slipbench.protocol.database.layout import Database, Message, Signal
from slipbench.protocol.recording.roles import ROLES
from slipbench.protocol.units import linear

Groups = tuple[tuple[str, ...], ...]

ALIKE = 0.25  # score from which a signal is named beside another, or where none is good enough
LEAST = 0.6  # score from which a signal is proposed
FROM_MESSAGE = 0.7  # weight of a word that stands in the name of the message only
FROM_UNIT = 0.7  # weight of a meaning that only the unit states
FOREIGN = 0.2  # lost for each word that means something else
UNKNOWN_WORD = 0.04  # lost for each word that is not known
WRONG_UNIT = 0.3  # factor
NO_UNIT = 0.1  # lost where a quantity has no unit
COUNTS = ("", "count", "counts", "-", "unitless", "teeth", "pulses")
SIDES = ("front", "rear", "left", "right")

SENT = "sent by the bench"
BENCH = re.compile(r"(?i)bench|gateway|tester|slipbench|master")
REQUESTS = ("throttle_request", "spark_request", "authority_request", "request_time")
COMMANDS = ("throttle_command", "spark_command")
OWN_STATUS = ("trial_phase", "trial_authority", "trip_reason", "trial_tick")
ELSEWHERE = (
    0.3  # lost by a status in a message of requests, and by a bare name in a special message
)
SPECIAL = ("optical", "gnss", "wheel", "setpoint", "request")

_WHEEL: Groups = (("wheel",), ("speed", "rpm"))
# What a role must be called: one concept of each group. Concepts that may stand beside: ALLOWED.
NEEDED: dict[str, Groups] = {
    "engine_speed": (("engine", "rpm"), ("rpm", "speed")),
    "gear": (("gear",),),
    "throttle_position": (("throttle",), ("position", "angle", "actual")),
    "throttle_command": (("throttle",), ("setpoint",)),
    "throttle_request": (("throttle",), ("request", SENT)),
    "spark_request": (("spark",), ("request", SENT)),
    "spark_command": (("spark",), ("offset", "setpoint")),
    "spark_advance": (("spark",), ("advance", "angle")),
    "request_time": (("time",), ("request", SENT)),
    "rear_wheel_speed": (("rear",), *_WHEEL),
    "front_wheel_speed": (("front",), *_WHEEL),
    "rear_left_wheel_speed": (("rear",), ("left",), *_WHEEL),
    "rear_right_wheel_speed": (("rear",), ("right",), *_WHEEL),
    "front_left_wheel_speed": (("front",), ("left",), *_WHEEL),
    "front_right_wheel_speed": (("front",), ("right",), *_WHEEL),
    "rear_tooth_counter": (("rear",), ("teeth",), ("count",)),
    "front_tooth_counter": (("front",), ("teeth",), ("count",)),
    "optical_speed": (("optical",), ("speed",)),
    "gnss_speed": (("gnss",), ("speed",)),
    "vehicle_speed": (("vehicle",), ("speed",)),
    "rider_grip": (("grip", "pedal"), ("position", "grip", "angle")),
    "rider_button": (("button", "switch"), ("trial", "rider", "button")),
    "front_brake_pressure": (("front",), ("brake",), ("pressure",)),
    "rear_brake_pressure": (("rear",), ("brake",), ("pressure",)),
    "brake": (("brake",), ("switch", "pedal", "position", "pressure")),
    "clutch": (("clutch",),),
    "authority": (("authority", "mode"), ("authority",)),
    "authority_request": (("authority", "enable", "mode"), ("request", SENT)),
    "throttle_authority": (("throttle",), ("authority", "mode")),
    "throttle_fault": (("throttle",), ("fault",)),
    "throttle_current": (("throttle",), ("current",)),
    "front_suspension_travel": (("front",), ("suspension",), ("travel",)),
    "rear_suspension_travel": (("rear",), ("suspension",), ("travel",)),
    "coolant_temperature": (("coolant",), ("temperature",)),
    "intake_temperature": (("intake",), ("temperature",)),
    "rear_tyre_temperature": (("rear",), ("wheel",), ("temperature",)),
    "front_tyre_temperature": (("front",), ("wheel",), ("temperature",)),
    "manifold_pressure": (("manifold",), ("pressure",)),
    "steering_angle": (("steering",), ("angle",)),
    "yaw_rate": (("yaw",), ("rate",)),
    "pitch_rate": (("pitch",), ("rate",)),
    "lean_angle": (("lean",), ("angle",)),
    "course": (("course",),),
    "latitude": (("latitude",),),
    "longitude": (("longitude",),),
    "altitude": (("altitude",),),
    "longitudinal_acceleration": (("longitudinal",), ("acceleration",)),
    "lateral_acceleration": (("lateral",), ("acceleration",)),
    "trial_phase": (("trial", "phase"), ("phase",)),
    "trip_reason": (("trip",), ("trip", "reason")),
    "trial_tick": (("trial",), ("time",)),
    "trial_authority": (("trial",), ("authority",)),
}
ALLOWED: dict[str, tuple[str, ...]] = {
    "gear": ("position", "engine", "transmission"),
    "clutch": ("pedal", "position", "switch"),
    "rider_grip": ("throttle",),
    "brake": ("pedal", "cylinder", "rider"),
    "authority": ("throttle_or_spark",),
    "coolant_temperature": ("engine",),
    "latitude": ("gnss", "position"),
    "longitude": ("gnss", "position"),
    "altitude": ("gnss", "position"),
    "course": ("gnss",),
    "intake_temperature": ("air", "engine"),
    "manifold_pressure": ("engine", "air"),
    "steering_angle": ("wheel",),
    "spark_advance": ("engine",),
    "throttle_position": ("engine",),
    "vehicle_speed": ("longitudinal",),
    "longitudinal_acceleration": ("vehicle",),
    "lateral_acceleration": ("vehicle",),
    "yaw_rate": ("vehicle",),
    "front_wheel_speed": ("left", "right", "vehicle"),
    "rear_wheel_speed": ("left", "right", "vehicle"),
    "rear_tooth_counter": ("left", "right", "wheel"),
    "front_tooth_counter": ("left", "right", "wheel"),
    "front_brake_pressure": ("cylinder",),
    "rear_brake_pressure": ("cylinder",),
    "rider_button": ("enable",),
}
# A name that consists of this concept alone may mean the role: "THROTTLE", "SPEED".
BARE: dict[str, str] = {
    "vehicle_speed": "speed",
    "brake": "brake",
    "rider_grip": "pedal",
    "coolant_temperature": "coolant",
}
SWITCHES = {"rider_button", "throttle_fault"}
EITHER = {"brake", "clutch", "gear", "authority", "authority_request", "throttle_authority"}
# Meanings that a unit states, by the SI unit that it converts to.
UNIT_CONCEPTS: tuple[tuple[str, tuple[str, ...]], ...] = (
    ("m/s", ("speed",)),
    ("m/s^2", ("acceleration",)),
    ("Pa", ("pressure",)),
    ("K", ("temperature",)),
    ("A", ("current",)),
    ("m", ("travel",)),
    ("rad/s", ("rate", "rpm")),
    ("rad", ("angle",)),
)


@dataclass(frozen=True)
class Match:
    """A signal and how well it suits a role, 0..1, with the reasons."""

    message: Message
    signal: Signal
    score: float
    reasons: tuple[str, ...]

    @property
    def name(self) -> str:
        """ "Message.signal"."""
        return f"{self.message.name}.{self.signal.name}"


def matches(database: Database, role: str) -> list[Match]:
    """Signals of a database that could have a role, the best first."""
    found = [
        match(message, signal, role) for message in database.messages for signal in message.signals
    ]
    return sorted((each for each in found if each.score > 0), key=lambda each: -each.score)


def nearest(database: Database, role: str, most: int = 3) -> str:
    """The signals that come nearest to a role, with their units, in one line."""
    found = [each for each in matches(database, role)[:most] if each.score >= ALIKE]
    named = [f"{each.name} [{each.signal.unit or '-'}]" for each in found]
    return ", ".join(named) or "none that is alike"


def suits_unit(signal: Signal, role: str) -> bool:
    """Whether the unit of a signal converts to that of the role; a missing unit suits everything."""
    unit = ROLES[role].unit
    if not signal.unit or unit == "count":
        return signal.unit.lower() in COUNTS
    targets = (unit, "rad/s") if role.endswith("wheel_speed") else (unit,)
    return any(_converts(signal.unit, target) for target in targets)


def match(message: Message, signal: Signal, role: str) -> Match:
    """Score of one signal for a role, with the reasons."""
    held, around = concepts_in(signal.name), _around(message)
    by_unit, needed = unit_concepts(signal.unit), needed_of(role)
    weights = [_weight(group, held, around, by_unit) for group in needed]
    if _is_bare(signal.name, held, role) and around.isdisjoint(SPECIAL):
        weights = [max(weight, FROM_UNIT) for weight in weights]
    if not weights[0] or not all(
        weight for group, weight in zip(needed, weights, strict=True) if group[0] in SIDES
    ):
        return Match(message, signal, 0.0, ())
    score = sum(weights) / len(weights) - _lost(signal.name, role)
    if role not in REQUESTS and (SENT in around) != (role in OWN_STATUS):
        score -= ELSEWHERE
    if role not in REQUESTS + COMMANDS and not held.isdisjoint(("request", "setpoint")):
        score -= ELSEWHERE  # a requested value is not a measured one
    reasons = ["name" if any(_hits(group, held) for group in needed) else "name of the message"]
    if not suits_unit(signal, role):
        score *= WRONG_UNIT
        reasons.append(f"but unit {signal.unit}")
    elif signal.unit and ROLES[role].unit != "1":
        reasons.append(f"unit {signal.unit}")
    elif not signal.unit and ROLES[role].unit not in ("1", "count"):
        score -= NO_UNIT
    score *= _kind(signal, role)
    return Match(message, signal, round(min(1.0, max(0.0, score)), 3), tuple(reasons))


def needed_of(role: str) -> Groups:
    """Concepts that the name of a role's signal needs: one of each group."""
    return NEEDED.get(role) or tuple((word,) for word in role.split("_"))


@cache
def unit_concepts(unit: str) -> frozenset[str]:
    """Concepts that a unit states: "km/h" -> speed."""
    if unit == "%":
        return frozenset(("position",))
    if not unit:
        return frozenset()
    found = next((named for si, named in UNIT_CONCEPTS if _converts(unit, si)), ())
    return frozenset(found)


@cache
def _converts(unit: str, target: str) -> bool:
    try:
        linear(unit, target)
    except ValueError:
        return False
    return True


def _around(message: Message) -> frozenset[str]:
    """Concepts of the name of a message, and whether the bench sends it."""
    held = concepts_in(message.name)
    by_bench = any(BENCH.search(sender) for sender in message.senders)
    if by_bench or not held.isdisjoint(("request", "setpoint")):
        return held | {SENT}
    return held


def _is_bare(name: str, held: frozenset[str], role: str) -> bool:
    """Whether a name consists only of the word that may mean the role, and of noise."""
    bare = BARE.get(role)
    return bare in held and all(
        bare in concepts_of(word) or is_noise(word) for word in words_of(name)
    )


def _hits(group: tuple[str, ...], held: frozenset[str]) -> bool:
    return not held.isdisjoint(group)


def _weight(
    group: tuple[str, ...], own: frozenset[str], around: frozenset[str], unit: frozenset[str]
) -> float:
    if _hits(group, own):
        return 1.0
    return max(
        (1.0 if SENT in group and SENT in around else FROM_MESSAGE) * _hits(group, around),
        FROM_UNIT * _hits(group, unit),
    )


@cache
def _lost(name: str, role: str) -> float:
    """Loss of score from the words of a name that belong to no part of the role."""
    expected = {concept for group in needed_of(role) for concept in group}
    expected |= NEUTRAL | set(ALLOWED.get(role, ()))
    lost = 0.0
    for word in words_of(name):
        concepts = concepts_of(word)
        if concepts & expected or is_noise(word):
            continue
        lost += FOREIGN if concepts else UNKNOWN_WORD
    return lost


def _kind(signal: Signal, role: str) -> float:
    """Factor for a switch in place of a number, and the other way round."""
    one_bit = signal.length == 1
    if role in EITHER or role in OWN_STATUS:
        return 1.0
    if role in SWITCHES:
        return 1.0 if signal.length <= 3 and not signal.unit else 0.4
    return 0.3 if one_bit or (len(signal.choices) > 2 and signal.length <= 4) else 1.0
