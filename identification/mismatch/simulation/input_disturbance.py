"""A disturbance waveform that is added to inputs or outputs of the simulation, by row.

It is one of the effects of a point, so that a disturbance without an equation is fitted jointly
with all other effects. Systems do not handle it; the model adds it to the simulation's inputs, or to the
output of a sensor.
"""

from collections.abc import Mapping
from dataclasses import dataclass

from slipbench.plant.effects.effect import Effect
from slipbench.plant.signals import Floats


@dataclass(frozen=True, eq=False)
class InputDisturbance(Effect):
    """subsystem: where it acts; waveforms: by record, values added to columns of the inputs.

    An error of a sensor has the name of its injection point, see `at_sensor`.
    """

    name = "push"
    block = ""
    shows_in = ()
    confused_with = ()

    # Effects compare equal by their parameters; this one has none.
    __eq__ = object.__eq__
    __hash__ = object.__hash__

    subsystem: str
    waveforms: tuple[Mapping[str, Floats], ...]
