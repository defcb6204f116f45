"""An FMU and its TOML file as a system for the mismatch analysis."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import tomlkit

from slipbench.identification.mismatch.callables.description import bounds
from slipbench.identification.mismatch.callables.fmu.fmu_file import (
    SUFFIX,
    FmuFile,
    FmuInput,
    FmuOutput,
    FmuParameter,
)
from slipbench.identification.mismatch.callables.fmu.plan import Plan
from slipbench.identification.mismatch.callables.fmu.runner import FmuRunner
from slipbench.identification.mismatch.callables.fmu.template import template
from slipbench.identification.mismatch.callables.fmu.unpacked import UnpackedFmu, unpacked
from slipbench.identification.mismatch.callables.fmu.variables import (
    Port,
    StatePort,
    port,
    state_port,
)
from slipbench.identification.mismatch.callables.parameter import Parameter
from slipbench.identification.mismatch.callables.simulator import ExternalSimulator
from slipbench.identification.mismatch.callables.worker import CAN_ISOLATE, IsolatedCaller
from slipbench.identification.mismatch.systems.model_file import ModelFile
from slipbench.identification.mismatch.systems.system import ModelSystem
from slipbench.protocol.configuration import read_toml
from slipbench.protocol.errors import InputError


@dataclass(frozen=True, eq=False)
class OpenFmu:
    """An FMU with the contents of its TOML file.

    beside: path of the TOML file. parameters: by name, with bounds. time_limit: of one run, s.
    """

    beside: Path
    model: ModelFile
    plan: Plan
    parameters: Mapping[str, Parameter]
    time_limit: float

    @property
    def system(self) -> ModelSystem:
        """System for the mismatch analysis. Raises InputError."""
        runner = FmuRunner(self.plan)
        caller = IsolatedCaller(runner, self.time_limit) if CAN_ISOLATE else runner
        simulator = ExternalSimulator(caller, *bounds(self.parameters, self.model), "the FMU")
        source = _source(self.beside, self.plan.fmu.path, self.model.name)
        return replace(ModelSystem.of(self.model, self.beside.name, simulator), source=source)


def load_fmu_system(path: Path) -> ModelSystem:
    """Load an FMU by its path or that of its TOML file. Raises InputError where they disagree."""
    return open_fmu(path).system


def open_fmu(path: Path) -> OpenFmu:
    """Open an FMU by its path or that of its TOML file. Raises InputError where they disagree."""
    toml = path.with_suffix(".toml") if path.suffix.lower() == SUFFIX else path
    if not toml.exists():
        raise _no_file(path, toml)
    file = read_toml(toml, FmuFile)
    fmu = unpacked(path if path.suffix.lower() == SUFFIX else file.path(path))
    where = str(toml)
    ports = _parameter_ports(file, fmu, where)
    parameters = {
        key: _parameter(one, ports[key], f"{where}: parameters.{key}")
        for key, one in file.parameters.items()
    }
    model = file.model_file(parameters, file.name or str(fmu.description.modelName), where)
    plan = _plan(file, fmu, model, tuple(ports.values()), where)
    model = _with_exact_integer_inputs(model, plan.inputs)
    return OpenFmu(toml, model, plan, parameters, file.time_limit)


def _with_exact_integer_inputs(model: ModelFile, ports: tuple[Port, ...]) -> ModelFile:
    """Return a model file in which no effect acts at inputs of integer type."""
    integers = {own.name for own in ports if own.kind.whole}
    inputs = {
        name: one.model_copy(update={"exact": True}) if name in integers else one
        for name, one in model.inputs.items()
    }
    return model.model_copy(update={"inputs": inputs})


def _no_file(path: Path, toml: Path) -> InputError:
    return InputError(
        f"the FMU needs a file beside it, {toml.name}, that says what is uncertain and recorded."
        f" Begin with this:\n\n{template(unpacked(path))}",
        where=str(path),
        remedy=f"write it as {toml}: half widths, roles of your recordings, usual magnitudes",
    )


def _parameter_ports(file: FmuFile, fmu: UnpackedFmu, where: str) -> dict[str, Port]:
    return {
        key: port(
            fmu.description, key, one.variable, one.unit, "parameter", f"{where}: parameters.{key}"
        )
        for key, one in file.parameters.items()
    }


def _parameter(entry: FmuParameter, own: Port, where: str) -> Parameter:
    """Return a parameter with the bounds of the TOML file, else of the FMU. Raises InputError."""
    if own.kind.whole and entry.plus_minus != 0.0:
        raise InputError(
            f"{entry.variable or own.name!r} holds whole numbers, which cannot be calibrated",
            where=where,
            expected="plus_minus = 0",
            found=f"type {own.kind.name}",
            remedy="compare analyses with one value each",
        )
    low = own.low if entry.low is None else entry.low
    high = own.high if entry.high is None else entry.high
    bounded = np.isfinite([low, high]).any()
    return Parameter(entry.value, entry.plus_minus, (low, high) if bounded else None, entry.unit)


def _plan(
    file: FmuFile, fmu: UnpackedFmu, model: ModelFile, parameters: tuple[Port, ...], where: str
) -> Plan:
    """Return the plan with inputs and outputs; recordings hold SI."""
    found = {
        (kind, key): port(
            fmu.description, key, one.variable, one.size.si_unit, kind, f"{where}: {kind}s.{key}"
        )
        for kind, key, one in _ports(file)
    }
    inputs, outputs = (
        tuple(one for (what, _), one in found.items() if what == kind)
        for kind in ("input", "output")
    )
    held = tuple(one.steps for one in model.inputs.values())
    _check_held(inputs, held, where)
    interface = fmu.interface(file.interface or ("model_exchange" if file.states else ""))
    states = _states(file, fmu, interface, where)
    outputs = (*outputs, *(state.port for state in states))
    return Plan(fmu, interface, file.step, parameters, inputs, outputs, held, states)


def _check_held(inputs: tuple[Port, ...], held: tuple[bool, ...], where: str) -> None:
    """Raise InputError where a discrete input is linearly interpolated between samples."""
    for own, holds in zip(inputs, held, strict=True):
        if own.discrete and not holds:
            raise InputError(
                "this input changes at events alone: between samples it holds",
                where=f"{where}: inputs.{own.name}",
                expected="held = true, smooth = false",
                found=f"held = false or smooth = true, and type {own.kind.name}",
            )


def _states(file: FmuFile, fmu: UnpackedFmu, interface: str, where: str) -> tuple[StatePort, ...]:
    if file.states and interface != "model_exchange":
        raise InputError(
            "effects act on derivatives in model exchange only",
            where=f"{where}: states",
            expected='interface = "model_exchange"',
            found=f'interface = "{interface}"',
        )
    return tuple(
        state_port(fmu.description, key, one.variable, one.size.si_unit, f"{where}: states.{key}")
        for key, one in file.states.items()
    )


def _ports(file: FmuFile) -> Iterator[tuple[str, str, FmuInput | FmuOutput]]:
    for key, entry in file.inputs.items():
        yield "input", key, entry
    for name, output in file.outputs.items():
        yield "output", name, output


def _source(toml: Path, fmu: Path, name: str) -> str:
    """Return the text of the TOML file with the absolute path of the FMU.

    An improved file may be written to another folder.
    """
    text = toml.read_text(encoding="utf-8")
    document = tomlkit.parse(text)
    required = {"name": name, "description": "", "fmu": str(fmu.resolve())}
    if "fmu" in document:
        document["fmu"] = required["fmu"]
        text = tomlkit.dumps(document)
    missing = {key: value for key, value in required.items() if key not in document}
    return tomlkit.dumps(missing) + text  # top-level keys precede the first table
