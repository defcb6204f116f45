"""modelDescription.xml of FMI 2.0 and 3.0."""

import math
from collections.abc import Iterable, Iterator, Sequence
from xml.etree import ElementTree as Xml

from slipbench.plant.fmu.bus import Bus
from slipbench.plant.fmu.bus_description import add_bus, add_bus_output
from slipbench.plant.fmu.model import FmuModel
from slipbench.plant.fmu.units import Unit, fmi_unit
from slipbench.plant.fmu.variables import INPUT, OUTPUT, Variable

IDENTIFIER = "motorcycle"
"""Name of the library in the FMU."""
COMMUNICATION_STEP = 1e-3  # s, proposed to a master: the period of commands on the bus


def description(
    version: int, model: FmuModel, variables: Sequence[Variable], token: str, bus: Bus | None = None
) -> str:
    """Return the text. version: 2 or 3; token: GUID or instantiation token. bus: of FMI 3.0 only."""
    root = Xml.Element(
        "fmiModelDescription",
        {
            "fmiVersion": f"{version}.0",
            "modelName": model.name,
            "guid" if version == 2 else "instantiationToken": token,
            "description": "Longitudinal motion of a motorcycle with its throttle servo",
            "generationTool": "slipbench",
            "variableNamingConvention": "structured",
        },
    )
    abilities = _abilities(version, model.step)
    Xml.SubElement(
        root, "CoSimulation", abilities if bus is None else {**abilities, "hasEventMode": "true"}
    )
    _add_units(root, variables)
    step = str(math.ceil(COMMUNICATION_STEP / model.step - 1e-9) * model.step)
    Xml.SubElement(
        root, "DefaultExperiment", {"startTime": "0", "stopTime": "10", "stepSize": step}
    )
    listed = Xml.SubElement(root, "ModelVariables")
    structure = Xml.Element("ModelStructure")
    (_add_variables_2 if version == 2 else _add_variables_3)(listed, structure, variables)
    if bus is not None:
        add_bus(listed, bus, model.step, len(variables) + 1)
        add_bus_output(structure, len(variables) + 1)
    root.append(structure)
    Xml.indent(root)
    return Xml.tostring(root, encoding="unicode", xml_declaration=True)


def _abilities(version: int, step: float) -> dict[str, str]:
    state = "FMUstate" if version == 2 else "FMUState"
    found = {
        "modelIdentifier": IDENTIFIER,
        "canHandleVariableCommunicationStepSize": "true",
        f"canGetAndSet{state}": "true",
        f"canSerialize{state}": "true",
    }
    return found if version == 2 else {**found, "fixedInternalStepSize": repr(step)}


def _add_units(root: Xml.Element, variables: Iterable[Variable]) -> None:
    definitions = Xml.SubElement(root, "UnitDefinitions")
    for name, unit in _units(variables).items():
        exponents = {key: str(power) for key, power in unit.exponents.items()}
        Xml.SubElement(Xml.SubElement(definitions, "Unit", {"name": name}), "BaseUnit", exponents)


def _units(variables: Iterable[Variable]) -> dict[str, Unit]:
    known = (fmi_unit(one.unit) for one in variables)
    return {unit.name: unit for unit in known if unit is not None}


def _add_variables_2(
    listed: Xml.Element, structure: Xml.Element, variables: Sequence[Variable]
) -> None:
    for reference, one in enumerate(variables, start=1):
        entry = Xml.SubElement(listed, "ScalarVariable", _common(one, reference))
        Xml.SubElement(entry, "Real", _number_attributes(one))
    for name in ("Outputs", "InitialUnknowns"):
        part = Xml.SubElement(structure, name)
        for reference in _outputs(variables):
            Xml.SubElement(part, "Unknown", {"index": str(reference)})


def _add_variables_3(
    listed: Xml.Element, structure: Xml.Element, variables: Sequence[Variable]
) -> None:
    time = {"name": "time", "valueReference": "0", "causality": "independent"}
    Xml.SubElement(listed, "Float64", {**time, "variability": "continuous"})
    for reference, one in enumerate(variables, start=1):
        Xml.SubElement(listed, "Float64", {**_common(one, reference), **_number_attributes(one)})
    for name in ("Output", "InitialUnknown"):
        for reference in _outputs(variables):
            Xml.SubElement(structure, name, {"valueReference": str(reference)})


def _outputs(variables: Sequence[Variable]) -> Iterator[int]:
    return (k for k, one in enumerate(variables, start=1) if one.kind == OUTPUT)


def _common(one: Variable, reference: int) -> dict[str, str]:
    found = {"name": one.name, "valueReference": str(reference), "description": one.text}
    if one.kind == INPUT:
        return {**found, "causality": "input", "variability": _variability(one)}
    if one.kind == OUTPUT:
        return {
            **found,
            "causality": "output",
            "variability": "continuous",
            "initial": "calculated",
        }
    return {**found, "causality": "parameter", "variability": "fixed", "initial": "exact"}


def _variability(one: Variable) -> str:
    return "discrete" if one.whole else "continuous"


def _number_attributes(one: Variable) -> dict[str, str]:
    unit = fmi_unit(one.unit)
    found = {} if unit is None else {"unit": unit.name}
    ends = zip(("min", "max"), one.bounds, strict=True)
    found.update({name: repr(end) for name, end in ends if math.isfinite(end)})
    return found if one.kind == OUTPUT else {**found, "start": _text(one.start)}


def _text(value: float) -> str:
    return repr(value) if math.isfinite(value) else ("INF" if value > 0.0 else "-INF")
