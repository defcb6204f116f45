"""A motorcycle is its blocks, its gears and the effects beyond the nominal equations."""

from collections.abc import Iterator
from dataclasses import dataclass, field, fields

from slipbench.plant.blocks import (
    Body,
    Driveline,
    Encoder,
    Engine,
    FrontWheel,
    Intake,
    RearWheel,
    ThrottleServo,
    Tyre,
)
from slipbench.plant.effects.effect import Effect
from slipbench.plant.errors import ParameterError
from slipbench.plant.parameters import Block

GEAR_RANGE = (1.0, 40.0)


@dataclass(frozen=True)
class Motorcycle:
    """Everything that fixes the motion once the inputs are known.

    gears: crank turns per turn of the rear wheel, first gear first.
    effects: what this motorcycle has beyond the nominal equations; none twice on one subject.
    """

    throttle_servo: ThrottleServo = field(default_factory=ThrottleServo)
    intake: Intake = field(default_factory=Intake)
    engine: Engine = field(default_factory=Engine)
    driveline: Driveline = field(default_factory=Driveline)
    rear_wheel: RearWheel = field(default_factory=RearWheel)
    tyre: Tyre = field(default_factory=Tyre)
    body: Body = field(default_factory=Body)
    front_wheel: FrontWheel = field(default_factory=FrontWheel)
    rear_encoder: Encoder = field(default_factory=Encoder)
    front_encoder: Encoder = field(default_factory=Encoder)
    gears: tuple[float, ...] = (11.4, 8.75, 7.25, 6.3, 5.65, 5.2)
    effects: tuple[Effect, ...] = ()

    def __post_init__(self) -> None:
        check_gears(self.gears)
        names = [effect.key for effect in self.effects]
        for name in names:
            if names.count(name) > 1:
                raise ParameterError(
                    f"effect '{name}' is given {names.count(name)} times",
                    "Motorcycle.effects",
                    "every effect at most once",
                    ", ".join(names),
                    "merge them into one",
                )

    def blocks(self) -> Iterator[tuple[str, Block]]:
        """Yield (name, block) for every block of the nominal motorcycle, in a fixed order."""
        for name in BLOCK_NAMES:
            yield name, getattr(self, name)


BLOCK_NAMES = tuple(f.name for f in fields(Motorcycle) if f.name not in ("gears", "effects"))


def check_gears(gears: tuple[float, ...]) -> None:
    """Raise ParameterError unless there is a gear and each ratio is plausible."""
    low, high = GEAR_RANGE
    for number, ratio in enumerate(gears, start=1):
        if not low <= ratio <= high:
            raise ParameterError(
                "overall gear ratio is outside its range",
                f"Motorcycle.gears, gear {number}",
                f"{low:g} to {high:g} crank turns per wheel turn",
                f"{ratio!r}",
                "give the overall ratio: primary x gear x final drive",
            )
    if not gears:
        raise ParameterError(
            "no gear", "Motorcycle.gears", "at least one ratio", "()", "give the overall ratios"
        )
