"""Another tyre formula is no missing physics: the motorcycle of the blind validation."""

from dataclasses import replace

import numpy as np
import pytest

from slipbench.identification.mismatch.motorcycle.system import MotorcycleSystem
from slipbench.identification.mismatch.simulation.piece import Piece
from slipbench.studies.blind_validation.generator.case import draw_case, write_case
from slipbench.studies.blind_validation.generator.tyres import BRUSH, BURCKHARDT, DUGOFF
from slipbench.studies.blind_validation.generator.vehicle_file import draw_truth, vehicle_tree
from tests.identification.mismatch.laws.explained import explained, reported

LIBRARY = ("load_transfer", "relaxation_length", "driveline_loss", "spring_knee")
SEED = 7


@pytest.mark.parametrize("formula", [BRUSH, DUGOFF, BURCKHARDT])
def test_another_formula_of_the_same_stiffness_and_peak_is_no_mismatch(tmp_path, formula):
    """The formulas differ by some per cent of the peak: a shape for calibration."""
    print(f"seed {SEED}")
    rng = np.random.default_rng(SEED)
    truth = draw_truth(rng, formula)
    drawn = draw_case(SEED, 0)
    case = replace(
        drawn,
        truth=truth,
        hidden=(),
        vehicle=vehicle_tree(rng, truth),
        training=drawn.training[1:3],
        held_out=drawn.held_out[:1],
    )
    vehicle, *sets = write_case(case, tmp_path / "case")
    records = ([Piece.of(run).read() for run in runs] for runs in sets)
    found = explained(MotorcycleSystem.load(vehicle), *records, LIBRARY)
    assert not found.mismatch, reported(found)
    assert not found.effects
