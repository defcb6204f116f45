"""Many messages of one kind become frames at once: what `Codec.encode` does, column by column."""

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

from slipbench.protocol.codec import e2e
from slipbench.protocol.codec.codec import MESSAGES
from slipbench.protocol.codec.messages import WRAPPING
from slipbench.protocol.codec.slot import si
from slipbench.protocol.database.layout import Database, Message, Signal

Bytes = npt.NDArray[np.uint8]


def encode(
    database: Database, name: str, columns: Mapping[str, npt.ArrayLike], counter: int = 0
) -> Bytes:
    """Lay n messages out and protect them; signals that are not given are 0.

    columns: by signal, (n,) in SI, whole numbers for counts and choices. counter: of the end-to-end
    protection of the first. Clocks and running counts wrap. Returns (n, length). Raises ValueError
    for a value that its signal cannot hold, and for big-endian or floating signals.
    """
    message = database.message(name)
    raws = {signal: _raw(message, signal, columns[signal]) for signal in columns}
    words = np.zeros(max(raw.size for raw in raws.values()), np.uint64)
    for signal, raw in raws.items():
        words |= raw << np.uint64(message.signal(signal).start)
    data = words[:, None].view(np.uint8).reshape(-1, 8)[:, : message.length].copy()
    if message.protection is not None:
        data[:, 1] |= ((counter + np.arange(len(data))) % e2e.PERIOD).astype(np.uint8)
        data[:, 0] = e2e.crcs(data, message.protection.data_id)
    return data


def _raw(message: Message, name: str, value: npt.ArrayLike) -> npt.NDArray[np.uint64]:
    signal = message.signal(name)
    where = f"{message.name}.{name}"
    if not signal.little_endian or signal.is_float or message.length > 8:
        raise ValueError(f"{where}: only little-endian integers in up to 8 bytes are encoded")
    values = np.asarray(value)
    scale, offset = (1, 0) if values.dtype.kind in "iub" else si(signal, where)
    raw = np.rint((values - offset) / scale).astype(np.int64)
    bench_clock = message.name in MESSAGES and name in WRAPPING
    if not (signal.wraps or bench_clock):
        _check(signal, where, raw, scale, offset)
    return (raw & ((1 << signal.length) - 1)).astype(np.uint64)


def _check(
    signal: Signal, where: str, raw: npt.NDArray[np.int64], scale: float, offset: float
) -> None:
    low, high = signal.raw_range
    wrong = (raw < low) | (raw > high)
    if wrong.any():
        at = int(np.argmax(wrong))
        raise ValueError(
            f"{where}: {raw[at] * scale + offset:g} at place {at} is not in "
            f"{low * scale + offset:g} to {high * scale + offset:g} (SI)"
        )
