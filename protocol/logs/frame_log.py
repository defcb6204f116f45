"""A log of CAN frames as columns, so that a whole log is processed at once."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt


@dataclass(frozen=True)
class FrameLog:
    """n frames in the order in which they were logged.

    time_ns     (n,) int64, ns since the epoch of the logger
    bus         (n,) uint8, index into `buses`
    identifier  (n,) uint32, without flag bits
    extended    (n,) bool, 29-bit identifier
    fd          (n,) bool, CAN FD frame
    sent        (n,) bool, sent by the logger itself (Tx) rather than received
    length      (n,) uint8, payload bytes, 0..64
    data        (n, w) uint8, w = 8 or 64, zero beyond `length`
    buses       names of the buses, as in the log: ("can0", "can1")
    fd_flags    (n,) uint8, of CAN FD frames: 1 bit-rate switch, 2 error state; None: not known
    skipped     what the log held beside data frames (error and remote frames, comments), counted
    """

    time_ns: npt.NDArray[np.int64]
    bus: npt.NDArray[np.uint8]
    identifier: npt.NDArray[np.uint32]
    extended: npt.NDArray[np.bool_]
    fd: npt.NDArray[np.bool_]
    sent: npt.NDArray[np.bool_]
    length: npt.NDArray[np.uint8]
    data: npt.NDArray[np.uint8]
    buses: tuple[str, ...]
    skipped: tuple[tuple[str, int], ...] = ()
    fd_flags: npt.NDArray[np.uint8] | None = None

    def __len__(self) -> int:
        """Count the frames."""
        return int(self.time_ns.size)

    def select(self, rows: npt.NDArray[np.bool_] | npt.NDArray[np.intp]) -> "FrameLog":
        """The frames at `rows`: indices, shape (m,), in that order, or a mask, shape (n,)."""
        return FrameLog(
            self.time_ns[rows],
            self.bus[rows],
            self.identifier[rows],
            self.extended[rows],
            self.fd[rows],
            self.sent[rows],
            self.length[rows],
            self.data[rows],
            self.buses,
            self.skipped,
            None if self.fd_flags is None else self.fd_flags[rows],
        )
