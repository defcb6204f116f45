"""Messages of topics, as robots and data systems log them, as channels: numbers by their path.

    {"imu": {"acc": [1.0, 2.0]}} on the topic /bus/imu -> bus/imu.acc[0], bus/imu.acc[1]

Times are those of the header's stamp where every message of the topic has one, else those at which
the message was logged.
"""

from array import array
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from slipbench.protocol.errors import InputError
from slipbench.protocol.tables.groups import Group, table_of_groups
from slipbench.protocol.tables.ros_units import ros_unit
from slipbench.protocol.tables.table import Table

MOST_ELEMENTS = 64  # of an array that is expanded; images and scans are longer
MOST_DEPTH = 16  # of messages in messages
MOST_VALUES = 50_000_000  # of a file
STAMPS = (("header.stamp.sec", "header.stamp.nanosec"), ("header.stamp.secs", "header.stamp.nsecs"))

SEQUENCES = (list, tuple, np.ndarray, array, bytearray, memoryview)


@dataclass
class Topics:
    """Collects the messages of a file. omitted: topic and reason -> number of messages."""

    where: str
    topics: dict[str, "_Topic"] = field(default_factory=dict)
    omitted: Counter[tuple[str, str]] = field(default_factory=Counter)
    values: int = 0

    def add(self, topic: str, time_ns: int, message: Any, about: "About") -> None:
        """Add one message. Raises InputError where the file holds more than can be read at once."""
        kept = self.topics.setdefault(topic, _Topic(about))
        row: dict[str, float] = {}
        for path, value in _leaves(message, "", 0):
            if isinstance(value, str):
                self.omitted[topic, f"{path}: {value}"] += 1
            else:
                row[path] = value
        kept.times.append(time_ns)
        kept.rows.append(row)
        self.values += len(row)
        if self.values > MOST_VALUES:
            raise InputError(
                "the log is too large to be read at once",
                where=self.where,
                expected=f"at most {MOST_VALUES:,} values",
                found=f"more after {len(self.topics)} topics",
                remedy="write only the topics or the laps that you need to a file",
            )

    def skip(self, topic: str, reason: str) -> None:
        """Count a message that is not read."""
        self.omitted[topic, reason] += 1

    @property
    def count(self) -> int:
        """Messages that were read."""
        return sum(len(topic.times) for topic in self.topics.values())

    def table(self, form: str, warnings: list[str]) -> Table:
        """Table of all topics. Raises InputError where no message holds a number."""
        groups = [(name, topic) for name, topic in self.topics.items() if any(topic.rows)]
        omitted = [
            f"{self.where}: {topic}: {reason}: {count} not read"
            for (topic, reason), count in self.omitted.items()
        ]
        if not groups:
            raise InputError(
                "no message with numbers in this file",
                where=self.where,
                expected="messages in JSON or of ROS, with numbers",
                found="; ".join([*warnings, *omitted][:4]) or "no message",
                remedy="was anything recorded?",
            )
        layout = [f"{form}, {self.count} messages of {len(groups)} topics"]
        layout += [f"{name}: times of header.stamp" for name, topic in groups if topic.stamped]
        found = [topic.group(name) for name, topic in groups]
        return table_of_groups(self.where, found, tuple(layout), (*warnings, *omitted))


@dataclass(frozen=True)
class About:
    """Metadata of the messages of a topic: their type, and units by path."""

    type: str = ""
    units: Mapping[str, str] = field(default_factory=dict)


@dataclass
class _Topic:
    about: About
    times: list[int] = field(default_factory=list)
    rows: list[dict[str, float]] = field(default_factory=list)

    @property
    def stamped(self) -> bool:
        """Whether every message has a stamp that is set."""
        return any(
            all(row.get(sec, 0) > 0 and nano in row for row in self.rows) for sec, nano in STAMPS
        )

    def group(self, name: str) -> Group:
        """Channels of the topic: "topic.path"; columns in which a message has no number are NaN there."""
        times = np.asarray(np.array(self.times, np.int64) * 1e-9, np.float64)
        if self.stamped:
            sec, nano = next(pair for pair in STAMPS if pair[0] in self.rows[0])
            times = np.array([row[sec] + row[nano] * 1e-9 for row in self.rows])
        paths = dict.fromkeys(path for row in self.rows for path in row)
        channels = {
            f"{name.strip('/')}.{path}".rstrip("."): (
                np.array([row.get(path, np.nan) for row in self.rows], np.float64),
                self.about.units.get(path, "") or ros_unit(self.about.type, path),
            )
            for path in paths
            if not path.startswith("header.stamp.")
        }
        return Group(times, channels)


def _leaves(value: Any, path: str, depth: int) -> Iterator[tuple[str, float | str]]:
    """Numbers of a message by path. A text in place of a number is the reason why it is omitted."""
    if isinstance(value, (bool, int, float, np.number, np.bool_)):
        yield path, _number(value)
    elif value is None or isinstance(value, (str, bytes)):
        return  # no measurement
    elif depth >= MOST_DEPTH:
        yield path, "too deep"
    elif isinstance(value, Mapping):
        for name, held in value.items():
            yield from _leaves(held, f"{path}.{name}".lstrip("."), depth + 1)
    elif isinstance(value, SEQUENCES):
        if len(value) > MOST_ELEMENTS:
            yield path, f"array of more than {MOST_ELEMENTS} elements"
            return
        for index, held in enumerate(value):
            yield from _leaves(held, f"{path}[{index}]", depth + 1)
    else:
        for name in _fields(value):
            yield from _leaves(getattr(value, name), f"{path}.{name}".lstrip("."), depth + 1)


def _number(value: Any) -> float | str:
    try:
        return float(value)
    except OverflowError:  # a whole number of more than 308 digits
        return "number too large"


def _fields(message: Any) -> list[str]:
    """Names of the fields of a decoded ROS message."""
    names: Mapping[str, Any] = getattr(message, "__dataclass_fields__", {})
    return [name for name in names if not name.startswith("_")]
