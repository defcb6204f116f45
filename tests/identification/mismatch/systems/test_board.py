"""The record of acting effects: its limits are reported explicitly."""

import numpy as np
import pytest

from slipbench.identification.mismatch.systems.board import (
    LAYOUT,
    MOST_EFFECTS,
    MOST_QUANTITIES,
    MOST_STATES,
    PARAMETERS_OF_ONE,
    board,
    check_size,
)
from slipbench.identification.mismatch.systems.equations import Equations
from slipbench.plant.errors import PlantError
from slipbench.protocol.errors import InputError


def acts(count):
    return (*(np.arange(count) + k for k in range(3)), np.full((count, PARAMETERS_OF_ONE), 0.5))


def test_a_record_holds_what_it_was_given_and_zeros():
    made = board(*acts(3), states=2, first=7)
    assert made["effects"] == 3
    assert made["code"][0, :3].tolist() == [0, 1, 2]
    assert made["other"][0, :3].tolist() == [2, 3, 4]
    assert made["par"].sum() == 0.5 * 3 * PARAMETERS_OF_ONE
    for name in ("memory", "x", "dx", "q", "spill"):
        assert not made[name].any(), name


def test_as_many_effects_as_fit_are_taken_and_one_more_is_refused():
    assert board(*acts(MOST_EFFECTS), states=0, first=1)["effects"] == MOST_EFFECTS
    with pytest.raises(PlantError, match=f"at most {MOST_EFFECTS}"):
        board(*acts(MOST_EFFECTS + 1), states=0, first=1)


def of(inputs, states):
    names = tuple(f"x{k}" for k in range(states))
    return Equations((), tuple(f"u{k}" for k in range(inputs)), names, (), (), ())


@pytest.mark.parametrize(
    ("large", "what"),
    [(of(1, MOST_STATES + 1), "states"), (of(MOST_QUANTITIES // 2, 1), "inputs, seams and states")],
)
def test_a_system_that_is_too_large_is_refused_with_the_limit(large, what):
    check_size(of(1, MOST_STATES), "m.toml")
    with pytest.raises(InputError, match=rf"m\.toml: .*too many {what}"):
        check_size(large, "m.toml")


def test_the_record_has_no_gaps():
    """C declares the same fields one after the other."""
    assert LAYOUT.itemsize == sum(LAYOUT[name].itemsize for name in LAYOUT.names)
