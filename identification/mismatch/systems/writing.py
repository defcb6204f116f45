"""Write a model file with new numbers and the effects that were found."""

from collections.abc import Mapping, Sequence
from typing import Any

from slipbench.identification.mismatch.simulation.written_units import WrittenUnits
from slipbench.identification.mismatch.systems.effects.seam_effect import SeamEffect
from slipbench.identification.mismatch.systems.model_file import ModelFile
from slipbench.plant.signals import Floats
from slipbench.plant.toml_text import edited
from slipbench.protocol.units import linear


def as_text(
    source: str,
    file: ModelFile,
    values: Floats,
    effects: Sequence[SeamEffect],
    known: Mapping[str, float],
    written: WrittenUnits,
) -> str:
    """Return the text of a model file with new parameters and effects.

    source: text as it was; its comments, order and units stay. values: of the parameters, SI;
    known: 95 % half widths, SI. New effects are written in the units of the file.
    """
    wanted: dict[str, Any] = {"name": file.name, "description": file.description}
    wanted["parameters"] = {
        name: _parameter(float(value), number.si_unit, known[f"parameters.{name}"])
        for (name, number), value in zip(file.parameters.items(), values, strict=True)
    }
    there = {(e.name, e.at) for e in file.effects}
    wanted["effects"] = [
        _effect(e, known, written, new=(e.name, e.place.name) not in there) for e in effects
    ]
    return edited(source, {key: value for key, value in wanted.items() if value}, linear)


def _parameter(value: float, unit: str, half: float) -> dict[str, Any]:
    return {"value": value, "unit": unit, "plus_minus": half}


def _effect(
    effect: SeamEffect, known: Mapping[str, float], written: WrittenUnits, new: bool
) -> dict[str, Any]:
    place = effect.place
    entry: dict[str, Any] = {"name": effect.name, "at": place.name}
    if place.other:
        entry["using"] = place.other
    names = [name.replace("_", " ") for name in (place.name, place.other) if name]
    values = {}
    for p in effect.parameters():
        factor, unit = written.factor(p.unit, *names) if new else (1.0, p.unit)
        number: dict[str, Any] = {"value": factor * float(getattr(effect, p.name)), "unit": unit}
        if (half := known.get(f"effects.{effect.key}.{p.name}")) is not None:
            number["plus_minus"] = factor * half
        values[p.name] = number
    return {**entry, "values": values}
