"""Type of a hidden effect: magnitudes, shapes, and the injection points at which it acts."""

from collections.abc import Mapping
from dataclasses import dataclass, field

SERVO, ENGINE, DRIVE, TYRE = "servo force", "engine torque", "driveline torque", "tyre force"
WHEEL, ROAD = "wheel torque", "road force"
ENGINE_SPEED, OPTICAL = "sensor of engine speed", "sensor of optical speed"
REAR_TEETH, FRONT_TEETH = "sensor of rear teeth", "sensor of front teeth"

Size = tuple[str, float, float]
"""Field that it sets, smallest of interest, typical."""
Shape = tuple[str, float, float]
"""Field that it sets, lowest, highest."""
WHOLE = frozenset({"tooth"})


@dataclass(frozen=True)
class FaultType:
    """A fault type: an effect that can be hidden in a case.

    places: injection points; several where they are physically equivalent.
    sizes, shapes: by the library's parameter. subjects: channels or wheels that may have it.
    signed: of either sign. like: whose numbers the library's formula means as well, so that
    intervals can be compared. quiet: hidden from any usual trial, or left to chance; no part of
    pairs.
    needs: excitation without which it does not show at all (for cases that do not excite it).
    by_angle: goes with the angle of crank or wheel.
    memory: the response depends on the past (delay, lag, hysteresis, heat). own: shapes that the
    library's formula lacks. inside: the library has it. near: names of the library that describe an
    effect outside of it fairly, so that they are no wrong names.
    """

    name: str
    places: tuple[str, ...]
    sizes: Mapping[str, Size]
    shapes: Mapping[str, Shape] = field(default_factory=dict)
    subjects: tuple[str, ...] = ()
    signed: bool = False
    like: tuple[str, ...] = ()
    quiet: bool = False
    needs: bool = False
    inside: bool = True
    memory: bool = False
    by_angle: bool = False
    own: Mapping[str, Shape] = field(default_factory=dict)
    near: tuple[str, ...] = ()


def one_size(
    name: str, places: tuple[str, ...], small: float, typical: float, **more: object
) -> FaultType:
    """Fault type with one magnitude; `parameter` and `to` name it in library and generator."""
    parameter, to = str(more.pop("parameter")), str(more.pop("to"))
    more.setdefault("like", (parameter,))
    return FaultType(name, places, {parameter: (to, small, typical)}, **more)  # type: ignore[arg-type]
