"""A vehicle file describes one motorcycle: parameters, units, how well they are
known, effects.

TOML. A parameter is `{ value = 245, unit = "kg", plus_minus = 5 }`; plus_minus is the half width of
what is reliable with 95 %. Blocks are tables, gears are `[gears]` with keys 1, 2, ...; effects are
`[[effects]]` with a `name`; `[engine.full_load]` is a table of the torque over the speed in place
of the hump's three numbers; `[channels.<name>]` states how a channel is sampled. What is left out
keeps the default of its block; what is misspelt is an error.
"""

import math
import os
import stat
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from pathlib import Path
from types import MappingProxyType
from typing import Any, TypeVar

import numpy as np

from slipbench.plant.blocks import Engine
from slipbench.plant.channels import CHANNEL_UNITS, DEFAULT_CHANNELS, ChannelTiming
from slipbench.plant.effects.full_load_table import FullLoadTable, full_load_table
from slipbench.plant.effects.library import BY_NAME
from slipbench.plant.errors import ParameterError, VehicleFileError, nearest
from slipbench.plant.motorcycle import BLOCK_NAMES, Motorcycle
from slipbench.plant.parameters import Block, Parameter, check_word
from slipbench.plant.signals import Floats
from slipbench.plant.units import to_si

AnyBlock = TypeVar("AnyBlock", bound=Block)
TOP = ("name", "description", "gears", "effects", "channels", *BLOCK_NAMES)
LARGEST = 4_000_000  # bytes of a vehicle file
QUANTITY = ("value", "unit", "plus_minus")
FULL_LOAD = {"speed": "rad/s", "torque": "N m"}
FEWEST = 3  # points of a table of the torque
HUMP = ("peak_torque", "peak_speed", "torque_width")


@dataclass(frozen=True)
class Vehicle:
    """A motorcycle, how well its numbers are known, and how its channels are sampled.

    name         of the motorcycle
    description  text for people
    gears        overall ratio of each gear: crank turns per turn of the rear wheel
    effects      physics beyond the nominal equations
    channels     how each channel is sampled

    plus_minus: 95 % half widths in SI by '<block>.<parameter>', 'gears.<n>' or
    'effects.<effect>.<parameter>', with the effect's subject, if it has one, after its name.
    channels: every channel, defaults where the file is silent.
    """

    name: str
    motorcycle: Motorcycle = field(default_factory=Motorcycle)
    plus_minus: Mapping[str, float] = field(default_factory=dict)
    channels: Mapping[str, ChannelTiming] = field(default_factory=lambda: DEFAULT_CHANNELS)
    description: str = ""


def load_vehicle(path: str | Path) -> Vehicle:
    """The vehicle that the file describes. Raises VehicleFileError, which names the remedy."""
    path = Path(path)
    try:
        tree = tomllib.loads(_text(path))
    except (OSError, ValueError) as trouble:  # UnicodeDecodeError and TOMLDecodeError among them
        raise VehicleFileError(
            "cannot be read", str(path), "a TOML file", str(trouble), "correct the file or its path"
        ) from trouble
    except RecursionError as trouble:
        raise VehicleFileError(
            "nested too deeply", str(path), "tables and lists", "a deep nest", "correct the file"
        ) from trouble
    return _Reader(path.name).vehicle(tree)


def _text(path: Path) -> str:
    """Text of a regular file. A FIFO or a device, which may have no end, raises OSError."""
    descriptor = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
    if not stat.S_ISREG(os.fstat(descriptor).st_mode):
        os.close(descriptor)
        raise OSError("not a regular file")
    with os.fdopen(descriptor, "rb") as file:
        content = file.read(LARGEST + 1)
    if len(content) > LARGEST:
        raise OSError(f"more than {LARGEST:,} bytes")
    return content.decode("utf-8")


@dataclass(frozen=True)
class _Reader:
    """Walks the tree of one file and keeps what is known of every number."""

    file: str
    known: dict[str, float] = field(default_factory=dict)

    def vehicle(self, tree: dict[str, Any]) -> Vehicle:
        self.keys(tree, TOP, "")
        tables = self.full_load(tree)
        blocks = {name: self.block(tree, name) for name in BLOCK_NAMES}
        channels = self.channels(self.table(tree, "channels"))
        effects = tables + tuple(
            self.effect(entry, i, channels) for i, entry in enumerate(self.effects(tree))
        )
        gears = {"gears": self.gears(self.table(tree, "gears"))} if "gears" in tree else {}
        try:
            motorcycle = Motorcycle(**blocks, **gears, effects=effects)  # type: ignore[arg-type]
        except ParameterError as trouble:
            raise self.located(trouble, trouble.where) from trouble
        return Vehicle(
            name=self.text(tree, "name", required=True),
            motorcycle=motorcycle,
            plus_minus=MappingProxyType(self.known),
            channels=channels,
            description=self.text(tree, "description"),
        )

    def block(self, tree: dict[str, Any], name: str) -> Block:
        kind: type[Block] = type(getattr(_NOMINAL, name))
        return self.filled(kind, self.table(tree, name), name, name)

    def filled(
        self,
        kind: type[Block],
        table: dict[str, Any],
        path: str,
        key: str,
        words: Mapping[str, str] = MappingProxyType({}),
    ) -> Block:
        described = {p.name: p for p in kind.parameters()}
        inner = ("full_load",) if kind is Engine else ()
        self.keys(table, [*described, *kind.words(), *inner], path)
        own = CHANNEL_UNITS.get(words.get("channel", ""))
        values = {
            name: self.quantity(
                entry,
                described[name],
                f"{path}.{name}",
                f"{key}.{name}",
                described[name].unit or own,
            )
            for name, entry in table.items()
            if name not in inner
        }
        return self.made(kind, {**values, **words}, path)

    def made(self, kind: type[AnyBlock], values: Mapping[str, Any], path: str) -> AnyBlock:
        try:
            return kind(**values)
        except ParameterError as trouble:
            raise self.located(trouble, f"{path}.{trouble.where.split('.')[-1]}") from trouble

    def full_load(self, tree: dict[str, Any]) -> tuple[FullLoadTable, ...]:
        """The table of the engine's torque, which takes the place of the hump, if there is one."""
        engine, path = self.table(tree, "engine"), "engine.full_load"
        if "full_load" not in engine:
            return ()
        table = self.table(engine, "full_load", "engine.")
        self.keys(table, FULL_LOAD, path)
        if both := [f"engine.{name}" for name in HUMP if name in engine]:
            raise self.trouble("a hump and a table", path, "one of both", ", ".join(both))
        speed, torque = (self.column(table, n, path, unit) for n, unit in FULL_LOAD.items())
        if speed.size != torque.size or speed.size < FEWEST or np.any(np.diff(speed) <= 0.0):
            expected = f"at least {FEWEST} ascending speeds, and a torque for each"
            found = {name: column["value"] for name, column in table.items()}
            raise self.trouble("not a table", path, expected, found)
        self.known.update({f"engine.{name}": 0.0 for name in HUMP})
        return (full_load_table(speed, torque),)

    def column(self, table: dict[str, Any], name: str, path: str, unit: str) -> Floats:
        """A list of numbers with a unit, in SI, shape (points,)."""
        entry, where = table.get(name), f"{path}.{name}"
        if not isinstance(entry, dict) or not isinstance(entry.get("value"), list):
            example = f'{{ value = [1, 2, 3], unit = "{unit}" }}'
            raise self.trouble("a list of numbers is needed", where, example, entry)
        self.keys(entry, QUANTITY[:2], where)
        points = ({"value": value, "unit": entry.get("unit")} for value in entry["value"])
        return np.array([self.number(point, "value", where, unit) for point in points])

    def effects(self, tree: dict[str, Any]) -> list[dict[str, Any]]:
        entries = tree.get("effects", [])
        if isinstance(entries, list) and all(isinstance(e, dict) and "name" in e for e in entries):
            return entries
        raise self.trouble("effects are malformed", "effects", "[[effects]] with a name", entries)

    def effect(
        self, entry: dict[str, Any], number: int, channels: Mapping[str, ChannelTiming]
    ) -> Any:
        where, name = f"effects[{number}]", entry["name"]
        if not isinstance(name, str) or name not in BY_NAME:
            raise VehicleFileError(
                "no such effect",
                f"{self.file}: {where}.name",
                "an effect of the library",
                f"'{name}'",
                nearest(str(name), BY_NAME),
            )
        kind = BY_NAME[name]
        given = {
            word: self.text(entry, word, path=f"{where}.") for word in kind.words() if word in entry
        }
        table = {key: value for key, value in entry.items() if key != "name" and key not in given}
        named = self.made(kind, given, where)
        words = {word: getattr(named, word) for word in kind.words()}
        known = {
            "channel": {name for name, timing in channels.items() if timing.period > 0.0},
            "clock": {timing.clock for timing in channels.values()},
        }
        for word in known.keys() & words.keys():
            self.word(words[word], tuple(sorted(known[word])), f"{where}.{word}")
        return self.filled(kind, table, where, f"effects.{named.key}", words)

    def word(self, value: str, choices: tuple[str, ...], path: str) -> None:
        try:
            check_word(value, choices, path)
        except ParameterError as trouble:
            raise self.located(trouble, path) from trouble

    def gears(self, table: dict[str, Any]) -> tuple[float, ...]:
        self.keys(table, [str(i) for i in range(1, len(table) + 1)], "gears")
        return tuple(
            self.quantity(table[gear], RATIO, f"gears.{gear}", f"gears.{gear}")
            for gear in sorted(table, key=int)
        )

    def channels(self, table: dict[str, Any]) -> Mapping[str, ChannelTiming]:
        self.keys(table, CHANNEL_UNITS, "channels")
        stated = {name: self.channel(self.table(table, name, "channels."), name) for name in table}
        return MappingProxyType({**DEFAULT_CHANNELS, **stated})

    def channel(self, table: dict[str, Any], name: str) -> ChannelTiming:
        path = f"channels.{name}"
        described = {p.name: p for p in ChannelTiming.parameters()}
        self.keys(table, ["clock", *described], path)
        given: dict[str, Any] = {
            f.name: getattr(DEFAULT_CHANNELS[name], f.name) for f in fields(ChannelTiming)
        }
        for key, entry in table.items():
            if key == "clock":
                given[key] = self.text(table, key, path=f"{path}.")
                continue
            unit = described[key].unit or CHANNEL_UNITS[name]
            given[key] = self.quantity(entry, described[key], f"{path}.{key}", None, unit)
        try:
            return ChannelTiming(**given)
        except ParameterError as trouble:
            raise self.located(trouble, f"{path}.{trouble.where.split('.')[-1]}") from trouble

    def quantity(
        self, entry: Any, described: Parameter, path: str, key: str | None, unit: str | None = None
    ) -> float:
        if not isinstance(entry, dict) or not {"value", "unit"} <= entry.keys():
            example = f'{{ value = {described.typical:g}, unit = "{unit or described.unit}" }}'
            raise self.trouble("a quantity needs value and unit", path, example, entry)
        self.keys(entry, QUANTITY if key else QUANTITY[:2], path)
        si = unit or described.unit
        boundless = math.isinf(described.absent)  # a limit without effect is infinite
        value = self.number(entry, "value", path, si, boundless=boundless)
        if "plus_minus" in entry and key:
            half = abs(self.number(entry, "plus_minus", path, si))
            if not key.startswith("effects."):  # those are results, which nothing starts from
                self.check_half_width(half, value, described, path, entry)
            self.known[key] = half
        return value

    def check_half_width(
        self, half: float, value: float, described: Parameter, path: str, entry: dict[str, Any]
    ) -> None:
        """Refuse a half width that says nothing: a wrong unit, or a wrong exponent."""
        factor = described.low >= 0.0 and value > 0.0
        most = MOST_HALF_WIDTHS * value if factor else described.high - described.low
        if half > most:
            reason = f"{MOST_HALF_WIDTHS:g} times the value" if factor else "the width of its range"
            written = entry["plus_minus"]
            limit = f"at most {most / half * abs(written):.3g} {entry['unit']}, {reason}"
            raise self.trouble("the half width is too large", f"{path}.plus_minus", limit, written)

    def number(
        self, entry: dict[str, Any], key: str, path: str, si: str, *, boundless: bool = False
    ) -> float:
        value, unit = entry[key], entry["unit"]
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            raise self.trouble(f"{key} is not a number", f"{path}.{key}", "a number", value)
        infinite = boundless and isinstance(value, float) and math.isinf(value)
        if not (infinite or abs(value) <= _LARGEST):  # nan too; a larger integer is no float
            raise self.trouble(f"{key} is not finite", f"{path}.{key}", "a finite number", value)
        try:
            return to_si(value, str(unit), si)
        except ValueError as trouble:
            raise self.trouble("wrong unit", f"{path}.unit", str(trouble), unit) from trouble

    def table(self, tree: dict[str, Any], name: str, path: str = "") -> dict[str, Any]:
        table = tree.get(name, {})
        if not isinstance(table, dict):
            raise self.trouble("not a table", path + name, f"[{path}{name}]", table)
        return table

    def text(
        self, tree: dict[str, Any], key: str, *, required: bool = False, path: str = ""
    ) -> str:
        value = tree.get(key, None if required else "")
        if not isinstance(value, str) or (required and not value):
            raise self.trouble(f"{key} is missing or no text", path + key, "a text", value)
        return value

    def keys(self, table: dict[str, Any], known: Any, path: str) -> None:
        for key in table:
            if key not in known:
                raise VehicleFileError(
                    "unknown key",
                    f"{self.file}: {path + '.' if path else ''}{key}",
                    "a key that means something here",
                    f"'{key}'",
                    nearest(key, known),
                )

    def trouble(self, what: str, path: str, expected: str, found: Any) -> VehicleFileError:
        remedy = "correct it in the file"
        return VehicleFileError(what, f"{self.file}: {path}", expected, repr(found), remedy)

    def located(self, trouble: ParameterError, path: str) -> VehicleFileError:
        return VehicleFileError(
            trouble.what, f"{self.file}: {path}", trouble.expected, trouble.found, trouble.remedy
        )


MOST_HALF_WIDTHS = 10.0
"""Largest half width (95 %) of a positive number, in values: it then errs by a factor of 22 000."""
_NOMINAL = Motorcycle()
_LARGEST = 1e300  # of a number in the file; larger integers are no floats
RATIO = Parameter("ratio", "1", "overall ratio of a gear", 1.0, 40.0, 8.75, 8.75, False)
