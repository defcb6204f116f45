"""Where a command may be, and how fast it may get there."""

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

    def nearest(self, wanted: float) -> float:
        """The allowed value nearest to `wanted`."""
        return min(max(wanted, self.low), self.high)

    def withstands(self, push: float, last: float) -> bool:
        """Whether `last` stands at the bound that a push, whatever its size, points to."""
        return (push > 0.0 and last >= self.high) or (push < 0.0 and last <= self.low)

    def towards(self, wanted: float, last: float, dt: float) -> float:
        """The allowed value nearest to `wanted` that can be reached from `last` in `dt`.

        A last value outside the bounds comes back at the given rate, not by a jump.
        """
        reach = self.rate * dt
        return min(max(self.nearest(wanted), last - reach), last + reach)
