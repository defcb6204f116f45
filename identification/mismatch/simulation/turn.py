"""Rotating parts whose angle is not recorded: recordings give their speed, not their phase."""

from dataclasses import dataclass

from slipbench.plant.effects.effect import Effect


@dataclass(frozen=True)
class Turn:
    """A spectral line that could identify the angle at the start of a recording.

    sine, cosine: a small effect that causes the line, and the same a quarter of its period later.
    per_turn: periods in a turn.
    """

    sine: Effect
    cosine: Effect
    per_turn: float
