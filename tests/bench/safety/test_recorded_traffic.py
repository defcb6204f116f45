"""Recorded traffic of other vehicles moves nothing, and disturbs no ride that it runs beside."""

from functools import cache
from itertools import islice

import pytest

from slipbench.bench.safety.trial import ENDED
from slipbench.protocol.codec.codec import Codec
from slipbench.protocol.codec.faults import FrameFault
from slipbench.protocol.codec.messages import Phase
from slipbench.protocol.logs import read_log
from tests.bench.safety.world import World, beginnings, codec
from tests.recordings import recording

CAPTURES = [
    "comma2k19/segment.log",
    "subaru_wrx/can_sample.log",
    "gt86_gt350/gt86_vsslog.log",
    "gt86_gt350/gt350_vsslog.trc",
    "gt86_gt350/vab_allgears.log",
    "formats/candump.log",
    "formats/obd2_logger.mf4",
]
PER_TICK, MOST = 25, 20_000  # frames; a 1 Mbit/s bus carries at most 17 short ones in a millisecond


@cache
def capture(name):
    """The first frames of a capture: identifier, data, whether extended."""
    log = read_log(recording(name)).frames
    return [
        (int(log.identifier[i]), log.data[i, : log.length[i]].tobytes(), bool(log.extended[i]))
        for i in range(min(len(log), MOST))
    ]


def frames(name):
    return iter(capture(name))


def together(world: World, traffic, until=None) -> int:
    """Put recorded traffic onto the world's bus while it goes on; give the number of frames."""
    number = 0
    while part := list(islice(traffic, PER_TICK)):
        for identifier, data, extended in part:
            world.put(identifier, data[:8], is_extended_id=extended)
        number += len(part)
        world.tick()
        if until is not None and world.gateway.state.phase in until:
            break
    return number


def silent(world: World) -> World:
    world.wrong["dropped"] |= set(world.counters)
    return world


@pytest.mark.parametrize("name", CAPTURES)
def test_a_capture_alone_never_moves_anything(name):
    world = silent(World("throttle"))
    assert together(world, frames(name)) > 100
    assert world.judge.commands == 0


@pytest.mark.parametrize("place", range(6))
@pytest.mark.parametrize("name", CAPTURES)
def test_a_capture_beside_a_ride_breaks_no_law(name, place):
    world = beginnings()[place].world()
    world.button = True
    together(world, frames(name), until=ENDED)
    if not any(known(codec(), *frame) for frame in frames(name)):
        assert world.gateway.state.phase == Phase.DONE  # it means nothing to the bench


def known(meaning: Codec, identifier: int, data: bytes, extended: bool) -> bool:
    """Tell whether the bench would take a frame for one of its own vehicle's, whole or damaged."""
    decoded = meaning.decode(identifier, data[:8])
    return not extended and not (isinstance(decoded, FrameFault) and not decoded.message)


@pytest.mark.parametrize("name", CAPTURES)
def test_a_capture_that_takes_the_place_of_the_vehicle_ends_the_trial(name):
    world = silent(beginnings()[1].world())
    together(world, frames(name), until=ENDED)
    assert world.gateway.state.phase == Phase.TRIPPED
