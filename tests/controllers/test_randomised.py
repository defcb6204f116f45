"""A few of the randomised rides; `make thousand` rides them all."""

import pytest

from tests.controllers.randomised import one

SEED = 20


@pytest.mark.parametrize("number", range(6))
def test_no_command_of_a_controller_trips_the_gate(number):
    outcome = one(SEED, number)
    print(f"seed {SEED}, ride {number}: {outcome}")
    assert not outcome.startswith("TRIPPED")
