"""Write a vehicle file: a new one in SI, or an existing one with new numbers."""

from pathlib import Path
from typing import Any

import tomli_w

from slipbench.plant.channels import CHANNEL_UNITS, DEFAULT_CHANNELS, ChannelTiming
from slipbench.plant.parameters import Block
from slipbench.plant.toml_text import edited, is_quantity
from slipbench.plant.units import to_si
from slipbench.plant.vehicle_file import Vehicle


def save_vehicle(vehicle: Vehicle, path: str | Path) -> None:
    """Write a vehicle file in SI, which reads back as the same vehicle. Raises OSError."""
    Path(path).write_text(tomli_w.dumps(vehicle_tree(vehicle)), encoding="utf-8")


def edited_vehicle(text: str, before: Vehicle, after: Vehicle) -> str:
    """Return the text of a vehicle file with what differs between two vehicles.

    text: the file of `before`. Comments, order and units stay; new numbers have nine digits.
    """
    return edited(text, _changes(vehicle_tree(before), vehicle_tree(after)), _linear)


def _linear(unit: str, to: str) -> tuple[float, float]:
    offset = to_si(0.0, unit, to)
    return to_si(1.0, unit, to) - offset, offset


def _changes(before: dict[str, Any], after: dict[str, Any]) -> dict[str, Any]:
    """Entries of a tree that are new or changed; quantities and tables of lists completely."""
    found: dict[str, Any] = {}
    for key, value in after.items():
        old = before.get(key)
        if isinstance(value, list):
            found[key] = [table for table in value if table not in (old or ())]
        elif isinstance(value, dict) and isinstance(old, dict) and not is_quantity(value):
            found[key] = _changes(old, value)
        elif value != old:
            found[key] = value
    return {key: value for key, value in found.items() if value not in ({}, [])}


def vehicle_tree(vehicle: Vehicle) -> dict[str, Any]:
    """Tree of a vehicle file in SI."""
    bike, known = vehicle.motorcycle, vehicle.plus_minus
    tree: dict[str, Any] = {"name": vehicle.name, "description": vehicle.description}
    tree["gears"] = {
        str(i): _quantity(ratio, "1", known.get(f"gears.{i}"))
        for i, ratio in enumerate(bike.gears, start=1)
    }
    for name, block in bike.blocks():
        tree[name] = _block(block, name, known)
    tree["effects"] = [
        {"name": effect.name, **_words(effect), **_block(effect, f"effects.{effect.key}", known)}
        for effect in bike.effects
    ]
    tree["channels"] = {
        name: _channel(name, timing)
        for name, timing in vehicle.channels.items()
        if timing != DEFAULT_CHANNELS[name]
    }
    return tree


def _words(block: Block) -> dict[str, str]:
    return {name: getattr(block, name) for name in block.words()}


def _block(block: Block, key: str, known: Any) -> dict[str, Any]:
    own = CHANNEL_UNITS.get(getattr(block, "channel", ""), "1")
    return {
        p.name: _quantity(getattr(block, p.name), p.unit or own, known.get(f"{key}.{p.name}"))
        for p in block.parameters()
    }


def _channel(name: str, timing: ChannelTiming) -> dict[str, Any]:
    entry: dict[str, Any] = {"clock": timing.clock}
    for p in timing.parameters():
        entry[p.name] = _quantity(getattr(timing, p.name), p.unit or CHANNEL_UNITS[name], None)
    return entry


def _quantity(value: float, unit: str, plus_minus: float | None) -> dict[str, Any]:
    entry: dict[str, Any] = {"value": value, "unit": unit}
    if plus_minus is not None:
        entry["plus_minus"] = plus_minus
    return entry
