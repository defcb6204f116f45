"""A CAN database is read from its file, once, into frozen data; only this file knows cantools."""

import hashlib
from pathlib import Path
from typing import Any

import cantools.database
from cantools.database.can import Database as CantoolsDatabase
from cantools.database.can import Message as CantoolsMessage
from cantools.database.can import Signal as CantoolsSignal

from slipbench.protocol.database.database_check import check
from slipbench.protocol.database.database_text import breaks
from slipbench.protocol.database.layout import BusOf, Database, Message, Protection, Signal, any_bus
from slipbench.protocol.errors import InputError
from slipbench.protocol.user_file import open_user_file, read_user_file

LARGEST = 1 << 26  # bytes; the largest databases of the field have some 10 MB
HEAD = 4096  # bytes or characters, in which the format shows


def load_database(path: Path, bus_of: BusOf = any_bus) -> Database:
    """Read a CAN database: DBC, ARXML (AUTOSAR), KCD (Kayak) or SYM (PEAK), by its content.

    Raises InputError naming the file, the message, the signal, the remedy. Container messages of
    ARXML stay out: their frames count as unknown.

    A file that is merely sloppy loads: characters outside UTF-8 (Windows' cp1252 is the custom),
    no declared ranges or senders, signals under no message, more than 8 bytes without the CAN FD
    mark. What would decode to wrong values does not: overlaps, bits outside, doubled identifiers.
    Messages of two buses (`bus_of`) may share one, except in a DBC file, whose attributes and value
    tables name a message by its identifier alone.
    """
    content = read_user_file(path, LARGEST)
    text = _text(content)
    form = database_format(text)
    parsed = _parse(text, form, path)
    database = Database(
        origin=str(path),
        sha256=hashlib.sha256(content).hexdigest(),
        messages=tuple(describe(each) for each in parsed.messages if not each.is_container),
        nodes=tuple(node.name for node in parsed.nodes),
    )
    on_buses = database.on_buses(bus_of)
    check(database if form == "dbc" else on_buses)
    return on_buses


def _text(content: bytes) -> str:
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError:
        return content.decode("cp1252", errors="replace")


def database_format(text: str) -> str:
    """Format of a database by its content: "arxml", "kcd", "sym", else "dbc"."""
    head = text[:HEAD].lstrip()
    if head.startswith("<"):
        return "kcd" if "<NetworkDefinition" in head else "arxml"
    return "sym" if head.startswith("FormatVersion=") else "dbc"


def file_format(path: Path) -> str:
    """Format of a database file by its content. Raises InputError where it cannot be read."""
    with open_user_file(path) as file:
        return database_format(_text(file.read(HEAD)))


def _parse(text: str, form: str, path: Path) -> CantoolsDatabase:
    try:
        # Not strict: `check` finds overlaps and misfits itself, to name them all with a remedy.
        parsed = cantools.database.load_string(text, database_format=form, strict=False)
    except Exception as cause:  # cantools raises KeyError, ValueError and others on broken files
        raise _unusable(path, form, f"{type(cause).__name__}: {cause}") from cause
    if not isinstance(parsed, CantoolsDatabase) or not parsed.messages:
        raise _unusable(path, form, "no message")
    lost = (
        []
        if form != "dbc"
        else list(breaks(text, {each.name: len(each.signals) for each in parsed.messages}))
    )
    if lost:
        raise _unusable(path, form, "; ".join(lost))
    return parsed


def _unusable(path: Path, form: str, found: str) -> InputError:
    return InputError(
        f"not a usable {form.upper()} file",
        where=str(path),
        found=found[:1000],
        remedy="correct that line, or give the right file (DBC, ARXML, KCD or SYM)",
    )


def describe(message: CantoolsMessage) -> Message:
    """Describe one message of cantools, unchecked."""
    attributes = _attributes(message)
    return Message(
        name=message.name,
        identifier=message.frame_id,
        length=message.length,
        signals=tuple(_signal(signal) for signal in message.signals),
        extended=message.is_extended_frame,
        fd=message.is_fd or message.length > 8,
        cycle_time=message.cycle_time / 1000 if message.cycle_time else None,
        senders=tuple(message.senders),
        comment=message.comment or "",
        protection=_protection(attributes),
        attributes=attributes,
    )


def _attributes(described: CantoolsMessage | CantoolsSignal) -> dict[str, str | int | float]:
    found: dict[str, Any] = getattr(described.dbc, "attributes", None) or {}
    return {name: attribute.value for name, attribute in found.items()}


def _protection(attributes: dict[str, str | int | float]) -> Protection | None:
    profile = int(attributes.get("E2EProfile", 0))
    return Protection(profile, int(attributes.get("E2EDataId", 0))) if profile else None


def _signal(signal: CantoolsSignal) -> Signal:
    return Signal(
        name=signal.name,
        start=signal.start,
        length=signal.length,
        little_endian=signal.byte_order == "little_endian",
        signed=signal.is_signed,
        is_float=signal.is_float,
        scale=signal.scale,
        offset=signal.offset,
        minimum=signal.minimum,
        maximum=signal.maximum,
        unit=signal.unit or "",
        comment=signal.comment or "",
        receivers=tuple(name for name in signal.receivers if name != "Vector__XXX"),
        choices={number: str(name) for number, name in (signal.choices or {}).items()},
        start_value=signal.raw_initial,
        is_multiplexer=signal.is_multiplexer,
        multiplexer=signal.multiplexer_signal,
        multiplexer_ids=tuple(sorted(signal.multiplexer_ids or ())),
        wraps=_attributes(signal).get("SignalWraps", 0) == 1,
    )
