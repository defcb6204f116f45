"""Inputs and outputs of a simulation: tables with named columns, in SI."""

from dataclasses import dataclass
from typing import ClassVar, Self, overload

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


class Column:
    """One named column of a table; read from an instance it is a view into the table."""

    def __init__(self, unit: str, text: str, rest: float = 0.0) -> None:
        self.unit = unit
        self.text = text
        self.rest = rest

    def __set_name__(self, owner: type, name: str) -> None:
        self.name = name
        names: list[str] = owner.__dict__["names"]
        self.index = len(names)
        names.append(name)

    @overload
    def __get__(self, instance: None, owner: type) -> "Column": ...
    @overload
    def __get__(self, instance: "Inputs | Outputs", owner: type) -> Floats: ...
    def __get__(self, instance: "Inputs | Outputs | None", owner: type) -> "Column | Floats":
        return self if instance is None else instance.table[:, self.index]


FREE = float("nan")
MEASURED = "prescribed value of this state at the end of the row; linear before; NaN: free"


@dataclass(frozen=True, eq=False)
class Inputs:
    """Inputs of the motorcycle, one row per command period, held until the next row.

    The measured_... columns cut the chain of cause: a state that was recorded can be imposed, so
    that the rest of the motorcycle is driven by the recording instead of by the model.
    kept_rear_speed cuts nothing: an angle is the integral of a speed, so that over ten seconds a
    speed that is off by a thousandth turns a crank away from the recorded one's angle; given what
    the rear wheel did, the crank's angle alone stays with it.

    table: shape (rows, len(names)), in the order of `names`. `Inputs.held(...)` makes one; columns
    are views, so that `inputs.throttle_command[:] = wave` fills one in place.
    """

    names: ClassVar[list[str]] = []
    table: Floats

    throttle_command = Column("1", "opening requested from the servo, 0 to 1")
    spark = Column("rad", "spark advance beyond the map")
    gear = Column("1", "gear, from 1; 0 is neutral", 1.0)
    clutch = Column("1", "share of the clutch's capacity, 0 pulled to 1 released", 1.0)
    front_brake = Column("N m", "brake torque at the front wheel")
    rear_brake = Column("N m", "brake torque at the rear wheel")
    road_force = Column("N", "force along the road on the body: grade, wind")
    engine_disturbance = Column("N m", "torque added at the crank")
    grip = Column("1", "factor on the tyre's friction: wet patch", 1.0)
    load = Column("1", "factor on the rear load: crest, dip", 1.0)
    lean = Column("rad", "lean angle of the motorcycle, either side")
    air_temperature = Column("K", "of the air that the engine draws", 298.15)
    measured_throttle = Column("1", MEASURED, FREE)
    measured_engine_speed = Column("rad/s", MEASURED, FREE)
    measured_rear_speed = Column("rad/s", MEASURED, FREE)
    measured_speed = Column("m/s", MEASURED, FREE)
    kept_rear_speed = Column("rad/s", "recorded, to keep the crank's angle in step", FREE)

    def __post_init__(self) -> None:
        if self.table.ndim != 2 or self.table.shape[1] != len(self.names):
            raise ValueError(
                f"a table of shape {self.table.shape}; inputs need (rows, {len(self.names)}): "
                "make it with Inputs.held"
            )

    @classmethod
    def held(cls, rows: int = 1, **columns: float | Floats) -> Self:
        """Inputs at rest, `rows` rows; the named columns hold a number or an array, shape (rows,).

        Raises TypeError for a name that is no input.
        """
        unknown = set(columns) - set(cls.names)
        if unknown:
            raise TypeError(f"no input {sorted(unknown)}; inputs are {cls.names}")
        table = np.tile(INPUT_REST, (rows, 1))
        for name, value in columns.items():
            table[:, cls.names.index(name)] = value
        return cls(table)


INPUT_REST = np.array([vars(Inputs)[name].rest for name in Inputs.names])


@dataclass(frozen=True, eq=False)
class Outputs:
    """Outputs of the motorcycle, one row per sample, at the end of every `every`-th step.

    effect_states: columns that effects add, as '<effect>.<state>', read with `out["..."]`.
    """

    names: ClassVar[list[str]] = []
    table: Floats
    effect_states: tuple[str, ...] = ()

    time = Column("s", "since the state was made")
    throttle = Column("1", "opening of the plate")
    throttle_rate = Column("1/s", "its rate")
    air = Column("1", "air in the manifold, as the opening that gives it")
    air_delay = Column("s", "delay of the air path")
    spark_applied = Column("rad", "spark offset that acts on the torque, after its delay")
    engine_torque = Column("N m", "torque at the crank")
    engine_speed = Column("rad/s", "speed of the crank")
    crank_angle = Column("rad", "angle of the crank, cumulative")
    twist = Column("rad", "twist of the driveline")
    driveline_torque = Column("N m", "torque of the driveline, at the rear wheel")
    rear_speed = Column("rad/s", "speed of the rear wheel")
    rear_angle = Column("rad", "angle of the rear wheel, cumulative")
    front_speed = Column("rad/s", "speed of the front wheel")
    front_angle = Column("rad", "angle of the front wheel, cumulative")
    speed = Column("m/s", "true speed of the motorcycle")
    acceleration = Column("m/s^2", "its rate")
    distance = Column("m", "way since the state was made")
    slip = Column("1", "slip of the rear tyre")
    tyre_force = Column("N", "longitudinal force of the rear tyre")
    optical_speed = Column("m/s", "speed in the optical sensor, after its own dynamics")

    def __getitem__(self, name: str) -> Floats:
        """A column by name; effects' states are named '<effect>.<state>'."""
        return self.table[:, (*self.names, *self.effect_states).index(name)]
