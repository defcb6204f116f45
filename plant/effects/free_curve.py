"""Free curve: what acts at a place along a quantity, and has no name.

Where no physics of the library explains a recording, a broken line f(z) can stand in for it: a
force or torque at one place of the motorcycle that depends on one quantity of its own motion. It is
no explanation; it lets a simulation behave as the recording does until somebody has one.

Equation
--------
    torque or force at the place += f(z);   f: straight between its knots, level beyond them

Symbols
-------
    place   where f acts: 0 servo force, 1 engine torque, 2 driveline torque, 3 wheel torque,
            4 tyre force, 5 road force
    along   what z is, see QUANTITIES
    z0..    knots, increasing                in the unit of z
    f0..    values at the knots              in N m, N or, of the servo, share of the opening

Trace
-----
Whatever it is: the curve itself is the trace.

Confused with
-------------
All physics that acts at its place.

Reference
---------
De Boor, "A Practical Guide to Splines" (2001), on broken lines.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar

from slipbench.plant.effects.effect import Effect, Hook
from slipbench.plant.parameters import parameter

KNOTS = 16
PLACES = (
    "servo force",
    "engine torque",
    "driveline torque",
    "wheel torque",
    "tyre force",
    "road force",
)
QUANTITIES = (
    "throttle",
    "throttle rate",
    "air",
    "air rate",
    "engine speed",
    "twist",
    "twist rate",
    "slip",
    "speed",
    "spark",
    "lean",
    "distance",
    "time",
    "driveline torque",
    "torque rate",
    "engine acceleration",
)
SERVO_QUANTITIES = (
    "throttle",
    "throttle rate",
    "command",
    "command less position",
    "throttle acceleration",
)


def broken_line(z: float, knots: tuple[float, ...], values: tuple[float, ...]) -> float:
    """F(z)."""
    if z <= knots[0]:
        return values[0]
    for i in range(1, len(knots)):
        if z < knots[i]:
            share = (z - knots[i - 1]) / (knots[i] - knots[i - 1])
            return values[i - 1] + share * (values[i] - values[i - 1])
    return values[len(knots) - 1]


def quantity(along: float, seen: tuple[float, ...]) -> float:
    """The quantity z. seen: the first of QUANTITIES, then the inputs of the others."""
    i = int(along)
    if i < 6:
        return seen[i]
    engine_speed, twist, speed, ratio = seen[4], seen[5], seen[8], seen[13]
    rate = engine_speed / ratio - seen[14]
    torque = seen[15] * twist + seen[16] * rate
    if i == 6:
        return rate
    if i == 7:
        return (seen[14] * seen[7] - speed) / max(abs(speed), 1.0)
    if i == 13:
        return torque
    if i == 14:
        return seen[15] * rate
    if i == 15:
        return (seen[17] - torque / ratio) / seen[18]
    return seen[i]


def in_the_servo(
    servo_acceleration: float,
    place: float,
    along: float,
    knots: tuple[float, ...],
    values: tuple[float, ...],
    throttle: float,
    throttle_rate: float,
    throttle_command: float,
    throttle_servo_natural_frequency: float,
) -> float:
    """Acceleration [1/s^2] with a force that is given as an opening."""
    if place != 0.0:
        return servo_acceleration
    less = throttle_command - throttle
    seen = (throttle, throttle_rate, throttle_command, less, servo_acceleration)
    f = broken_line(seen[int(along)], knots, values)
    return servo_acceleration + throttle_servo_natural_frequency**2 * f


def at_the_crank(
    engine_torque: float,
    place: float,
    along: float,
    knots: tuple[float, ...],
    values: tuple[float, ...],
    seen: tuple[float, ...],
) -> float:
    """The torque at the crank [N m]."""
    if place != 1.0:
        return engine_torque
    return engine_torque + broken_line(quantity(along, seen), knots, values)


def in_the_spring(
    spring_torque: float,
    place: float,
    along: float,
    knots: tuple[float, ...],
    values: tuple[float, ...],
    seen: tuple[float, ...],
) -> float:
    """The torque of the driveline's spring [N m]."""
    if place != 2.0:
        return spring_torque
    return spring_torque + broken_line(quantity(along, seen), knots, values)


def at_the_wheel(
    wheel_torque: float,
    place: float,
    along: float,
    knots: tuple[float, ...],
    values: tuple[float, ...],
    seen: tuple[float, ...],
) -> float:
    """The torque at the rear wheel [N m]."""
    if place != 3.0:
        return wheel_torque
    return wheel_torque + broken_line(quantity(along, seen), knots, values)


def in_the_contact(
    tyre_force: float,
    place: float,
    along: float,
    knots: tuple[float, ...],
    values: tuple[float, ...],
    seen: tuple[float, ...],
) -> float:
    """The force of the rear tyre [N]."""
    if place != 4.0:
        return tyre_force
    return tyre_force + broken_line(quantity(along, seen), knots, values)


def on_the_road(
    drag_force: float,
    place: float,
    along: float,
    knots: tuple[float, ...],
    values: tuple[float, ...],
    seen: tuple[float, ...],
) -> float:
    """The drag [N] less the force of the curve."""
    if place != 5.0:
        return drag_force
    return drag_force - broken_line(quantity(along, seen), knots, values)


Z = tuple(f"z{i}" for i in range(KNOTS))
F = tuple(f"f{i}" for i in range(KNOTS))
SEEN = (
    "throttle",
    "throttle_rate",
    "air",
    "air_rate",
    "engine_speed",
    "twist",
    "twist",
    "rear_wheel_radius",
    "speed",
    "spark",
    "lean",
    "distance",
    "time",
    "gear_ratio",
    "rear_speed",
    "driveline_stiffness",
    "driveline_damping",
    "engine_torque",
    "engine_inertia",
)


def _knot() -> float:
    return parameter(0.0, "", -1e9, 1e9, "a knot, in the unit of the quantity", absent=0.0)


def _value() -> float:
    return parameter(0.0, "", -1e9, 1e9, "f there: N m, N or 1", absent=0.0, smallest=0.0)


@dataclass(frozen=True)
class FreeCurve(Effect):
    """A broken line that stands in for what has no name."""

    name = "free_curve"
    block = "driveline"
    shows_in = ("rear_teeth",)
    confused_with = ()
    hooks: ClassVar[tuple[Hook, ...]] = (
        Hook("servo_acceleration", in_the_servo),
        Hook("engine_torque", at_the_crank),
        Hook("spring_torque", in_the_spring),
        Hook("wheel_torque", at_the_wheel),
        Hook("tyre_force", in_the_contact),
        Hook("drag_force", on_the_road),
    )
    helpers: ClassVar[tuple[Callable[..., Any], ...]] = (broken_line, quantity)
    tuples = {"knots": Z, "values": F, "seen": SEEN}  # noqa: RUF012

    place: float = parameter(1.0, "1", 0.0, 5.0, "where it acts, see PLACES", whole=True)
    along: float = parameter(0.0, "1", 0.0, 15.0, "along what, see QUANTITIES", whole=True)
    z0: float = _knot()
    z1: float = _knot()
    z2: float = _knot()
    z3: float = _knot()
    z4: float = _knot()
    z5: float = _knot()
    z6: float = _knot()
    z7: float = _knot()
    z8: float = _knot()
    z9: float = _knot()
    z10: float = _knot()
    z11: float = _knot()
    z12: float = _knot()
    z13: float = _knot()
    z14: float = _knot()
    z15: float = _knot()
    f0: float = _value()
    f1: float = _value()
    f2: float = _value()
    f3: float = _value()
    f4: float = _value()
    f5: float = _value()
    f6: float = _value()
    f7: float = _value()
    f8: float = _value()
    f9: float = _value()
    f10: float = _value()
    f11: float = _value()
    f12: float = _value()
    f13: float = _value()
    f14: float = _value()
    f15: float = _value()

    @property
    def where(self) -> tuple[str, str]:
        """Place and quantity in words."""
        words = SERVO_QUANTITIES if self.place == 0.0 else QUANTITIES
        return PLACES[int(self.place)], words[int(self.along)]


@dataclass(frozen=True)
class SecondCurve(FreeCurve):
    """Another one beside it, along another quantity or at another place."""

    name = "second_curve"


@dataclass(frozen=True)
class ThirdCurve(FreeCurve):
    """A third."""

    name = "third_curve"


CURVES = (FreeCurve, SecondCurve, ThirdCurve)


def free_curve(
    place: str, quantity: str, knots: tuple[float, ...], values: tuple[float, ...], number: int = 0
) -> FreeCurve | None:
    """The curve with KNOTS knots (SI); None where the simulation does not know of these.

    number: which of CURVES.
    """
    words = SERVO_QUANTITIES if place == PLACES[0] else QUANTITIES
    if place not in PLACES or quantity not in words:
        return None
    points = {**dict(zip(Z, knots, strict=True)), **dict(zip(F, values, strict=True))}
    return CURVES[number](float(PLACES.index(place)), float(words.index(quantity)), **points)
