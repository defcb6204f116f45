"""A model file is written with the numbers and effects that were found."""

from collections.abc import Mapping, Sequence
from typing import Any

import tomli_w

from slipbench.identification.mismatch.systems.effects.seam_effect import SeamEffect
from slipbench.identification.mismatch.systems.model_file import ModelFile
from slipbench.plant.signals import Floats


def as_text(
    file: ModelFile, values: Floats, effects: Sequence[SeamEffect], known: Mapping[str, float]
) -> str:
    """Return the text of the file, parameters in base units."""
    tree = file.model_dump(exclude_defaults=True, exclude={"effects", "parameters"})
    tree["step"] = f"{file.step} s"
    for k, (name, number) in enumerate(file.parameters.items()):
        entry = {"value": float(values[k]), "unit": number.si_unit}
        entry["plus_minus"] = known[f"parameters.{name}"]
        tree.setdefault("parameters", {})[name] = entry
    if effects:
        tree["effects"] = [_effect(effect, known) for effect in effects]
    return tomli_w.dumps(_without_none(tree))


def _effect(effect: SeamEffect, known: Mapping[str, float]) -> dict[str, Any]:
    entry: dict[str, Any] = {"name": effect.name, "at": effect.place.name}
    if effect.place.other:
        entry["using"] = effect.place.other
    values = {}
    for p in effect.parameters():
        number: dict[str, Any] = {"value": float(getattr(effect, p.name)), "unit": p.unit}
        if (half := known.get(f"effects.{effect.key}.{p.name}")) is not None:
            number["plus_minus"] = half
        values[p.name] = number
    return {**entry, "values": values}


def _without_none(tree: Any) -> Any:
    if isinstance(tree, dict):
        return {k: _without_none(v) for k, v in tree.items() if v is not None}
    return tree
