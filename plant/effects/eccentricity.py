"""Eccentricity: the toothed disc runs out of true.

Mounted a little off its axis, or bent, the disc passes its teeth now faster and now slower while
the wheel turns evenly. Off-centre gives once per turn, a disc bent to a saddle twice, and so on.

Equation
--------
    the measured speed is w (1 + e sin(n psi + phase));   psi_j += (e / n) cos(n psi_j + phase)

Symbols
-------
    e      run_out   relative amplitude of the speed     1     1e-3 to 3e-2 (absent 0)
    n      order     periods in a turn                1     1
    phase  phase     where it is fastest             rad   0
    psi_j            place of tooth j                rad
           encoder   rear_encoder or front_encoder

Trace
-----
One line at order n of the wheel, of a fixed share of the speed.

Confused with
-------------
One tooth out of place (all orders at once); imbalance of the wheel (grows with the square of the
speed); chain polygon, where its order folds onto n: a coast-down with a slack chain.

Reference
---------
Gustafsson, "Rotational speed sensors: limitations, pre-processing and automotive applications",
IEEE Instrumentation and Measurement Magazine 13 (2010).
"""

import math
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from slipbench.plant.effects.effect import Effect
from slipbench.plant.effects.tooth_misplacement import ENCODERS
from slipbench.plant.parameters import parameter, word


@dataclass(frozen=True)
class Eccentricity(Effect):
    """An encoder's disc out of true."""

    name = "eccentricity"
    block = "encoder"
    shows_in = ("rear_teeth", "front_teeth")
    confused_with = ("tooth_misplacement", "chain_polygon", "firing_torque", "compression_torque")

    encoder: str = word("rear_encoder", "whose disc it is", ENCODERS)
    run_out: float = parameter(
        5e-3, "1", 0.0, 0.2, "relative amplitude of the speed", absent=0.0, smallest=1e-3
    )
    order: float = parameter(1, "1", 1, 64, "periods in a turn", whole=True)
    phase: float = parameter(0.0, "rad", -math.pi, math.pi, "where it is fastest")

    @classmethod
    def candidates(cls) -> tuple[Self, ...]:
        """The effect at its typical size for either wheel."""
        return tuple(cls(encoder=encoder) for encoder in ENCODERS)

    def tooth_offsets(self, teeth: int) -> NDArray[np.float64]:
        """How much later than even every tooth passes [rad], shape (teeth,)."""
        place = 2 * np.pi / teeth * np.arange(teeth)
        offsets: NDArray[np.float64] = np.cos(self.order * place + self.phase)
        return self.run_out / self.order * offsets
