"""Tables of the vehicle file, and of the effects of vehicle and model files."""

from collections.abc import Iterable
from dataclasses import replace

from slipbench.identification.mismatch.systems.effects.library import LIBRARY as OF_MODELS
from slipbench.plant.blocks import Engine
from slipbench.plant.channels import CHANNEL_UNITS, DEFAULT_CHANNELS, ChannelTiming
from slipbench.plant.effects.library import LIBRARY
from slipbench.plant.motorcycle import Motorcycle
from slipbench.plant.parameters import Block, Parameter
from slipbench.plant.vehicle_file import RATIO, TOP, Vehicle
from slipbench.reference.meanings import meanings, prose
from slipbench.reference.page import Key, Table, grid
from slipbench.reference.places import acts_at

NOMINAL = Motorcycle()


def vehicle_tables() -> tuple[Table | str, ...]:
    """Top level, gears, each block, channels."""
    blocks = tuple(_block(f"`{name}`", block) for name, block in NOMINAL.blocks())
    return (_top(), _gears(), *blocks, _channels(), "## Defaults of the channels", _defaults())


def effect_tables() -> tuple[Table, ...]:
    """One table for each effect of vehicle files."""
    return tuple(_effect(effect) for effect in LIBRARY)


def model_effect_tables() -> tuple[Table, ...]:
    """One table for each effect of model files, with the places where it may act."""
    tables = ((effect, _effect(effect)) for effect in OF_MODELS)
    return tuple(replace(t, text=f"{t.text}\n\n{acts_at(effect)}") for effect, t in tables)


def _top() -> Table:
    found = meanings(Vehicle)
    blocks = dict(NOMINAL.blocks())
    rows = []
    for name in TOP:
        if name in blocks:
            rows.append(Key(name, "table", "", "", prose(type(blocks[name])).split("\n\n")[0]))
        else:
            default = "required" if name == "name" else ""
            rows.append(Key(name, _KINDS[name], default, "", found.get(name, "")))
    return Table("Top level", "", tuple(rows))


_KINDS = {
    "name": "text",
    "description": "text",
    "gears": "table",
    "effects": "list of: table",
    "channels": "table",
}


def _gears() -> Table:
    rows = (
        Key(f"{number}", "1", f"{ratio:g}", _range(RATIO), RATIO.text)
        for number, ratio in enumerate(NOMINAL.gears, start=1)
    )
    return Table("`gears`", "Any number of gears, counted from 1 without a gap.", tuple(rows))


def _block(title: str, block: Block) -> Table:
    default = {p.name: getattr(block, p.name) for p in block.parameters()}
    rows = (*_rows(block.parameters(), default), *(FULL_LOAD if isinstance(block, Engine) else ()))
    return Table(title, prose(type(block)), rows)


FULL_LOAD = (
    Key("full_load.speed", "rad/s", "none", "ascending", "list of the speeds of a torque table"),
    Key("full_load.torque", "N m", "none", "3 or more", "list of the torques at full load"),
)


def _effect(effect: type[Block]) -> Table:
    words = tuple(
        Key(
            field.name,
            "text",
            str(field.default),
            ", ".join(effect.words()[field.name]),
            field.metadata["word"],
        )
        for field in effect.__dataclass_fields__.values()
        if "word" in field.metadata
    )
    default = {p.name: p.typical for p in effect.parameters()}
    title = f"`{effect.__dict__['name']}`"
    return Table(title, prose(effect), words + tuple(_rows(effect.parameters(), default)))


def _rows(parameters: Iterable[Parameter], default: dict[str, float]) -> Iterable[Key]:
    for p in parameters:
        unit = p.unit or "of the channel"
        yield Key(p.name, unit, f"{default[p.name]:.6g}", _range(p), p.text)


def _range(p: Parameter) -> str:
    whole = "whole, " if p.whole else ""
    absent = f", or {p.absent:g}" if not p.low <= p.absent <= p.high else ""
    return f"{whole}{p.low:.6g} to {p.high:.6g}{absent}"


def _channels() -> Table:
    found = meanings(ChannelTiming)
    clock = Key("clock", "text", "see below", "", found.get("clock", ""))
    rows = tuple(
        Key(p.name, p.unit or "of the channel", "see below", _range(p), p.text)
        for p in ChannelTiming.parameters()
    )
    return Table("`channels.NAME`", prose(ChannelTiming), (clock, *rows))


def _defaults() -> str:
    head = ("channel", "unit", "clock", *(p.name for p in ChannelTiming.parameters()))
    return grid(
        head,
        (
            (f"`{name}`", unit, timing.clock, *(f"{value:.6g}" for value in timing.values()))
            for name, unit in CHANNEL_UNITS.items()
            for timing in [DEFAULT_CHANNELS[name]]
        ),
    )
