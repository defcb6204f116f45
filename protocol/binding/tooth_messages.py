"""Tooth messages of a database: found by their layout, distinguished by their names."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from slipbench.protocol.binding.fields import ANCHOR
from slipbench.protocol.binding.words import concepts_in, words_of
from slipbench.protocol.codec.placement import TeethAt
from slipbench.protocol.codec.wire import TeethPart
from slipbench.protocol.database.layout import Database, Message, Signal
from slipbench.protocol.errors import InputError


@dataclass(frozen=True)
class ToothMessage:
    """Messages of one encoder. names, anchor_names: signals that do not have the bench's names."""

    wheel: str
    teeth: str
    anchor: str
    names: Mapping[str, str]
    anchor_names: Mapping[str, str]


def tooth_messages(database: Database) -> Iterator[ToothMessage]:
    """Messages of tooth intervals, each with the message that anchors its times, by wheel."""
    laid_out = [(m, at) for m in database.messages if (at := _layout(database, m)) is not None]
    anchors = [(m, names) for m in database.messages if (names := _anchor(m)) is not None]
    for wheel in ("rear", "front"):
        teeth = [pair for pair in laid_out if wheel in concepts_in(pair[0].name)]
        anchor = [pair for pair in anchors if wheel in concepts_in(pair[0].name)]
        if len(teeth) == 1 and len(anchor) == 1:
            (message, at), (other, anchor_names) = teeth[0], anchor[0]
            names = {"layout": at.layout, "tooth_count": at.count}
            yield ToothMessage(
                wheel, message.name, other.name, _renamed(names), _renamed(anchor_names)
            )


def _renamed(names: Mapping[str, str]) -> dict[str, str]:
    return {own: name for own, name in names.items() if own != name}


def _layout(database: Database, message: Message) -> TeethAt | None:
    """Multiplexer and count of a message that holds tooth intervals; None for any other."""
    selectors = [signal for signal in message.signals if signal.is_multiplexer]
    counts = [
        signal
        for signal in message.signals
        if not (signal.is_multiplexer or signal.multiplexer) and _is_count(signal)
    ]
    if len(selectors) != 1 or len(counts) != 1:
        return None
    at = TeethAt(message.name, selectors[0].name, counts[0].name)
    try:
        TeethPart(database, message, message.name, at)
    except (InputError, ValueError):
        return None
    return at


def _is_count(signal: Signal) -> bool:
    """Whether a signal counts teeth; the counter of a protection counts frames."""
    held = concepts_in(signal.name)
    return "teeth" in held or ("count" in held and signal.length > 4)


def _anchor(message: Message) -> dict[str, str] | None:
    """Signals of the message that anchors the times of an encoder; None for any other."""
    found: dict[str, str] = {}
    for signal in message.signals:
        held = concepts_in(signal.name)
        if "teeth" in held and ("count" in held or "count" in signal.unit) and "time" not in held:
            found.setdefault("tooth_count", signal.name)
        elif "time" in held and signal.unit in ("s", "ms", "us", "ns", "µs"):
            found.setdefault("tooth_time", signal.name)
        elif "teeth" in held or "per" in words_of(signal.name):
            found.setdefault("teeth_per_turn", signal.name)
        elif "fault" in held:
            found.setdefault("faulty", signal.name)
    return found if set(found) == set(ANCHOR) else None
