"""Whatever arrives, the device in C grants what a plain model of its rules grants."""

from collections.abc import Callable

from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from slipbench import dbc
from slipbench.protocol.codec import e2e
from slipbench.protocol.codec.codec import Codec
from slipbench.protocol.codec.messages import (
    ActuatorCommand,
    Authority,
    RiderControls,
    ThrottleStatus,
)
from slipbench.protocol.database.database import load_database
from tests.hil.device import STATUS_ID, Core

CODEC = Codec(load_database(dbc.MOTORBIKE))
WATCHDOG, RIDER_TIMEOUT, CYCLE = 20_000, 50_000, 1_000  # us
MOST_LOST, CURRENT = 4, 8.0  # frames, A

# What happens in some cycles: (kind, number of cycles, authority, step of the counter, bit that is inverted)
events = st.lists(
    st.tuples(
        st.sampled_from(["command", "command", "command", "silence", "corrupt", "noise", "pause"]),
        st.integers(1, 25),
        st.sampled_from(Authority),
        st.sampled_from([1, 1, 1, 1, 0, 2, 5, 6, 14]),
        st.integers(0, 63),
        st.booleans(),  # whether the rider's controls arrive
    ),
    min_size=1,
    max_size=40,
)


class Model:
    """The rules of the README. Times in us."""

    def __init__(self) -> None:
        self.authority, self.latched = Authority.NONE, False
        self.command_at = 0
        self.stepped_at: int | None = None
        self.rider_at: int | None = None
        self.counter: int | None = None

    def command(self, authority: Authority, counter: int, now: int) -> None:
        step = None if self.counter is None else (counter - self.counter) % e2e.PERIOD
        self.counter = counter
        if step is None or 1 <= step <= 1 + MOST_LOST:
            self.authority, self.command_at = authority, now
            self.latched = self.latched and authority != Authority.NONE

    def granted(self, now: int) -> Authority:
        rider = self.rider_at is not None and now - self.rider_at <= RIDER_TIMEOUT
        silent = now - self.command_at > WATCHDOG
        paused = self.stepped_at is not None and now - self.stepped_at > WATCHDOG
        if self.authority != Authority.NONE and (silent or paused or not rider):
            self.latched = True
        self.stepped_at = now
        return Authority.NONE if self.latched else self.authority


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=200)
@given(events)
def test_it_grants_what_its_rules_grant_and_stays_within_its_current(
    core: Callable[[str], Core], happened
) -> None:
    device, model = core(""), Model()
    now, counter, rider_counter = 0, 0, 0
    for kind, cycles, authority, step, bit, rider in happened:
        for _ in range(cycles):
            now += CYCLE
            if rider and now % (5 * CYCLE) == 0:
                rider_counter = (rider_counter + 1) % e2e.PERIOD
                controls = RiderControls(False, 0.1, 0.0, 0.0, 0.0)
                device.receive(*CODEC.encode(controls, counter=rider_counter), now)
                model.rider_at = now
            if kind in ("command", "corrupt"):
                counter = (counter + step) % e2e.PERIOD
                command = ActuatorCommand(authority, 0.01 * bit, 0.0, 0.0)
                identifier, data = CODEC.encode(command, counter=counter)
                if kind == "corrupt":
                    data = (int.from_bytes(data, "little") ^ 1 << bit).to_bytes(8, "little")
                device.receive(identifier, data, now)
                if kind == "command":
                    model.command(authority, counter, now)
            if kind == "noise":
                device.receive(0x10 + bit, bytes(range(bit % 9)), now)
            if kind == "pause":
                continue
            status = CODEC.decode(STATUS_ID, device.step(now) or b"")
            assert isinstance(status, ThrottleStatus)
            assert not status.faulty
            assert status.authority == model.granted(now), (kind, now)
            assert abs(status.motor_current) <= CURRENT + 0.025
