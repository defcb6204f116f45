"""Of two effects at one place, the true one is kept at every look; the other is rejected."""

import pytest

from slipbench.identification.experiments.sequential_test import rejected, standing
from tests.identification.experiments.test_prediction import SEED, evidence

NAMES = ("backlash", "hardening_cush")


@pytest.mark.parametrize("truth", NAMES)
def test_the_true_effect_stands_at_every_look_and_the_other_is_rejected(truth):
    runs = evidence(NAMES, truth, SEED)
    assert truth not in rejected(NAMES, runs)
    assert standing(NAMES, runs) == (truth,)
