"""What ends a trial though neither rider nor motorcycle does: its recorder, its room for ticks."""

import errno

import pytest

from slipbench.bench.gateway.gateway import AFTERWARDS
from slipbench.bench.loop.loop import LAST_TICK, MOST_TICKS
from slipbench.protocol.codec.messages import Authority, Phase, TripReason
from tests.bench.safety.world import World


def in_phase(phase: Phase) -> World:
    """A world whose trial stands in `phase`; the rider presses once it has armed."""
    world = World("throttle")
    for _ in range(40):
        state = world.gateway.state
        if state.phase == phase:
            return world
        world.button = state.phase == Phase.ARMED and state.released
        world.tick()
    pytest.fail(f"it never came to {phase.name}")


@pytest.mark.parametrize("phase", [Phase.IDLE, Phase.ARMED, Phase.EXCITING])
def test_a_recorder_that_fails_ends_the_trial_in_the_next_tick(phase: Phase) -> None:
    """Before the button too: the rider would press it for nothing."""
    world = in_phase(phase)
    world.gateway._ring.fail(errno.ENOSPC)
    world.tick()
    trip = world.gateway.state.trip
    assert trip is not None
    assert (trip.reason, trip.detail) == (TripReason.RECORDER, "the recorder cannot write")
    assert world.asked.authority == Authority.NONE


@pytest.mark.parametrize("phase", [Phase.IDLE, Phase.ARMED, Phase.EXCITING])
def test_a_loop_that_has_no_room_for_more_ticks_hands_back_and_says_so(phase: Phase) -> None:
    world = in_phase(phase)
    world.number = LAST_TICK - 1
    world.tick()
    trip = world.gateway.state.trip
    assert trip is not None
    assert trip.reason == TripReason.STOPPED
    assert str(MOST_TICKS) in trip.detail
    assert world.asked.authority == Authority.NONE


def test_there_is_time_left_to_say_so() -> None:
    assert (MOST_TICKS - LAST_TICK) * 0.001 > 2 * AFTERWARDS
