"""Bus arbitration: of the frames that are ready, the lowest identifier is sent first."""

import numpy as np
import numpy.typing as npt
from numba import njit

Integers = npt.NDArray[np.int64]
MOST_WAITING = 256


@njit(cache=True, error_model="numpy")
def arrivals(ready: Integers, identifier: Integers, length: Integers) -> Integers:
    """When each frame ends on the wire, ns. ready: ns, ascending; length: ns on the wire."""
    ends = np.zeros(ready.size, np.int64)
    waiting = np.zeros(MOST_WAITING, np.int64)
    count, coming, free = 0, 0, 0
    while coming < ready.size or count > 0:
        if count == 0:
            free = max(free, ready[coming])
        while coming < ready.size and ready[coming] <= free and count < MOST_WAITING:
            waiting[count] = coming
            count += 1
            coming += 1
        best = 0
        for i in range(1, count):
            if identifier[waiting[i]] < identifier[waiting[best]]:
                best = i
        chosen = waiting[best]
        for i in range(best, count - 1):
            waiting[i] = waiting[i + 1]
        count -= 1
        free += length[chosen]
        ends[chosen] = free
    return ends


@njit(cache=True, error_model="numpy")
def packed(tooth: Integers, most: int, wait: int) -> Integers:
    """Number of the frame that reports each tooth: a frame is sent when full or after a timeout.

    tooth: ns, shape (n,). The sender polls once a millisecond.
    """
    frame = np.zeros(tooth.size, np.int64)
    number, held, first = 0, 0, tooth[0]
    now = tooth[0] // 1_000_000 * 1_000_000
    i = 0
    while i < tooth.size:
        now += 1_000_000
        while i < tooth.size and tooth[i] <= now:
            if held == most:
                number, held, first = number + 1, 0, now
            frame[i] = number
            held += 1
            i += 1
        if held == most or (held > 0 and now - first >= wait):
            number, held, first = number + 1, 0, now
    return frame
