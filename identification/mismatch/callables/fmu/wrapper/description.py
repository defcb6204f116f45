"""modelDescription.xml of a wrapper, from that of the wrapped FMU."""

import math
from collections.abc import Iterable, Mapping
from contextlib import suppress
from xml.etree import ElementTree as Xml

from slipbench.identification.mismatch.callables.fmu.plan import Plan
from slipbench.identification.mismatch.callables.fmu.wrapper.sides import Sides
from slipbench.identification.mismatch.callables.fmu.wrapper.sizes import EffectSize, effect_sizes
from slipbench.identification.mismatch.callables.fmu.wrapper.tables import (
    calibrated_values,
    first_reference,
)
from slipbench.plant.fmu.units import Unit, fmi_unit

IDENTIFIER = "with_effects"
"""Name of the library in the wrapper."""
INTERFACES = ("ModelExchange", "CoSimulation", "ScheduledExecution")
ONCE = "canBeInstantiatedOnlyOncePerProcess"
TOKENS = {"2.0": "guid", "3.0": "instantiationToken"}


def description(sides: Sides, token: str) -> str:
    """Return the text. token: GUID or instantiation token of the wrapper."""
    plan = sides.opened.plan
    root = Xml.parse(plan.fmu.folder / "modelDescription.xml").getroot()
    root.set(TOKENS[plan.fmu.version], token)
    root.set("generationTool", "slipbench")
    effects = ", ".join(e.key for e in sides.acting) or "calibrated parameters"
    root.set("description", f"{root.get('modelName')} with {effects}")
    root.attrib.pop("numberOfEventIndicators", None)
    _offer_co_simulation(root, plan)
    _set_step(root, plan.step)
    _start_from(root, calibrated_values(sides))
    sizes = effect_sizes(sides)
    units = {size.name: _unit(size) for size in sizes}
    _define(root, [unit for unit in units.values() if unit is not None])
    listed = root.find("ModelVariables")
    assert listed is not None
    for reference, size in enumerate(sizes, start=first_reference(sides)):
        _add(listed, size, units[size.name], reference, plan.fmu.version)
    Xml.indent(root)
    return Xml.tostring(root, encoding="unicode", xml_declaration=True)


def _offer_co_simulation(root: Xml.Element, plan: Plan) -> None:
    """Replace all interfaces by co-simulation and remove the elements of other interfaces."""
    interfaces = [e for name in INTERFACES for e in root.findall(name)]
    only_once = any(e.get(ONCE) == "true" for e in interfaces)
    for element in interfaces:
        root.remove(element)
    own = {"modelIdentifier": IDENTIFIER, "canHandleVariableCommunicationStepSize": "false"}
    root.insert(0, Xml.Element("CoSimulation", {**own, **({ONCE: "true"} if only_once else {})}))
    structure = root.find("ModelStructure")
    assert structure is not None
    for element in structure.findall("EventIndicator"):
        structure.remove(element)


def _set_step(root: Xml.Element, step: float) -> None:
    experiment = root.find("DefaultExperiment")
    if experiment is not None:
        experiment.set("stepSize", repr(step))


def _start_from(root: Xml.Element, calibrated: Mapping[int, float]) -> None:
    """Write the calibrated parameters as start values."""
    for variable in root.findall("ModelVariables/*"):
        reference = int(variable.get("valueReference", "-1"))
        holder = variable.find("Real") if variable.tag == "ScalarVariable" else variable
        if reference in calibrated and holder is not None and "start" in holder.attrib:
            holder.set("start", repr(calibrated[reference]))


def _define(root: Xml.Element, units: Iterable[Unit]) -> None:
    definitions = root.find("UnitDefinitions")
    if definitions is None:
        definitions = Xml.Element("UnitDefinitions")
        root.insert(1, definitions)  # after the interface
    known = {e.get("name") for e in definitions}
    for unit in units:
        if unit.name not in known:
            known.add(unit.name)
            exponents = {key: str(power) for key, power in unit.exponents.items()}
            entry = Xml.SubElement(definitions, "Unit", {"name": unit.name})
            Xml.SubElement(entry, "BaseUnit", exponents)
    if not len(definitions):
        root.remove(definitions)


def _unit(size: EffectSize) -> Unit | None:
    with suppress(ValueError):
        return fmi_unit(size.known.unit)
    return None


def _add(
    listed: Xml.Element, size: EffectSize, unit: Unit | None, reference: int, version: str
) -> None:
    common = {
        "name": size.name,
        "valueReference": str(reference),
        "description": size.known.text,
        "causality": "parameter",
        "variability": "fixed",
        "initial": "exact",
    }
    number = {} if unit is None else {"unit": unit.name}
    ends = zip(("min", "max"), size.bounds, strict=True)
    number |= {name: repr(float(end)) for name, end in ends if math.isfinite(end)}
    number["start"] = repr(size.value)
    if version == "2.0":
        Xml.SubElement(Xml.SubElement(listed, "ScalarVariable", common), "Real", number)
    else:
        Xml.SubElement(listed, "Float64", {**common, **number})
