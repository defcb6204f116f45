"""How well a signal suits a role, by its name, its unit and its message."""

import difflib
import re
from dataclasses import dataclass

from slipbench.protocol.database.layout import Database, Message, Signal
from slipbench.protocol.recording.roles import ROLES
from slipbench.protocol.units import linear

# What the signals of the field are called, by role: words of their names. Every group needs one.
WORDS: dict[str, tuple[tuple[str, ...], ...]] = {
    "engine_speed": (("rpm", "nmot", "engine", "crank", "motor"), ("rpm", "speed", "revs", "nmot")),
    "gear": (("gear",),),
    "throttle_position": (
        ("throttle", "tps", "ths", "plate"),
        ("pos", "position", "tps", "angle", "actual", "opening"),
    ),
    "throttle_command": (
        ("throttle", "tps"),
        ("target", "command", "demand", "setpoint", "cmd", "applied"),
    ),
    "throttle_request": (("throttle", "tps"), ("request", "req", "ask", "asked")),
    "spark_request": (("spark", "ignition", "ign", "timing"), ("request", "req", "ask", "asked")),
    "spark_command": (
        ("spark", "ignition", "ign", "timing"),
        ("offset", "command", "trim", "correction", "cmd", "applied"),
    ),
    "spark_advance": (
        ("spark", "ignition", "ign", "timing"),
        ("advance", "angle", "timing", "adv"),
    ),
    "rear_wheel_speed": (("rear", "rr", "back", "rw"), ("wheel", "speed", "ws", "spd", "whl")),
    "front_wheel_speed": (("front", "fr", "fw"), ("wheel", "speed", "ws", "spd", "whl")),
    "optical_speed": (
        ("optical", "true", "ground", "vbox", "correvit"),
        ("speed", "velocity", "spd"),
    ),
    "gnss_speed": (("gps", "gnss", "satellite"), ("speed", "velocity", "spd")),
    "vehicle_speed": (
        ("vehicle", "car", "vss", "vehspd"),
        ("speed", "vss", "velocity", "spd", "vehspd"),
    ),
    "rider_grip": (
        ("grip", "pedal", "accelerator", "accel", "twist", "apps", "rider"),
        ("pos", "position", "grip", "pedal", "apps", "opening"),
    ),
    "rider_button": (
        ("button", "switch", "btn", "sw"),
        ("button", "trial", "test", "launch", "rider", "btn"),
    ),
    "front_brake_pressure": (("front",), ("brake",)),
    "rear_brake_pressure": (("rear",), ("brake",)),
    "brake": (("brake",), ("switch", "pressed", "brake", "light", "pedal")),
    "clutch": (("clutch",),),
    "authority": (
        ("authority", "granted", "grant", "tc", "control"),
        ("authority", "granted", "grant", "active", "state"),
    ),
    "authority_request": (("authority", "enable", "mode"), ("request", "req", "enable", "ask")),
    "throttle_authority": (
        ("throttle", "etb", "body"),
        ("authority", "granted", "grant", "active"),
    ),
    "throttle_fault": (("throttle", "etb", "body"), ("fault", "error", "faulty", "fail")),
    "throttle_current": (("throttle", "etb", "motor"), ("current", "amps")),
    "coolant_temperature": (
        ("coolant", "clt", "ect", "water"),
        ("temp", "temperature", "clt", "ect", "coolant"),
    ),
    "intake_temperature": (
        ("intake", "iat", "inlet", "mat"),
        ("temp", "temperature", "iat", "air"),
    ),
    "manifold_pressure": (("manifold", "map", "boost"), ("pressure", "map", "manifold", "boost")),
    "steering_angle": (("steering", "steer"), ("angle", "ang", "steering")),
    "yaw_rate": (("yaw",),),
    "lean_angle": (("lean", "roll"), ("angle", "lean")),
    "longitudinal_acceleration": (
        ("longitudinal", "long", "acc", "ax"),
        ("accel", "acceleration", "acc", "ax", "g"),
    ),
    "lateral_acceleration": (("lateral", "lat", "ay"), ("accel", "acceleration", "acc", "ay", "g")),
}
SPEECH = {"rpm": "rpm", "%": "", "": ""}
LEAST = 0.45  # score from which a signal is proposed


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
        _match(message, signal, role) for message in database.messages for signal in message.signals
    ]
    return sorted((each for each in found if each.score > 0), key=lambda each: -each.score)


def nearest(database: Database, role: str, most: int = 3) -> str:
    """The signals that come nearest to a role, with their units, in one line."""
    found = matches(database, role)[:most]
    named = [f"{each.name} [{each.signal.unit or '-'}]" for each in found]
    return ", ".join(named) or "none that is alike"


def words_of(name: str) -> tuple[str, ...]:
    """Words of a signal's name, in lower case: "EngineSpd_RPM" -> engine, spd, rpm."""
    split = re.sub(r"([a-z0-9])([A-Z])", r"\1 \2", re.sub(r"([A-Z]+)([A-Z][a-z])", r"\1 \2", name))
    return tuple(part.lower() for part in re.split(r"[^A-Za-z]+", split) if part)


def suits_unit(signal: Signal, role: str) -> bool:
    """Whether the unit of a signal converts to that of the role; a missing unit suits everything."""
    unit = ROLES[role].unit
    if not signal.unit:
        return True
    for target in (unit, "rad/s" if role.endswith("wheel_speed") else unit):
        try:
            linear(signal.unit, target)
        except ValueError:
            continue
        return True
    return False


def _match(message: Message, signal: Signal, role: str) -> Match:
    own, around = words_of(signal.name), words_of(message.name)
    groups = WORDS.get(role) or tuple((word,) for word in role.split("_"))
    reasons = []
    score = 0.0
    for group in groups:
        here = max((_alike(word, group) for word in own), default=0.0)
        there = 0.6 * max((_alike(word, group) for word in around), default=0.0)
        score += max(here, there) / len(groups)
    similar = difflib.SequenceMatcher(None, " ".join(own), role.replace("_", " ")).ratio()
    score = 0.75 * score + 0.25 * similar
    if score >= LEAST:
        reasons.append("name")
    if not suits_unit(signal, role):
        score *= 0.3
    elif signal.unit and ROLES[role].unit != "1":
        score = min(1.0, score + 0.1)
        reasons.append(f"unit {signal.unit}")
    return Match(message, signal, score, tuple(reasons))


def _alike(word: str, group: tuple[str, ...]) -> float:
    best = 0.0
    for known in group:
        if word == known:
            return 1.0
        if len(known) > 3 and (
            word.startswith(known) or (known.startswith(word) and len(word) > 2)
        ):
            best = max(best, 0.85)
        elif len(known) > 2 and known in word:
            best = max(best, 0.7)
    return best
