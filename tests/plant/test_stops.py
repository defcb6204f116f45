"""A throttle plate that passes a stop within a step stops there and leaves at its acceleration."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from slipbench.plant.kernel import off_the_stop

STEP = 1e-3

speeds = st.floats(1e-3, 50.0)
accelerations = st.floats(1e-2, 2e4)
shares = st.floats(0.01, 0.99)
edges = st.sampled_from([0.0, 1.0])


@given(edges, speeds, accelerations, shares)
def test_the_plate_leaves_from_the_instant_of_its_impact(
    edge: float, speed: float, acceleration: float, share: float
) -> None:
    """Constant acceleration: the end of the step is known exactly, also just before the plate turns."""
    since = share * min(STEP, 2.0 * speed / acceleration)  # later it would be back at the stop
    inwards = 1.0 - 2.0 * edge
    position = edge + inwards * (0.5 * acceleration * since - speed) * since
    rate = inwards * (acceleration * since - speed)
    found = off_the_stop(position, rate, inwards * acceleration, STEP)
    left = edge + inwards * 0.5 * acceleration * since**2
    assert found[0] == pytest.approx(left, rel=1e-9, abs=1e-12)
    assert found[1] == pytest.approx(inwards * acceleration * since, rel=1e-4)


@given(edges, speeds, accelerations, shares)
def test_a_plate_that_is_pushed_outwards_stays_on_its_stop(
    edge: float, speed: float, acceleration: float, share: float
) -> None:
    outwards = 2.0 * edge - 1.0
    position = edge + outwards * speed * share * STEP
    assert off_the_stop(position, outwards * speed, outwards * acceleration, STEP) == (edge, 0.0)
