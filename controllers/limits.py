"""Bounds and rate limit of a command."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Range:
    """low, high: bounds of a command, SI; rate: largest change, SI per second, positive."""

    low: float
    high: float
    rate: float = float("inf")

    def __post_init__(self) -> None:
        """Raise ValueError where nothing could lie inside."""
        if not (self.low <= self.high and self.rate > 0.0):
            raise ValueError(f"no command lies in {self.low:g} .. {self.high:g} at {self.rate:g}/s")

    def nearest(self, requested: float) -> float:
        """The allowed value nearest to `requested`."""
        return min(max(requested, self.low), self.high)

    def withstands(self, change: float, last: float) -> bool:
        """Whether `last` stands at the bound towards which a change points, whatever its size."""
        return (change > 0.0 and last >= self.high) or (change < 0.0 and last <= self.low)

    def towards(self, requested: float, last: float, dt: float) -> float:
        """The allowed value nearest to `requested` that can be reached from `last` in `dt`.

        A last value outside the bounds comes back at the given rate, not by a jump.
        """
        reach = self.rate * dt
        return min(max(self.nearest(requested), last - reach), last + reach)
