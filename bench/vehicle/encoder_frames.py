"""Frames of a wheel encoder: tooth times become intervals with a running tooth count."""

from collections.abc import Iterable, Mapping

from slipbench.protocol.codec.messages import Intervals, ToothIntervals

LONGEST_PERIOD = 5_000  # us between two frames, however slowly the wheel turns
MICROSECOND = 1e-6


class EncoderFrames:
    """Packs tooth times, us on the clock of the encoder, into frames."""

    def __init__(self, capacity: Mapping[Intervals, tuple[int, float]]) -> None:
        """Start without teeth. capacity: of each frame layout, see `Codec.capacity`."""
        self._capacity = {layout: number for layout, (number, _) in capacity.items()}
        self._longest = {layout: longest * 1e6 for layout, (_, longest) in capacity.items()}
        self._pending: list[int] = []
        self._sent_at = 0
        self.count = 0
        self.last_tooth: int | None = None

    def add(self, teeth: Iterable[int]) -> None:
        """Add tooth times in increasing order, us; the first tooth only starts the count."""
        for tooth in teeth:
            if self.last_tooth is not None:
                self._pending.append(tooth - self.last_tooth)
            self.last_tooth = tooth
            self.count += 1

    def frames(self, now: int) -> list[ToothIntervals]:
        """Frames that are due at `now` (us): full ones, and one when `LONGEST_PERIOD` is over."""
        made = []
        while self._pending and len(self._pending) >= self._capacity[self._layout()]:
            made.append(self._take(self._capacity[self._layout()]))
        if not made and now - self._sent_at >= LONGEST_PERIOD and self.last_tooth is not None:
            waiting = (max(now - self.last_tooth, 0) * MICROSECOND,)
            made = (
                [self._take(len(self._pending))]
                if self._pending
                else [ToothIntervals(Intervals.STANDING, self.count, waiting)]
            )
        if made:
            self._sent_at = now
        return made

    def _layout(self) -> Intervals:
        """Layout with the most intervals that can hold the pending ones."""
        for layout in (Intervals.SHORT, Intervals.LONG):
            held = self._pending[: self._capacity[layout]]
            if max(held, default=0) <= self._longest[layout]:
                return layout
        return Intervals.SINGLE

    def _take(self, most: int) -> ToothIntervals:
        """Frame of the oldest pending intervals, `most` at most; they are removed."""
        layout = self._layout()
        number = min(most, self._capacity[layout])
        taken, self._pending = self._pending[:number], self._pending[number:]
        last = self.count - len(self._pending)
        return ToothIntervals(layout, last, tuple(us * MICROSECOND for us in taken))
