"""Controls of a running replay: pause, seek, speed, stop; another process may use them.

They are aligned 64-bit integers in memory that two processes may share. Each store is atomic, and
`changes` is incremented last.
"""

CHANGES, PAUSED, STOPPED, SPEED, SEEK, PASSES, SENT, NEXT, POSITION = range(9)
SIZE = 9 * 8  # bytes
ENDLESS = 0  # passes
NO_SEEK = -1
UNIT = 1_000_000  # of speed
FASTEST = 1_000_000  # largest speed, times as fast as recorded


class Controls:
    """Controls of one replay. speed: 1 is as recorded, 2 twice as fast."""

    def __init__(self, buffer: memoryview) -> None:
        """Use `buffer`, of SIZE bytes."""
        self._cells = buffer[:SIZE].cast("q")

    @classmethod
    def local(cls, speed: float = 1.0, passes: int = 1) -> "Controls":
        """Controls for use inside one process. passes: number of passes through the log."""
        return cls(memoryview(bytearray(SIZE))).begin(speed, passes)

    def begin(self, speed: float, passes: int) -> "Controls":
        """These controls, with the initial speed and number of passes."""
        self._cells[SEEK], self._cells[PASSES] = NO_SEEK, passes
        self._cells[SPEED] = round(speed * UNIT)
        return self

    def pause(self) -> None:
        """Pause the replay."""
        self._change(PAUSED, 1)

    def resume(self) -> None:
        """Continue after a pause."""
        self._change(PAUSED, 0)

    def seek(self, position: int) -> None:
        """Continue with the first frame at `position` or later, ns since the first frame."""
        self._change(SEEK, max(position, 0))

    def set_speed(self, speed: float) -> None:
        """Continue at another speed."""
        self._change(SPEED, max(round(min(speed, FASTEST) * UNIT), 1))

    def stop(self) -> None:
        """End the replay."""
        self._change(STOPPED, 1)

    def report_progress(self, sent: int, following: int, position: int) -> None:
        """Store number of frames sent, next row and position (ns); called by the replay."""
        self._cells[SENT], self._cells[NEXT], self._cells[POSITION] = sent, following, position

    def take_seek(self) -> int | None:
        """Requested position, ns, once; None without a request. Called by the replay."""
        position = self._cells[SEEK]
        self._cells[SEEK] = NO_SEEK
        return None if position == NO_SEEK else position

    def release(self) -> None:
        """Release the buffer, so that shared memory can be closed."""
        self._cells.release()

    @property
    def changes(self) -> int:
        """Number of changes so far."""
        return self._cells[CHANGES]

    @property
    def paused(self) -> bool:
        """Whether the replay is paused."""
        return bool(self._cells[PAUSED])

    @property
    def stopped(self) -> bool:
        """Whether the replay must end."""
        return bool(self._cells[STOPPED])

    @property
    def speed(self) -> float:
        """Speed: 1 is as recorded, 2 twice as fast."""
        return self._cells[SPEED] / UNIT

    @property
    def passes(self) -> int:
        """Number of passes; ENDLESS: until it is stopped."""
        return self._cells[PASSES]

    @property
    def sent(self) -> int:
        """Number of frames sent so far."""
        return self._cells[SENT]

    @property
    def following(self) -> int:
        """Row of the next frame."""
        return self._cells[NEXT]

    @property
    def position(self) -> int:
        """Position of the last sent frame, ns since the first frame of the log."""
        return self._cells[POSITION]

    def _change(self, cell: int, value: int) -> None:
        self._cells[cell] = value
        self._cells[CHANGES] += 1
