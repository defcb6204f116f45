"""A model file defines a system: states with equations, inputs, outputs, seams.

TOML. Equations are text over the names of parameters, inputs, states and seams. A number is
`{ value = 3, unit = "mm", plus_minus = 1 }`; plus_minus is the half width of the 95 % interval: 5 %
of the value by default; 0 means exact. `size` is the usual magnitude of a quantity, to which
magnitudes are related.

Vectors and matrices are replaced by their elements before the file is checked
(vectors/expansion.py).

A parameter above 0 is uncertain by a factor: its half width is at most 10 times its value. A
parameter of either sign is written as 0 or less.
"""

from itertools import pairwise
from pathlib import Path
from typing import Annotated

from pydantic import AfterValidator, Field, field_validator, model_validator

from slipbench.identification.mismatch.simulation.coordinates import STATED_SHARE
from slipbench.identification.mismatch.systems.expression import FUNCTIONS
from slipbench.identification.mismatch.systems.vectors.expansion import without_vectors
from slipbench.protocol.configuration import Seconds, Section, load_toml, parse
from slipbench.protocol.units import to_base

LARGEST = 1e30
"""Largest magnitude of a number in base units; results of equations must not overflow a float."""
SMALLEST = 1e-30
"""Smallest magnitude of a size in base units."""
MOST_HALF_WIDTHS = 10.0
"""Largest half width (95 %) of a parameter above 0 over its value: a factor of 22 000."""


class Number(Section):
    """A number with its unit; inside, everything is in base units of SI.

    value       the number
    unit        of the number and of plus_minus; "1": without unit
    plus_minus  half width of what is reliable with 95 %; none: 5 % of the value. 0: exact
    """

    value: float
    unit: str = "1"
    plus_minus: float | None = Field(default=None, ge=0.0)

    @model_validator(mode="after")
    def _known_unit(self) -> "Number":
        slope, _, _ = to_base(self.unit)
        for written in (self.value, self.plus_minus or 0.0):
            if not abs(slope * written) <= LARGEST:
                most = f"{LARGEST / slope:.3g} {self.unit}"
                raise ValueError(
                    f"{written:g} {self.unit} is too large: at most {most} is expected"
                )
        return self

    @property
    def si(self) -> float:
        """The value in base units."""
        slope, offset, _ = to_base(self.unit)
        return slope * self.value + offset

    @property
    def si_plus_minus(self) -> float | None:
        """The half width in base units."""
        return None if self.plus_minus is None else to_base(self.unit)[0] * self.plus_minus

    @property
    def si_unit(self) -> str:
        """The base unit; as written where it is one."""
        return to_base(self.unit)[2]


def _magnitude(size: Number) -> Number:
    """Return a size. Raises ValueError where its magnitude is below SMALLEST."""
    if not abs(size.si) >= SMALLEST:
        raise ValueError(
            f"{size.value:g} {size.unit} is no size: the usual magnitude of the quantity is expected"
        )
    return size


Size = Annotated[Number, AfterValidator(_magnitude)]
"""Usual magnitude of a quantity, of either sign."""


class Input(Section):
    """What drives the system, as it was recorded.

    role        role of the recording
    size        usual magnitude of the quantity
    held        between samples the last value holds, whatever their times; false: linear
                interpolation
    smooth      between samples a cubic instead, for what was filtered before it was sampled: linear
                interpolation multiplies it by sinc^2(f T), 4 % at a ninth of the sampling rate
    slope_over  above 0: the input is the slope of the recorded quantity over that time
    latency     known, subtracted from the times
    turn        way that a wheel rolls in a turn; its own pattern is then removed (turn_pattern.py)
    noise       standard deviation of the sensor's noise; above 0: it may be smoothed to both sides
                (input_noise.py). Default: estimated from the samples where held is false,
                0 elsewhere
    """

    role: str
    size: Size
    held: bool = True
    smooth: bool = False
    slope_over: Seconds = Field(default=0.0, ge=0.0)
    latency: Seconds = 0.0
    turn: Number | None = None
    noise: Number | None = None

    @property
    def steps(self) -> bool:
        """Whether the last sample is held until the next one."""
        return self.held and not self.smooth

    @property
    def noisy(self) -> bool:
        """Whether it may contain sensor noise; by default, whether it is interpolated linearly."""
        if self.noise is None:
            return not self.held and not self.smooth
        return self.noise.value > 0.0


class DrivenInput(Input):
    """An input of a simulation from outside.

    along  output that is the speed of what the input drives: friction may act along it
    exact  whether it is known exactly, as a gear or a switch: no effect acts there
    """

    along: str = ""
    exact: bool = False


class State(Section):
    """A state of the system.

    rate            equation of its rate
    size            usual magnitude of the quantity
    start           value at first, or the output that shows it
    first           standard deviation of that value from the true one; none: half the size
    overflows_into  the state that gets some of what overflows
    drift           size of an unknown slow disturbance of its rate, in the unit of the rate
    every           time between the knots of that disturbance
    low             lower stop, a quantity or a parameter: the state cannot go below it
    high            upper stop, a quantity or a parameter
    restitution     share of the speed with which it comes back from a stop, a number or a parameter;
                    its rate is then the name of a state, the speed; 0: it stays at the stop
    """

    rate: str
    size: Size
    start: str | Number = Number(value=0.0)
    first: Number | None = None
    overflows_into: str = ""
    drift: Number | None = None
    every: Seconds = Field(default=0.0, ge=0.0)
    low: str | Number | None = None
    high: str | Number | None = None
    restitution: Annotated[float, Field(ge=0.0, le=1.0)] | str = 0.0


class DrivenState(State):
    """A state of a simulation from outside: what its rate is, that simulation knows.

    rate   state that is its rate, as the speed of a position; "0": another quantity
    along  state that is the speed of what the rate drives: friction may act along it
    """

    along: str = ""


class Seam(Section):
    """A named quantity at which an effect may act.

    value  equation
    size   usual magnitude of the quantity
    along  the state that is its speed
    """

    value: str
    size: Size
    along: str = ""


class Output(Section):
    """What a sensor shows.

    role     role of the recording
    value    equation
    size     usual magnitude of the quantity
    latency  known, of the sensor
    noise    standard deviation before the sensor rounds
    turn     way that a wheel rolls in a turn; its own pattern is then removed (turn_pattern.py)
    """

    role: str
    value: str
    size: Size
    latency: Seconds = 0.0
    noise: Number = Number(value=0.0)
    turn: Number | None = None


class CurveTable(Section):
    """A free curve: a broken line over knots, level beyond them, that is added at a place.

    at          input, seam, output, or the rate of a state as in speed_rate
    along       time, an input, a state, a seam before the place, or a rate as in speed_rate
    knots       of that quantity, increasing
    along_unit  of the knots
    values      of the curve at the knots
    unit        of the values and of plus_minus
    plus_minus  half width of what is reliable with 95 %, of each value; none: 5 % of the largest
                value. 0: exact
    periodic    true: the curve repeats every turn of an angle; it is smooth, a periodic cubic spline,
                and its knots lie within one turn
    """

    at: str
    along: str
    knots: tuple[float, ...] = Field(min_length=2)
    along_unit: str = "1"
    values: tuple[float, ...]
    unit: str = "1"
    plus_minus: tuple[float, ...] | None = None
    periodic: bool = False

    @model_validator(mode="after")
    def _check_knots(self) -> "CurveTable":
        if any(b <= a for a, b in pairwise(self.knots)):
            raise ValueError("knots do not increase; sort them, without repeating one")
        for name, row in (("values", self.values), ("plus_minus", self.plus_minus)):
            if row is not None and len(row) != len(self.knots):
                raise ValueError(
                    f"{len(row)} {name} for {len(self.knots)} knots: one each is expected"
                )
        if min(self.half_widths) < 0.0:
            raise ValueError("plus_minus is below 0; a half width is 0 or more")
        if max(map(abs, (*self.knots, *self.values, *self.half_widths))) > LARGEST:
            raise ValueError(f"a number is above {LARGEST:g}")
        return self

    @property
    def half_widths(self) -> tuple[float, ...]:
        """Half width (95 %) of each value, in its unit."""
        if self.plus_minus is not None:
            return self.plus_minus
        return (STATED_SHARE * max(map(abs, self.values), default=0.0),) * len(self.values)


class ActingEffect(Section):
    """An effect that acts.

    name    of the effect in the library
    at      seam, input, output, or the rate of a state as in speed_rate, at which it acts
    using   the other quantity that it uses
    values  parameters of the effect by name
    """

    name: str
    at: str
    using: str = ""
    values: dict[str, Number] = Field(default_factory=dict)


class ModelFile(Section):
    """One model file.

    name         of the system
    description  text for people
    step         largest step of integration
    period       of the bins in which residuals are tested: that of the slowest output, as a rule
    stretch      time within which errors may be serially correlated; 0: 30 periods
    parameters   numbers that the equations name
    inputs       what drives the system, by name
    states       by name
    seams        by name
    outputs      by name
    effects      effects that act already
    curves       free curves that act already
    """

    name: str
    description: str = ""
    step: Seconds = Field(gt=0.0)
    period: Seconds = Field(gt=0.0)
    stretch: Seconds = Field(default=0.0, ge=0.0)
    parameters: dict[str, Number] = Field(default_factory=dict)
    inputs: dict[str, Input] = Field(default_factory=dict)
    states: dict[str, State] = Field(default_factory=dict)
    seams: dict[str, Seam] = Field(default_factory=dict)
    outputs: dict[str, Output] = Field(min_length=1)
    effects: tuple[ActingEffect, ...] = ()
    curves: tuple[CurveTable, ...] = ()

    @field_validator("parameters")
    @classmethod
    def _half_widths(cls, parameters: dict[str, Number]) -> dict[str, Number]:
        for name, number in parameters.items():
            half, most = number.si_plus_minus or 0.0, MOST_HALF_WIDTHS * number.si
            if half > most > 0.0:
                raise ValueError(
                    f"{name}: plus_minus = {number.plus_minus:g} {number.unit} is more than"
                    f" {MOST_HALF_WIDTHS:g} times the value; lower it, or write the value as 0 if"
                    " it may have either sign"
                )
        return parameters

    @model_validator(mode="after")
    def _unique_names(self) -> "ModelFile":
        names: set[str] = set(FUNCTIONS)
        for part in (self.parameters, self.inputs, self.states, self.seams, self.outputs):
            for name in part:
                if not name.isidentifier():
                    raise ValueError(f"{name!r} is not a valid name: letters, digits and _ only")
                if name in names:
                    raise ValueError(f"{name!r} is defined twice, or is the name of a function")
                names.add(name)
        return self

    @model_validator(mode="after")
    def _unique_curves(self) -> "ModelFile":
        pairs = [(c.at, c.along, c.periodic) for c in self.curves]
        for pair in pairs:
            if pairs.count(pair) > 1:
                raise ValueError(f"two curves at {pair[0]!r} along {pair[1]!r}: add their values")
        return self

    @model_validator(mode="after")
    def _references(self) -> "ModelFile":
        """Check that each name that an entry refers to exists."""
        signals = {*self.states, *self.inputs}
        references = [(f"seams.{k}.along", s.along, signals) for k, s in self.seams.items()]
        for key, state in self.states.items():
            references.append(
                (f"states.{key}.overflows_into", state.overflows_into, {*self.states})
            )
            if isinstance(state, DrivenState):
                references.append((f"states.{key}.along", state.along, {*self.states}))
            ends = {"low": state.low, "high": state.high, "restitution": state.restitution}
            references += [
                (f"states.{key}.{end}", limit or "''", {*self.parameters})
                for end, limit in ends.items()
                if isinstance(limit, str)
            ]
            if isinstance(state.start, str):
                references.append((f"states.{key}.start", state.start or "''", {*self.outputs}))
        for key, name, allowed in references:
            if name and name not in allowed:
                expected = ", ".join(sorted(allowed)) or "none"
                raise ValueError(f"{key} = {name!r} does not exist; one of {expected} is expected")
        return self


def load_model_file(path: Path) -> ModelFile:
    """Read a model file; vectors are replaced by their elements.

    Raises InputError, which states every fault.
    """
    return parse(without_vectors(load_toml(path), path.name), ModelFile, where=str(path))
