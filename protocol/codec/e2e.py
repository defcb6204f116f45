"""A receiver accepts a frame when its CRC is right and its counter is the next one.

AUTOSAR E2E profile 1 (Specification of SW-C End-to-End Communication Protection Library): byte 0
is a CRC-8 over data id, counter and payload, the low nibble of byte 1 counts 0 to 14.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from e2e.p01 import e2e_p01_check, e2e_p01_protect

from slipbench.protocol.codec.checksum import crc8_table
from slipbench.protocol.codec.faults import Fault, FrameFault

PERIOD = 15  # the counter runs 0..14


def protect(payload: bytearray, data_id: int, counter: int) -> None:
    """Write counter and CRC into a payload, in place."""
    payload[1] = (payload[1] & 0xF0) | counter % PERIOD
    e2e_p01_protect(payload, data_id, increment_counter=False)


def crc_is_right(payload: bytearray, data_id: int) -> bool:
    """Whether a payload has a valid CRC and counter; a counter of 15 is invalid."""
    return bool(e2e_p01_check(payload, data_id))


@dataclass(frozen=True, slots=True)
class ReceiverState:
    """State of the receiver of one message: the last good counter, and its time."""

    counter: int | None = None
    time: float | None = None


INITIAL = ReceiverState()


def check(
    state: ReceiverState, counter: int, crc_ok: bool, now: float, timeout: float
) -> tuple[ReceiverState, FrameFault | None]:
    """Check the frame that has just arrived. now, timeout: in one unit, s or ns.

    A frame with a wrong CRC or a repeated counter does not update the state. After a
    time-out the number of frames lost is not known (the counter may have turned), so the fault is
    "stale"; the frame itself is good and the state starts afresh from it.
    """
    if not crc_ok:
        return state, FrameFault(Fault.CRC)
    fresh = ReceiverState(counter, now)
    late = silence(state, now, timeout)
    if state.counter is None or late is not None:
        return fresh, late
    step = (counter - state.counter) % PERIOD
    if step == 0:
        return state, FrameFault(Fault.REPEATED)
    return fresh, FrameFault(Fault.LOST, count=step - 1) if step > 1 else None


def silence(state: ReceiverState, now: float, timeout: float) -> FrameFault | None:
    """Fault where no good frame has come for longer than `timeout`; never before the first."""
    if state.time is None or now - state.time <= timeout:
        return None
    return FrameFault(Fault.STALE, expected=f"within {timeout:g}", found=f"{now - state.time:g}")


_CRC = np.array(crc8_table(0x1D), np.uint8)  # SAE J1850


def crcs(data: npt.NDArray[np.uint8], data_id: int) -> npt.NDArray[np.uint8]:
    """CRC of every payload of a log. data: (n, length) with the CRC in column 0."""
    start = _CRC[_CRC[data_id & 0xFF] ^ (data_id >> 8)]
    crc = np.full(len(data), start)
    for column in range(1, data.shape[1]):
        crc = _CRC[crc ^ data[:, column]]
    return crc


def rightly_protected(data: npt.NDArray[np.uint8], data_id: int) -> npt.NDArray[np.bool_]:
    """Mask of the payloads of a log, (n,), for which `crc_is_right`; a counter of 15 is invalid."""
    return np.asarray((crcs(data, data_id) == data[:, 0]) & (data[:, 1] & 0x0F < PERIOD))


def losses(counter: npt.NDArray[np.int64], period: int = PERIOD) -> npt.NDArray[np.int64]:
    """Frames lost before each of a log's good frames, (n,); -1 where a frame is repeated."""
    before = np.diff(counter) % period - 1
    return np.concatenate([np.zeros(min(1, counter.size), np.int64), before])
