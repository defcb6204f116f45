"""Laws of a device: its clock, whom it grants authority, what its latency holds back."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from slipbench.bench.vehicle.devices import RELEASED, DeviceClock, Grant, Outbox
from slipbench.protocol.codec.messages import ActuatorCommand, Authority, OpticalSpeed

SILENCE = 0.010  # s
HELD = (Authority.THROTTLE, Authority.SPARK)
commands = st.tuples(st.floats(0.0, 0.02), st.sampled_from(Authority))  # gap in s, authority


def command(authority: Authority) -> ActuatorCommand:
    return ActuatorCommand(authority, 0.1, 0.0, 0.0)


def test_a_clock_without_offset_and_drift_is_true_and_one_with_them_runs_on_a_line():
    assert DeviceClock().read(12.5) == 12.5
    clock = DeviceClock(3.0, 1e-4)
    assert clock.read(0.0) == 3.0
    assert clock.read(10.0) - clock.read(4.0) == pytest.approx(6.0 * 1.0001)


def test_nothing_is_granted_before_a_command_was_heard():
    assert Grant().authority == Authority.NONE
    assert Grant().with_watchdog(1e9, SILENCE).authority == Authority.NONE
    assert Grant().command == ActuatorCommand(Authority.NONE, 0.0, 0.0, 0.0)
    assert Grant() == Grant(RELEASED, -math.inf, False)


@pytest.mark.parametrize("authority", HELD)
def test_a_grant_lasts_as_long_as_the_silence_allows_and_no_longer(authority):
    grant = Grant().receive(command(authority), 1.0)
    assert grant.authority == authority
    assert grant.command == command(authority)
    assert grant.with_watchdog(1.0 + 0.99 * SILENCE, SILENCE) == grant
    exact = Grant().receive(command(authority), 2.0)
    assert exact.with_watchdog(2.0 + 0.25, 0.25).authority == authority  # these are exact in binary
    gone = exact.with_watchdog(2.0 + 0.25 + 2**-30, 0.25)
    assert gone.authority == Authority.NONE
    assert (gone.command, gone.received_at) == (exact.command, exact.received_at)


@pytest.mark.parametrize("authority", HELD)
def test_after_a_silence_only_a_release_opens_the_way_to_another_grant(authority):
    """A bench that comes back in the midst of its excitation gets nothing."""
    grant = Grant().receive(command(authority), 1.0).with_watchdog(1.02, SILENCE)
    for late in (1.03, 1.04):
        grant = grant.receive(command(authority), late).with_watchdog(late, SILENCE)
        assert grant.authority == Authority.NONE
    grant = grant.receive(command(Authority.NONE), 1.05)
    assert grant.authority == Authority.NONE
    assert grant.receive(command(authority), 1.06).authority == authority


@pytest.mark.parametrize("authority", HELD)
def test_where_no_release_can_arrive_the_next_request_is_granted_after_every_silence(authority):
    released = Grant(latches=False)
    grant = released
    for now in (1.0, 2.0, 3.0):
        assert grant.authority == Authority.NONE
        grant = grant.receive(command(authority), now).with_watchdog(now + 0.001, SILENCE)
        assert grant == Grant(command(authority), now, latches=False)
        grant = grant.with_watchdog(now + 2 * SILENCE, SILENCE)
        assert grant == released
        assert grant.latches is False


@given(st.lists(commands, max_size=30))
def test_a_device_grants_the_last_command_unless_a_silence_came_since_the_last_release(heard):
    now, grant, held, latched = 0.0, Grant(), Authority.NONE, False
    for gap, authority in heard:
        now += gap
        grant = grant.with_watchdog(now, SILENCE)
        latched = latched or (held != Authority.NONE and gap > SILENCE)
        if abs(gap - SILENCE) < 1e-12:
            return  # on the edge rounding decides
        grant = grant.receive(command(authority), now)
        latched, held = latched and authority != Authority.NONE, authority
        assert grant.authority == (Authority.NONE if latched else authority)


def message(number: int) -> OpticalSpeed:
    return OpticalSpeed(float(number), True, 0.0)


@given(st.lists(st.integers(0, 20), max_size=30), st.integers(0, 20))
def test_what_is_due_comes_out_once_in_the_order_in_which_it_is_due(times, now):
    """Of two that are due together the one that was put in first."""
    outbox = Outbox()
    assert outbox.due(1e9) == []
    for number, time in enumerate(times):
        outbox.put(time * 0.001, f"message {number}", message(number))
    order = sorted(range(len(times)), key=lambda n: (times[n], n))
    first = [n for n in order if times[n] <= now]
    assert outbox.due(now * 0.001) == [(f"message {n}", message(n)) for n in first]
    assert outbox.due(now * 0.001) == []
    assert [name for name, _ in outbox.due(1.0)] == [f"message {n}" for n in order[len(first) :]]


def test_a_message_due_within_a_nanosecond_is_due():
    """Times are sums of periods: rounding must not make a frame a whole tick late."""
    outbox = Outbox()
    outbox.put(1.0 + 0.9e-9, "now", message(1))
    outbox.put(1.0 + 1.1e-9, "later", message(2))
    assert [name for name, _ in outbox.due(1.0)] == ["now"]
    outbox.put(1e-9, "exactly", message(3))
    assert [name for name, _ in outbox.due(0.0)] == ["exactly"]
