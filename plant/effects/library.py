"""Every effect that the bench knows; a new one is one file beside this and one line in it."""

from plant.effects.asymmetric_filling import AsymmetricFilling
from plant.effects.backlash import Backlash
from plant.effects.effect import Effect
from plant.effects.optical_lag import OpticalLag
from plant.effects.rate_limit import RateLimit
from plant.effects.relaxation_length import RelaxationLength
from plant.effects.tooth_misplacement import ToothMisplacement

LIBRARY: tuple[type[Effect], ...] = (
    RateLimit,
    AsymmetricFilling,
    Backlash,
    RelaxationLength,
    ToothMisplacement,
    OpticalLag,
)

BY_NAME = {effect.name: effect for effect in LIBRARY}
