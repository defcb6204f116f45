"""Length codes (DLC) and CAN FD flags of columns of frames."""

import numpy as np
import numpy.typing as npt

from slipbench.protocol.logs.frame_log import FrameLog

_FD_LENGTHS = np.array([*range(9), 12, 16, 20, 24, 32, 48, 64])


def dlc(log: FrameLog) -> npt.NDArray[np.uint8]:
    """Length code of every frame, (n,), 0..15; CAN FD lengths between two codes take the longer."""
    return np.searchsorted(_FD_LENGTHS, log.length).astype(np.uint8)


def fd_flags(log: FrameLog) -> npt.NDArray[np.uint8]:
    """CAN FD flags of every frame, (n,): 1 bit-rate switch, 2 error state; 0 where not known."""
    return np.zeros(len(log), np.uint8) if log.fd_flags is None else log.fd_flags
