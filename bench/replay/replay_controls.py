"""What steers a replay while it runs: pause, seek, speed, stop; whoever steers may be elsewhere.

A few aligned integers in memory that two processes may share: each is stored at once, never seen
half, and `changes` is counted up last.
"""

CHANGES, PAUSED, STOPPED, SPEED, SEEK, PASSES, SENT, NEXT, PLACE = range(9)
SIZE = 9 * 8  # bytes
ENDLESS = 0  # passes
NOWHERE = -1
UNIT = 1_000_000  # of speed
FASTEST = 1_000_000  # times as fast as recorded: no bus carries more


class Controls:
    """The controls of one replay. speed: times as fast as recorded."""

    def __init__(self, buffer: memoryview) -> None:
        """Lay the controls over `buffer`, SIZE bytes."""
        self._cells = buffer[:SIZE].cast("q")

    @classmethod
    def local(cls, speed: float = 1.0, passes: int = 1) -> "Controls":
        """Make controls for use inside one process; passes: how often the log goes by."""
        return cls(memoryview(bytearray(SIZE))).begin(speed, passes)

    def begin(self, speed: float, passes: int) -> "Controls":
        """Set everything as it is to be at the beginning."""
        self._cells[SEEK], self._cells[PASSES] = NOWHERE, passes
        self._cells[SPEED] = round(speed * UNIT)
        return self

    def pause(self) -> None:
        """Stay where the replay is."""
        self._change(PAUSED, 1)

    def resume(self) -> None:
        """Go on from there."""
        self._change(PAUSED, 0)

    def seek(self, place: int) -> None:
        """Go on with the first frame at `place` or later, ns since the log's first frame."""
        self._change(SEEK, max(place, 0))

    def set_speed(self, speed: float) -> None:
        """Go on at another speed."""
        self._change(SPEED, max(round(min(speed, FASTEST) * UNIT), 1))

    def stop(self) -> None:
        """End the replay."""
        self._change(STOPPED, 1)

    def report_progress(self, sent: int, following: int, place: int) -> None:
        """Tell the frames sent, the row that follows and the place; the replay's to call."""
        self._cells[SENT], self._cells[NEXT], self._cells[PLACE] = sent, following, place

    def take_seek(self) -> int | None:
        """Give the place that was asked for, once; the replay's to call."""
        place = self._cells[SEEK]
        self._cells[SEEK] = NOWHERE
        return None if place == NOWHERE else place

    def release(self) -> None:
        """Let go of the buffer, so that shared memory can be closed."""
        self._cells.release()

    @property
    def changes(self) -> int:
        """Count of all changes so far."""
        return self._cells[CHANGES]

    @property
    def paused(self) -> bool:
        """Tell whether the replay is to stay where it is."""
        return bool(self._cells[PAUSED])

    @property
    def stopped(self) -> bool:
        """Tell whether the replay is to end."""
        return bool(self._cells[STOPPED])

    @property
    def speed(self) -> float:
        """Times as fast as recorded."""
        return self._cells[SPEED] / UNIT

    @property
    def passes(self) -> int:
        """How often the log goes by; ENDLESS: until it is stopped."""
        return self._cells[PASSES]

    @property
    def sent(self) -> int:
        """Frames sent so far."""
        return self._cells[SENT]

    @property
    def following(self) -> int:
        """Row of the frame that follows."""
        return self._cells[NEXT]

    @property
    def position(self) -> int:
        """Place of the frame that was sent last, ns since the log's first frame."""
        return self._cells[PLACE]

    def _change(self, cell: int, value: int) -> None:
        self._cells[cell] = value
        self._cells[CHANGES] += 1
