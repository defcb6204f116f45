"""Databases that share no name with the bench's own, drawn from a seed, and the bindings to them.

The messages of motorbike.dbc under other names and identifiers, in Motorola order, without private
attributes, in other units, each with a protection of its own; on one bus or split over several.
"""

import tomllib
from dataclasses import dataclass, replace
from pathlib import Path
from random import Random
from typing import Any

import tomli_w

from slipbench import dbc
from slipbench.protocol.binding.binding import Binding, read_binding
from slipbench.protocol.database.database import load_database
from slipbench.protocol.database.layout import Message, Signal

SYLLABLES = ("ka", "lo", "mi", "ru", "ten", "sor", "vel", "bax", "dun", "fi", "gor", "hy")
KINDS = ("E2E1", "E2E2", "crc8", "xor", "sum", "counter")
HEADER = 16  # bits of checksum, free nibble and counter
FREE = range(8, 12)  # bits of the free nibble, in the order in which bits are sent


@dataclass
class Foreign:
    """One drawn database: text of the DBC file and content of the binding file."""

    dbc: str
    binding: dict[str, Any]

    def write(self, folder: Path) -> Path:
        """Write both files; returns the path of the binding."""
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "foreign.dbc").write_text(self.dbc, encoding="utf-8")
        path = folder / "foreign.toml"
        path.write_text(tomli_w.dumps(self.binding), encoding="utf-8")
        return path


def foreign(seed: int, buses: tuple[str, ...] = ()) -> Foreign:
    """Database and binding of a seed. buses: names, over which the messages are split at random."""
    random = Random(f"foreign:{seed}")
    own = load_database(dbc.MOTORBIKE)
    names = _Names(random)
    identifiers = sorted(random.sample(range(1, 0x7F0), len(own.messages)))
    by_priority = sorted(own.messages, key=lambda message: message.identifier)
    roles = tomllib.loads(dbc.MOTORBIKE_ROLES.read_text(encoding="utf-8"))
    renamed: dict[str, str] = {}
    lines, attributes, rules = [], [], {}
    for message, identifier in zip(by_priority, identifiers, strict=True):
        made, kind = _remade(message, identifier, names, random, renamed)
        lines += _text(made)
        if made.cycle_time:
            attributes.append(
                f'BA_ "GenMsgCycleTime" BO_ {identifier} {round(made.cycle_time * 1e3)};'
            )
        if message.attributes.get("GenMsgSendType") == 1:
            attributes.append(f'BA_ "GenMsgSendType" BO_ {identifier} 1;')
        if kind is not None:
            rules[made.name] = {"protection": _rule(kind, made, random)}
    text = "\n".join(
        [
            'VERSION ""',
            "BU_: A B",
            *lines,
            'BA_DEF_ BO_ "GenMsgCycleTime" INT 0 65535;',
            'BA_DEF_ BO_ "GenMsgSendType" ENUM "Cyclic","Event";',
            'BA_DEF_DEF_ "GenMsgCycleTime" 0;',
            'BA_DEF_DEF_ "GenMsgSendType" "Cyclic";',
            *attributes,
            "",
        ]
    )
    binding = _binding(roles, renamed, rules)
    if buses:
        _split(binding, [renamed[message.name] for message in own.messages], buses, seed)
    return Foreign(text, binding)


def _split(binding: dict[str, Any], names: list[str], buses: tuple[str, ...], seed: int) -> None:
    """Name a bus for every message, each bus at least once; those of the first bus by `bus` alone."""
    random = Random(f"buses:{seed}")
    each = [*buses, *random.choices(buses, k=len(names) - len(buses))]
    random.shuffle(each)
    binding["bus"] = buses[0]
    for name, bus in zip(names, each, strict=True):
        if bus != buses[0]:
            binding["messages"].setdefault(name, {})["bus"] = bus


def foreign_binding(seed: int, folder: Path, buses: tuple[str, ...] = ()) -> Binding:
    """Binding of a seed, read from its files."""
    return read_binding(foreign(seed, buses).write(folder))


class _Names:
    def __init__(self, random: Random) -> None:
        self._random, self._taken = random, set[str]()

    def new(self) -> str:
        while True:
            name = "".join(self._random.choice(SYLLABLES) for _ in range(4)).capitalize()
            if name not in self._taken:
                self._taken.add(name)
                return name


def _remade(
    message: Message, identifier: int, names: _Names, random: Random, renamed: dict[str, str]
) -> tuple[Message, str | None]:
    """The message under other names, laid out anew; and the kind of its protection."""
    protected = message.protection is not None
    name = names.new()
    renamed[message.name] = name
    payload = [s for s in message.signals if s.name not in ("crc", "counter")]
    placed = _placed(payload, HEADER if protected else 0)
    signals = []
    inner = {signal.name: names.new() for signal in payload}
    for signal in placed:
        new = inner[signal.name]
        renamed[f"{message.name}.{signal.name}"] = f"{name}.{new}"
        multiplexer = inner.get(signal.multiplexer or "")
        signals.append(_in_other_unit(replace(signal, name=new, multiplexer=multiplexer), random))
    kind = random.choice(KINDS) if protected else None
    if protected:
        signals += [
            Signal(names.new(), 7, 8, little_endian=False, minimum=0, maximum=255),
            Signal(names.new(), 11, 4, little_endian=False, minimum=0, maximum=15),
        ]
    length = 8 if protected else message.length
    return replace(
        message, name=name, identifier=identifier, length=length, signals=tuple(signals)
    ), kind


def _placed(payload: list[Signal], start: int) -> list[Signal]:
    """The signals in Motorola order, one after the other; the last one of a full frame is shortened."""
    free = list(FREE) if start else []
    place = start
    found = []
    pages: dict[tuple[int, ...], int] = {}
    for signal in payload:
        if free and signal.length <= len(free) and not signal.multiplexer:
            at, free = free[0], free[signal.length :]
            found.append(_moved(signal, at, signal.length))
            continue
        at = pages.get(signal.multiplexer_ids, place) if signal.multiplexer else place
        length = signal.length
        same = [s for s in payload if s.multiplexer_ids == signal.multiplexer_ids]
        if signal.multiplexer:
            length = min(length, (64 - place) // len(same))
        length = min(length, 64 - at)
        found.append(_moved(signal, at, length))
        if signal.multiplexer:
            pages[signal.multiplexer_ids] = at + length
        else:
            place = at + length
    return found


def _moved(signal: Signal, at: int, length: int) -> Signal:
    maximum = signal.maximum
    if length < signal.length:
        maximum = ((1 << length) - 1) * signal.scale + signal.offset
    return replace(
        signal,
        start=8 * (at // 8) + 7 - at % 8,
        length=length,
        little_endian=False,
        maximum=maximum,
        wraps=False,
    )


def _in_other_unit(signal: Signal, random: Random) -> Signal:
    """The same physical value in another unit, for some signals."""
    factor = {"m/s": ("km/h", 3.6), "bar": ("kPa", 100.0), "%": ("", 0.01), "mm": ("m", 1e-3)}
    if signal.unit not in factor or random.random() < 0.5:
        return signal
    unit, by = factor[signal.unit]
    return replace(
        signal,
        unit=unit,
        scale=signal.scale * by,
        offset=signal.offset * by,
        minimum=None if signal.minimum is None else signal.minimum * by,
        maximum=None if signal.maximum is None else signal.maximum * by,
    )


def _rule(kind: str, message: Message, random: Random) -> dict[str, Any]:
    checksum, counter = (signal.name for signal in message.signals[-2:])
    match kind:
        case "E2E1":
            return {"profile": "E2E1", "data_id": random.randrange(1 << 16)}
        case "E2E2":
            return {"profile": "E2E2", "data_ids": list(random.randbytes(16))}
        case "counter":
            return {"profile": "plain", "counter": counter}
    rule = {"signal": checksum, "kind": kind, "start": random.randrange(256)}
    if kind == "crc8":
        rule |= {
            "polynomial": random.choice([0x1D, 0x2F, 0x07]),
            "final_xor": random.choice([0, 255]),
        }
    return {"profile": "plain", "counter": counter, "checksum": rule}


def _binding(
    roles: dict[str, Any], renamed: dict[str, str], rules: dict[str, Any]
) -> dict[str, Any]:
    bound = {}
    for role, source in roles["roles"].items():
        made = dict(source)
        for key in ("time_signal", "valid"):
            if key in made:
                made[key] = renamed[made[key]]
        if "signals" in made:
            made["signals"] = [renamed[name] for name in made["signals"]]
        if "teeth" in made:
            teeth, anchor = made["teeth"], made["anchor"]
            made |= {"teeth": renamed[teeth], "anchor": renamed[anchor]}
            made["names"] = _names(renamed, teeth, ("layout", "tooth_count"))
            made["anchor_names"] = _names(
                renamed, anchor, ("tooth_count", "tooth_time", "teeth_per_turn", "faulty")
            )
        bound[role] = made
    return {
        "title": "A database without a known name",
        "database": "foreign.dbc",
        "messages": rules,
        "roles": bound,
    }


def _names(renamed: dict[str, str], message: str, keys: tuple[str, ...]) -> dict[str, str]:
    return {key: renamed[f"{message}.{key}"].partition(".")[2] for key in keys}


def _text(message: Message) -> list[str]:
    lines = ["", f"BO_ {message.identifier} {message.name}: {message.length} A"]
    for signal in message.signals:
        page = "M" if signal.is_multiplexer else ""
        if signal.multiplexer:
            page = f"m{signal.multiplexer_ids[0]}"
        low, high = (0 if each is None else each for each in (signal.minimum, signal.maximum))
        lines.append(
            f" SG_ {signal.name} {page} : {signal.start}|{signal.length}@0"
            f"{'-' if signal.signed else '+'} ({signal.scale!r},{signal.offset!r})"
            f' [{low!r}|{high!r}] "{signal.unit}" B'
        )
    return lines
