"""An effect that an FMU for model exchange lacks at a derivative is named with magnitude."""

import numpy as np

from slipbench.identification.mismatch.runs import read_system
from tests.identification.mismatch.callables.fmus.building import build, needs_compiler, with_file
from tests.identification.mismatch.callables.test_state_derivatives import EXCHANGED
from tests.identification.mismatch.laws.explained import explained, holds, names, reported
from tests.identification.mismatch.laws.spring import FREQUENCY, swung

pytestmark = needs_compiler
FRICTION = 8.0  # m/s^2


def rubbing(x, v, t):
    return x + FRICTION * np.tanh(v / 0.01) / FREQUENCY**2


def test_dry_friction_inside_of_an_fmu_is_named_with_its_size(tmp_path):
    """The recorded spring has it; the FMU does not, and only its derivatives can be reached."""
    system = read_system(with_file(build(tmp_path, 3), EXCHANGED))
    rides = [swung(seed, rubbing) for seed in (1, 2)]
    found = explained(system, rides[:1], rides[1:], ["friction", "viscous_friction", "lag"])
    assert names(found) == ["friction.velocity_rate/velocity"], reported(found)
    assert holds(found, "friction", "force", FRICTION, slack=0.02)
