"""What turns unseen: recordings tell how fast it turns, and not where it stood when they began."""

from dataclasses import dataclass

from slipbench.plant.effects.effect import Effect


@dataclass(frozen=True)
class Turn:
    """A line that could tell the angle at which a recording began.

    sine, cosine: an effect that makes it, small, and the same a quarter of the line's period on.
    per_turn: periods in a turn.
    """

    sine: Effect
    cosine: Effect
    per_turn: float
