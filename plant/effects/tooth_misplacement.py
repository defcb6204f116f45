"""Tooth misplacement: one tooth of the encoder's disc is not where it should be.

A bent tooth, a disc cut badly or mounted off centre: the tooth passes the pickup early or late,
once in every turn. The wheel turns evenly; only the sensor's reading of it does not.

Equation
--------
    psi_j = 2 pi j / N_t + (displacement / pitch_radius)  for j = tooth, without it for the others

Symbols
-------
    displacement   along the circle, positive = later     m   up to 3e-3 (absent 0)
    pitch_radius   of the circle of teeth                 m   0.1
    tooth          which one, from 0                      1   0
    encoder        rear_encoder or front_encoder
    N_t            teeth of the disc                      1   16

Trace
-----
A line at once per turn of the wheel and at its multiples, of a fixed share of the speed: below
10 Hz under 70 km/h. The errors of one turn add up to nothing.

Confused with
-------------
Imbalance of the wheel (grows with the square of the speed); firing orders of the engine (vanish
with the load): a coast-down from high speed separates them.

Reference
---------
Corno and Savaresi, SYSID 2009: one tooth of 16 displaced by 3 mm on a radius of 10 cm explains the
line that they saw.
"""

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from slipbench.plant.effects.effect import Effect
from slipbench.plant.parameters import parameter, word

ENCODERS = ("rear_encoder", "front_encoder")


@dataclass(frozen=True)
class ToothMisplacement(Effect):
    """One tooth of an encoder out of place."""

    name = "tooth_misplacement"
    block = "encoder"
    shows_in = ("rear_teeth", "front_teeth")
    confused_with = ("eccentricity", "firing_torque", "chain_polygon", "compression_torque")

    encoder: str = word("rear_encoder", "whose disc it is", ENCODERS)
    displacement: float = parameter(
        1e-3, "m", -10e-3, 10e-3, "along the circle, positive is later", absent=0.0, smallest=2e-4
    )
    pitch_radius: float = parameter(
        0.1, "m", 0.02, 0.3, "radius of the circle of teeth", given=True
    )
    tooth: float = parameter(0, "1", 0, 359, "which tooth, from 0", whole=True)

    @classmethod
    def candidates(cls) -> tuple[Self, ...]:
        """The effect at its typical size for either wheel."""
        return tuple(cls(encoder=encoder) for encoder in ENCODERS)

    def tooth_offsets(self, teeth: int) -> NDArray[np.float64]:
        """How much later than even every tooth passes [rad], shape (teeth,)."""
        offsets = np.zeros(teeth)
        offsets[int(self.tooth) % teeth] = self.displacement / self.pitch_radius
        return offsets
