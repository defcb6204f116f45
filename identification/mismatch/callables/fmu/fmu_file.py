"""TOML file of an FMU: its uncertain parameters, inputs, recorded outputs and states.

For example `servo.toml` beside `servo.fmu`. Numbers and sizes are written as in a model file. An
element of an array is named as `x[1]` or `A[2,3]`.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Literal

from pydantic import Field, ValidationError, model_validator

from slipbench.identification.mismatch.callables.description import NOT_AN_EQUATION
from slipbench.identification.mismatch.callables.parameter import Parameter
from slipbench.identification.mismatch.systems.model_file import (
    ActingEffect,
    DrivenInput,
    DrivenState,
    ModelFile,
    Number,
    Output,
    Size,
)
from slipbench.protocol.configuration import Seconds, Section, load_toml
from slipbench.protocol.errors import InputError

SUFFIX = ".fmu"


def is_of_an_fmu(path: Path) -> bool:
    """Return whether a file is an FMU or its TOML file. Raises InputError for invalid TOML."""
    if path.suffix.lower() == SUFFIX:
        return True
    tree = load_toml(path)
    return "fmu" in tree or ("outputs" in tree and path.with_suffix(SUFFIX).exists())


class FmuParameter(Number):
    """A parameter of the FMU, or the start value of a variable that it initializes exactly.

    value       nominal value
    unit        of all numbers of the parameter
    plus_minus  half width of the 95 % prior interval; none: half of the distance between low and
                high. 0: exact
    low         least value; none: that of the FMU
    high        greatest value; none: that of the FMU
    variable    name in the FMU, as "k", "x[1]" or "A[2,3]"; empty: the parameter's own
    """

    low: float | None = None
    high: float | None = None
    variable: str = ""


class FmuInput(DrivenInput):
    """An input of the FMU.

    variable  name in the FMU, as "u" or "u[1]"; empty: the input's own
    """

    variable: str = ""


class FmuState(Section):
    """A continuous state of an FMU for model exchange: effects act on its derivative.

    size      usual magnitude of the state
    rate      state of this file that is its derivative, for example the speed of a position; empty:
              another quantity
    along     state of this file that is the speed of the driven part: regressor of friction
    first     prior standard deviation of the initial value about that of the FMU; none: half the
              size
    variable  name in the FMU, as "x" or "x[1]"; empty: the state's own
    """

    size: Size
    rate: str = ""
    along: str = ""
    first: Number | None = None
    variable: str = ""

    def state(self) -> DrivenState:
        """Return it as a state of a model file; the FMU computes its rate."""
        entry = self.model_dump(exclude={"variable", "rate"})
        return DrivenState(rate=self.rate or NOT_AN_EQUATION, **entry)


class FmuOutput(Section):
    """A variable of the FMU that is measured by a sensor.

    role      role of the recorded signal
    size      usual magnitude of the quantity
    latency   known latency of the sensor
    noise     standard deviation before quantization by the sensor
    variable  name in the FMU, as "y" or "y[1]"; empty: the output's own
    """

    role: str
    size: Size
    latency: Seconds = 0.0
    noise: Number = Number(value=0.0)
    variable: str = ""


class FmuFile(Section):
    """TOML file of an FMU.

    fmu          the FMU, relative to this file; empty: the one of the same name
    name         of the system; empty: the FMU's
    description  text for people
    interface    of the FMU; empty: co-simulation if available, else model exchange
    step         largest communication step, or integration step in model exchange
    period       of the bins in which residuals are tested, usually that of the slowest output
    stretch      segment within which errors may be serially correlated; 0: 30 periods
    time_limit   of one run; a longer run is stopped
    parameters   by name
    inputs       by name
    outputs      by name
    states       continuous states, by name, on whose derivatives effects may act; model exchange
    effects      known effects at inputs, outputs and derivatives ("speed_rate")
    """

    fmu: str = ""
    name: str = ""
    description: str = ""
    interface: Literal["co_simulation", "model_exchange", ""] = ""
    step: Seconds = Field(gt=0.0)
    period: Seconds = Field(gt=0.0)
    stretch: Seconds = Field(default=0.0, ge=0.0)
    time_limit: Seconds = Field(default=60.0, gt=0.0)
    parameters: dict[str, FmuParameter] = Field(default_factory=dict)
    inputs: dict[str, FmuInput] = Field(default_factory=dict)
    outputs: dict[str, FmuOutput] = Field(min_length=1)
    states: dict[str, FmuState] = Field(default_factory=dict)
    effects: tuple[ActingEffect, ...] = ()

    @model_validator(mode="after")
    def _speeds_are_outputs(self) -> "FmuFile":
        for key, entry in self.inputs.items():
            if entry.along and entry.along not in self.outputs:
                raise ValueError(
                    f"inputs.{key}.along = {entry.along!r} is no output;"
                    f" one of {', '.join(self.outputs)} is expected"
                )
        return self

    @model_validator(mode="after")
    def _rates_are_states(self) -> "FmuFile":
        for key, entry in self.states.items():
            if entry.rate and entry.rate not in self.states:
                raise ValueError(
                    f"states.{key}.rate = {entry.rate!r} is no state;"
                    f" one of {', '.join(self.states)} is expected"
                )
        return self

    def model_file(self, parameters: Mapping[str, Parameter], name: str, where: str) -> ModelFile:
        """Return it as a model file without equations. Raises InputError.

        parameters: those of this file, with the FMU's own bounds; name: of the system.
        """
        numbers = {key: one.number(f"{where}: parameters.{key}") for key, one in parameters.items()}
        try:
            return ModelFile(
                name=name,
                description=self.description,
                step=self.step,
                period=self.period,
                stretch=self.stretch,
                parameters=numbers,
                inputs={
                    key: DrivenInput(**one.model_dump(exclude={"variable"}))
                    for key, one in self.inputs.items()
                },
                outputs={
                    key: Output(value=NOT_AN_EQUATION, **one.model_dump(exclude={"variable"}))
                    for key, one in self.outputs.items()
                },
                states={key: one.state() for key, one in self.states.items()},
                effects=self.effects,
            )
        except ValidationError as fault:
            reasons = "; ".join(str(error["msg"]) for error in fault.errors())
            raise InputError("the file cannot be used", where=where, found=reasons) from fault

    def path(self, file: Path) -> Path:
        """Return the path of the FMU. file: path of this TOML file."""
        return file.parent / self.fmu if self.fmu else file.with_suffix(".fmu")
