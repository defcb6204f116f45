"""Laws of slip control in the gateway: what it hears, when it sets the command, where it ends.

`Control` stands in place of slip control: it keeps what it is given and requests a fixed offset.
"""

from dataclasses import replace
from unittest.mock import patch

import pytest

from slipbench.bench.gateway import gateway as module
from slipbench.bench.loop.clock import SECOND
from slipbench.bench.safety.trial import Offsets
from slipbench.protocol.codec.messages import Authority, Phase
from tests.bench.safety import world as world_module
from tests.bench.safety.world import MILLISECOND, NAMES, WHEELS, World, plan


class Control:
    """Slip control that keeps what it is given; each request is a little larger."""

    def __init__(self) -> None:
        self.made_of: tuple = ()
        self.observed: list[tuple] = []
        self.updates: list[tuple[float, float]] = []
        self.requested = Offsets(0.0, 0.0)

    def observe(self, name, message, now):
        self.observed.append((name, message, now))

    def update(self, waveform, now):
        self.updates.append((waveform, now))
        self.requested = Offsets(0.0001 * len(self.updates), 0.0)
        return self.requested


@pytest.fixture
def controlled():
    """A world whose trial has a controller, and the control in it."""
    control = Control()
    with_controller = replace(plan("throttle"), controller=object())

    def made(*arguments):
        control.made_of = arguments
        return control

    with (
        patch.object(world_module, "plan", lambda _: with_controller),
        patch.object(module, "slip_control", made),
    ):
        world = World("throttle")
    return world, control


def until(world, phase):
    for _ in range(80):
        if world.gateway.state.phase == phase:
            return
        if world.gateway.state.phase in (Phase.IDLE, Phase.ARMED):
            world.button = world.gateway.expects_the_button
        world.tick()
    pytest.fail(f"it never came to {phase.name}")


def test_slip_control_is_made_of_the_plan_the_wheels_and_the_codec(controlled):
    world, control = controlled
    made_plan, wheels, codec = control.made_of
    assert made_plan is world.plan
    assert wheels is WHEELS
    assert codec.has("RearTeeth")


def test_every_good_frame_is_observed_at_the_time_of_its_tick_and_a_damaged_one_never(controlled):
    world, control = controlled
    expected = [world.message(name) for name in NAMES]
    world.tick()
    assert [name for name, _, _ in control.observed] == list(NAMES)
    assert {type(message) for _, message, _ in control.observed} == set(map(type, expected))
    assert {now for _, _, now in control.observed} == {world.due / SECOND}
    control.observed.clear()
    world.wrong["damaged"] = {"RearTeeth"}
    world.wrong["stuck"] = {"EngineStatus"}
    world.tick()
    heard = {name for name, _, _ in control.observed}
    assert heard == set(NAMES) - {"RearTeeth", "EngineStatus"}


def test_the_controller_sets_the_command_from_the_button_until_the_hand_back(controlled):
    world, control = controlled
    until(world, Phase.ARMED)
    assert control.updates == []
    until(world, Phase.EXCITING)
    while world.gateway.state.phase in (Phase.EXCITING, Phase.SETTLING):
        state = world.gateway.state
        waveform, now = control.updates[-1]
        assert now == world.due / SECOND
        exciting = state.phase == Phase.EXCITING
        assert waveform == (world.plan.excitation.value(now - state.since) if exciting else 0.0)
        opening = state.throttle + control.requested.throttle
        assert world.asked.authority == Authority.THROTTLE
        assert world.asked.throttle == pytest.approx(opening, abs=6e-5)  # the wire's resolution
        world.tick()
    assert world.gateway.state.phase == Phase.HANDING_BACK
    assert world.gateway.state.ramp_start == control.requested
    asked = len(control.updates)
    opening = world.gateway.state.throttle + control.requested.throttle
    assert world.asked.throttle == pytest.approx(opening, abs=2e-4)
    world.tick(MILLISECOND)
    assert len(control.updates) == asked  # the hand-back is a ramp
