"""A course that is pushed at a place, row by row, beside whatever else acts.

It stands among the effects of a point, so that what has no equation is fitted together with
everything that has; no system knows it, and the model adds it to the inputs of the simulation.
"""

from collections.abc import Mapping
from dataclasses import dataclass

from slipbench.plant.effects.effect import Effect
from slipbench.plant.signals import Floats


@dataclass(frozen=True, eq=False)
class InputDisturbance(Effect):
    """subsystem: in which it acts; waveforms: what is added to columns of the inputs, by record."""

    name = "push"
    block = ""
    shows_in = ()
    confused_with = ()

    # Effects are equal by their parameters, of which this one has none.
    __eq__ = object.__eq__
    __hash__ = object.__hash__

    subsystem: str
    waveforms: tuple[Mapping[str, Floats], ...]
