"""An encoder's sending side: tooth times become frames of intervals with a running count."""

from collections.abc import Iterable, Mapping

from slipbench.protocol.codec.messages import Intervals, ToothIntervals

SHORTEST_WAIT = 5_000  # us: a frame goes out at least this often, however slowly the wheel turns
MICROSECOND = 1e-6


class EncoderFrames:
    """Collects teeth (us on the encoder's own clock) and packs them."""

    def __init__(self, capacity: Mapping[Intervals, tuple[int, float]]) -> None:
        """Have seen no tooth yet; `capacity` is that of the frames, see `Codec.capacity`."""
        self._capacity = {layout: number for layout, (number, _) in capacity.items()}
        self._longest = {layout: longest * 1e6 for layout, (_, longest) in capacity.items()}
        self._pending: list[int] = []
        self._told_at = 0
        self.count = 0
        self.last_tooth: int | None = None

    def add(self, teeth: Iterable[int]) -> None:
        """Take in teeth, in order; the first one ever only starts the count."""
        for tooth in teeth:
            if self.last_tooth is not None:
                self._pending.append(tooth - self.last_tooth)
            self.last_tooth = tooth
            self.count += 1

    def frames(self, now: int) -> list[ToothIntervals]:
        """Give the frames that are due at `now` (us): full ones, and one that has waited."""
        made = []
        while len(self._pending) >= self._capacity[self._layout()]:
            made.append(self._take(self._capacity[self._layout()]))
        if not made and now - self._told_at >= SHORTEST_WAIT and self.last_tooth is not None:
            standing = (max(now - self.last_tooth, 0) * MICROSECOND,)
            made = (
                [self._take(len(self._pending))]
                if self._pending
                else [ToothIntervals(Intervals.STANDING, self.count, standing)]
            )
        if made:
            self._told_at = now
        return made

    def _layout(self) -> Intervals:
        """Choose the layout that holds what is pending: as many intervals as may be."""
        for layout in (Intervals.SHORT, Intervals.LONG):
            held = self._pending[: self._capacity[layout]]
            if all(interval <= self._longest[layout] for interval in held):
                return layout
        return Intervals.SINGLE

    def _take(self, most: int) -> ToothIntervals:
        layout = self._layout()
        number = min(most, self._capacity[layout])
        told, self._pending = self._pending[:number], self._pending[number:]
        last = self.count - len(self._pending)
        return ToothIntervals(layout, last, tuple(us * MICROSECOND for us in told))
