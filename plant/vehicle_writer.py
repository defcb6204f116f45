"""A vehicle is written as a vehicle file in SI that reads back as the same vehicle."""

from pathlib import Path
from typing import Any

import tomli_w

from slipbench.plant.channels import CHANNEL_UNITS, DEFAULT_CHANNELS, ChannelTiming
from slipbench.plant.parameters import Block
from slipbench.plant.vehicle_file import Vehicle


def save_vehicle(vehicle: Vehicle, path: str | Path) -> None:
    """Write the vehicle to a TOML file."""
    Path(path).write_text(tomli_w.dumps(vehicle_tree(vehicle)), encoding="utf-8")


def vehicle_tree(vehicle: Vehicle) -> dict[str, Any]:
    """The vehicle as the tree of its file."""
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
    told: dict[str, Any] = {"clock": timing.clock}
    for p in timing.parameters():
        told[p.name] = _quantity(getattr(timing, p.name), p.unit or CHANNEL_UNITS[name], None)
    return told


def _quantity(value: float, unit: str, plus_minus: float | None) -> dict[str, Any]:
    told: dict[str, Any] = {"value": value, "unit": unit}
    if plus_minus is not None:
        told["plus_minus"] = plus_minus
    return told
