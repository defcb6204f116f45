"""CAN messages as JSON, with a JSON Schema: type, unit, comment and value table of each signal.

    {"crank_speed": 1047.2, "gear": 2}       at the topic /can0/EngineStatus

Numbers are in the database's unit and exact. A signal has no member where the frame does not hold it
(multiplexed), or where it holds no number (NaN or infinite: JSON lacks them; the raw frame has them).

The schema keeps to what Foxglove, Lichtblick and PlotJuggler read: one type for each member, and
`oneOf` with `const` and `title` for an enumeration. `unit` is an annotation, as the standard permits.
"""

import json
from collections import Counter
from typing import Any

import numpy as np

from slipbench.protocol.database.layout import Message, Signal
from slipbench.protocol.logs.decode import Frames, Samples, SortedLog

LARGEST_ENUMERATION = 8  # bits
Tree = dict[str, Any]


def topic_of(bus: str, name: str) -> str:
    """Topic of a message, or of the raw frames, of a bus."""
    return f"/{bus}/{name}"


def message_schema(message: Message) -> Tree:
    """JSON Schema of the decoded values of a message."""
    members = {signal.name: signal_schema(signal) for signal in message.signals}
    return object_schema(message.name, message.comment, members)


def object_schema(title: str, description: str, members: Tree) -> Tree:
    """JSON Schema of an object of which each member may be absent, and no other is allowed."""
    text = {"description": description} if description else {}
    closed = {"properties": members, "additionalProperties": False}
    return {"title": title, "type": "object", **text, **closed}


def quantity_schema(unit: str, description: str = "", kind: str = "number") -> Tree:
    """JSON Schema of a number with a unit. kind: "number" or "integer"."""
    text = " ".join(filter(None, (description, f"[{unit}]" if unit else "")))
    return {
        "type": kind,
        **({"description": text} if text else {}),
        **({"unit": unit} if unit else {}),
    }


def signal_schema(signal: Signal) -> Tree:
    """JSON Schema of one signal; every value that its bits can hold is valid."""
    schema = quantity_schema(
        signal.unit, signal.comment, "integer" if _is_integer(signal) else "number"
    )
    if not signal.choices:
        return schema
    if _is_enumeration(signal):
        low, high = signal.raw_range
        return {**schema, "oneOf": _named(signal, range(low, high + 1))}
    return {**schema, "choices": _named(signal, signal.choices)}


def _is_integer(signal: Signal) -> bool:
    integral = float(signal.scale).is_integer() and float(signal.offset).is_integer()
    return integral and not signal.is_float


def _is_enumeration(signal: Signal) -> bool:
    """Whether the values are names alone: a quantity with a few special values has a unit or scale."""
    plain = not signal.unit and not signal.is_float and (signal.scale, signal.offset) == (1, 0)
    return plain and signal.length <= LARGEST_ENUMERATION


def _named(signal: Signal, values: Any) -> list[Tree]:
    """Physical values with their names: unique, and the number itself where it has no name."""
    uses = Counter(signal.choices.values())
    named = []
    for raw in values:
        value = raw * signal.scale + signal.offset
        name = signal.choices.get(raw, str(raw))
        title = name if uses[name] < 2 else f"{name} ({raw})"
        named.append({"title": title, "const": value})
    return named


def json_messages(
    sorted_log: SortedLog, names: set[str] | None = None
) -> tuple[list[tuple[Message, bytes] | None], int]:
    """Message and values (JSON) of each frame of a log, None where not known; number of samples.

    names: decode these messages alone
    """
    found: list[tuple[Message, bytes] | None] = [None] * len(sorted_log.log)
    samples = 0
    for name, frames in sorted_log.frames.items():
        if len(frames) and (names is None or name in names):
            texts, count = _texts(frames)
            samples += count
            for row, text in zip(frames.rows.tolist(), texts, strict=True):
                found[row] = frames.message, text
    return found, samples


def _texts(frames: Frames) -> tuple[list[bytes], int]:
    """JSON of each frame of a message, and the number of samples."""
    texts: list[list[str]] = [[] for _ in range(len(frames))]
    samples = 0
    for signal in frames.message.signals:
        name, held = json.dumps(signal.name), frames.samples(signal.name)
        places = np.searchsorted(frames.rows, held.rows).tolist()
        samples += len(places)
        for place, value in zip(places, _values(held), strict=True):
            if value:
                texts[place].append(f"{name}:{value}")
    return [("{" + ",".join(values) + "}").encode("ascii") for values in texts], samples


def _values(samples: Samples) -> list[str]:
    """Values as JSON; empty where JSON has no number."""
    texts = list(map(repr, samples.exact.tolist()))
    for row in np.flatnonzero(~np.isfinite(samples.value.astype(np.float64))).tolist():
        texts[row] = ""
    return texts
