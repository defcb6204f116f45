"""While the bench is armed, a press of the button between two ticks starts the next tick at once."""

import os

import can
import pytest

from slipbench.bench.gateway.gateway import MOST_FRAMES
from slipbench.bench.loop.button_wait import button_wait
from slipbench.bench.loop.clock import SPIN
from slipbench.protocol.codec.messages import Phase
from tests.bench.safety.world import World

MILLISECOND = 1_000_000  # ns


def armed() -> World:
    world = World("throttle")
    while world.gateway.state.phase != Phase.ARMED or not world.gateway.state.released:
        world.tick()
    return world


def press(world: World) -> None:
    world.button = True
    world.say("RiderControls", world.message("RiderControls"))


def test_a_press_between_two_ticks_makes_the_next_tick_due_at_once_and_it_excites():
    world = armed()
    assert world.gateway.expects_the_button
    assert not world.gateway.attend(world.due + 100_000)
    press(world)
    assert world.gateway.attend(world.due + 300_000)
    assert world.gateway.state.phase == Phase.ARMED  # only a tick moves the trial
    world.tick(300_000)
    assert world.gateway.state.phase == Phase.EXCITING
    assert world.judge.commands == 1
    assert not world.gateway.expects_the_button


def test_frames_are_read_between_ticks_only_while_the_button_is_awaited():
    world = World("throttle")
    assert not world.gateway.expects_the_button
    world.button = True  # never seen released
    for _ in range(10):
        world.tick()
        assert not world.gateway.expects_the_button


def test_a_flood_between_two_ticks_does_not_arm():
    world = armed()
    for _ in range(MOST_FRAMES):
        world.put(0x7FF, b"")
    press(world)
    assert not world.gateway.attend(world.due + 300_000)
    assert not world.gateway.expects_the_button
    world.tick()
    assert world.gateway.state.phase == Phase.IDLE
    assert world.judge.commands == 0


def test_a_trial_that_cannot_begin_does_not_cause_early_ticks_without_end():
    """Each early tick leaves the phase `armed`; it returns there only after a release of the button."""
    world = armed()
    press(world)
    assert world.gateway.attend(world.due + 300_000)
    world.gear = 5
    world.tick(300_000)
    assert world.gateway.state.phase == Phase.IDLE
    assert not world.gateway.expects_the_button


def test_a_bus_that_failed_is_reported_once_a_tick(monkeypatch):
    """A failed socket is always readable; this must not keep the loop busy until the tick."""
    world = armed()

    def gone(_timeout):
        raise can.CanOperationError("the bus is gone")

    monkeypatch.setattr(world.wire, "recv", gone)
    assert not world.gateway.attend(world.due + 100_000)
    assert not world.gateway.expects_the_button
    assert world.gateway.refusals == ["the bus is gone"]


class Stepping:
    """A clock that advances by 50 us at every reading, and at once to the end of every sleep."""

    def __init__(self):
        self.now = 0

    def now_ns(self):
        self.now += 50_000
        return self.now

    def sleep_until_ns(self, deadline):
        self.now = max(self.now, deadline)


class Armed:
    """A gateway that reports the button at the `heard`th check."""

    def __init__(self, heard):
        self.heard, self.asked = heard, []

    @property
    def expects_the_button(self):
        return len(self.asked) < self.heard

    def attend(self, due):
        self.asked.append(due)
        return len(self.asked) == self.heard


class Readable(can.BusABC):
    """A bus that is always readable. It imitates no frames."""

    def __init__(self, number):
        super().__init__(channel="readable")
        self.number = number

    def fileno(self):
        return self.number

    def send(self, msg, timeout=None):
        return


@pytest.fixture
def busy():
    reads, writes = os.pipe()
    os.write(writes, b"x")
    with Readable(reads) as bus:
        yield bus
    os.close(reads)
    os.close(writes)


def test_the_wait_ends_with_the_press(busy):
    clock, gateway = Stepping(), Armed(heard=3)
    assert button_wait(gateway, [busy], clock)(MILLISECOND)
    assert clock.now < MILLISECOND
    assert all(due <= MILLISECOND for due in gateway.asked)


def test_without_a_press_the_wait_ends_at_the_deadline_and_reads_nothing_in_its_last_part(busy):
    clock, gateway = Stepping(), Armed(heard=1000)
    assert not button_wait(gateway, [busy], clock)(MILLISECOND)
    assert clock.now >= MILLISECOND
    assert max(gateway.asked) <= MILLISECOND - SPIN + 50_000


def test_an_interface_without_a_file_descriptor_is_read_at_the_ticks_only():
    with can.Bus(interface="virtual", channel="nothing to wait on") as bus:
        assert button_wait(Armed(1), [bus], Stepping()) is None
