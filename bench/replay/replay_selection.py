"""Selection of the frames of a log to replay, and of the bus for each."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from slipbench.protocol.errors import InputError
from slipbench.protocol.logs.frame_log import FrameLog

HIGHEST = (1 << 29) - 1


def select_buses(log: FrameLog, names: Sequence[str], where: str) -> FrameLog:
    """Log with the frames of these buses, in this order; no names: all.

    Raises InputError where the log has no such bus.
    """
    if not names:
        return log
    for name in names:
        if name not in log.buses:
            raise InputError(
                f"the log has no bus {name!r}",
                where=where,
                expected=" or ".join(log.buses),
                found=name,
            )
    new_index = np.full(len(log.buses), len(names), np.uint8)
    new_index[[log.buses.index(name) for name in names]] = np.arange(len(names), dtype=np.uint8)
    bus = new_index[log.bus]
    return replace(log, bus=bus, buses=tuple(names)).select(bus < len(names))


def select_identifiers(log: FrameLog, only: str, without: str) -> FrameLog:
    """Log with the identifiers of `only` (empty: all) and without those of `without`.

    Both are lists such as "0x10, 0x200-0x2FF". Raises InputError for other texts.
    """
    keep = _among(log, only) if only.strip() else np.ones(len(log), np.bool_)
    return log.select(keep & ~_among(log, without))


def channels_by_bus(texts: Sequence[str], log: FrameLog) -> Mapping[str, str]:
    """Channel for each bus of the log, from texts such as "can0=vcan0".

    One channel without the name of a bus is used for all of them. Raises InputError for other texts.
    """
    if len(texts) == 1 and "=" not in texts[0]:
        return dict.fromkeys(log.buses, texts[0])
    found = {}
    for text in texts:
        bus, equals, channel = text.partition("=")
        if not equals or not channel or bus not in log.buses or bus in found:
            raise InputError(
                f"--channel {text!r} is not valid",
                expected=f"BUS=CHANNEL, each bus once, of {', '.join(log.buses)}",
                remedy=f"write --channel {log.buses[0]}=vcan0, or one channel for all buses",
            )
        found[bus] = channel
    return found


def _among(log: FrameLog, text: str) -> npt.NDArray[np.bool_]:
    found = np.zeros(len(log), np.bool_)
    for part in filter(None, map(str.strip, text.split(","))):
        first, _, last = part.partition("-")
        low, high = _identifier(first, part), _identifier(last or first, part)
        found |= (log.identifier >= low) & (log.identifier <= high)
    return found


def _identifier(text: str, part: str) -> int:
    try:
        value = int(text.strip(), 0)
    except ValueError:
        value = -1
    if not 0 <= value <= HIGHEST:
        raise InputError(
            f"{part!r} is not an identifier or a range of identifiers",
            expected="as in 0x10,0x200-0x2FF",
            found=text.strip(),
        )
    return value
