"""The systems of the study: model files, what drives them, and the noise of their sensors."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from slipbench.plant.signals import Floats
from slipbench.protocol.recording.role_map import RoleMap, Source

FOLDER = Path(__file__).parent / "systems"
STEPS, LINES, ONE_SIDED, RARE = "steps", "lines", "one-sided", "rare"


@dataclass(frozen=True)
class Drive:
    """An input: levels of normal distribution, each for a time. SI.

    kind: the levels themselves, lines between them, their magnitudes, or the large ones alone. within:
    limits.
    """

    unit: str
    size: float
    hold: float
    kind: str = STEPS
    middle: float = 0.0
    within: tuple[float, float] = (-np.inf, np.inf)

    def drawn(self, rng: np.random.Generator, count: int, period: float) -> Floats:
        """Return samples, (count,). period: of the samples, s."""
        every = max(1, round(self.hold / period))
        levels = rng.standard_normal(count // every + 2)
        if self.kind == LINES:
            raw = np.interp(np.arange(count), every * np.arange(levels.size), levels)
        else:
            raw = np.repeat(levels, every)[:count]
        if self.kind == ONE_SIDED:
            raw = np.abs(raw)
        if self.kind == RARE:
            raw = np.maximum(raw - 0.8, 0.0)
        return np.asarray(np.clip(self.middle + self.size * raw, *self.within))


@dataclass(frozen=True)
class Plant:
    """A system. period: of all samples, s. outputs: unit and standard deviation of the noise, SI.

    starts: first value of an output that is not 0.
    """

    name: str
    period: float
    seconds: float
    inputs: Mapping[str, Drive]
    outputs: Mapping[str, tuple[str, float]]
    starts: Mapping[str, float] = field(default_factory=dict)

    @property
    def file(self) -> Path:
        """The model file."""
        return FOLDER / f"{self.name}.toml"

    @property
    def count(self) -> int:
        """Samples of a recording."""
        return round(self.seconds / self.period)

    @property
    def roles(self) -> RoleMap:
        """Every channel under its own name."""
        units = {name: drive.unit for name, drive in self.inputs.items()}
        units |= {name: unit for name, (unit, _) in self.outputs.items()}
        return RoleMap(
            title=self.name, quantities=units, roles={name: Source(column=name) for name in units}
        )


PLANTS = (
    Plant("servo", 0.01, 20.0, {"command": Drive("rad", 0.35, 0.3)}, {"encoder": ("rad", 2e-3)}),
    Plant(
        "dc_motor",
        0.005,
        12.0,
        {"voltage": Drive("V", 8.0, 0.15)},
        {"tacho": ("rad/s", 0.5), "shunt": ("A", 0.05)},
    ),
    Plant(
        "oven",
        1.0,
        3000.0,
        {"power": Drive("W", 80.0, 60.0, ONE_SIDED), "ambient": Drive("K", 5.0, 300.0, LINES)},
        {"thermometer": ("K", 0.1)},
    ),
    Plant(
        "car",
        0.02,
        40.0,
        {"pedal": Drive("1", 0.35, 2.0, ONE_SIDED), "line_pressure": Drive("Pa", 1e6, 6.0, RARE)},
        {"wheel": ("m/s", 0.03)},
        {"wheel": 15.0},
    ),
    Plant(
        "rotor",
        0.01,
        20.0,
        {
            "command": Drive("1", 0.25, 0.3, middle=0.55, within=(0.1, 1.0)),
            "battery": Drive("V", 0.6, 5.0, LINES, middle=12.0),
        },
        {"thrust": ("N", 0.05), "rpm": ("rad/s", 2.0)},
    ),
    Plant(
        "crane",
        0.02,
        40.0,
        {"voltage": Drive("V", 2.0, 1.5)},
        {"drum": ("m/s", 5e-3), "inclinometer": ("rad", 2e-3)},
    ),
)
