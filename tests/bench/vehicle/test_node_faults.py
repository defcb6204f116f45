"""Faults of simulated nodes by a fault plan, on any bus, as on the bus model."""

import json
from dataclasses import replace

import pytest

from slipbench.bench.bus.faults import (
    Corrupted,
    Delayed,
    Disturbed,
    Duplicated,
    FaultPlan,
    Frozen,
    Lost,
    Reordered,
    Where,
)
from slipbench.bench.bus.frame import Frame
from slipbench.bench.bus.plan_text import load_plan, plan_text
from slipbench.bench.vehicle.node_faults import NodeFaults
from slipbench.protocol.codec.codec import Sender
from slipbench.protocol.codec.messages import ActuatorCommand, Authority
from slipbench.protocol.errors import InputError
from tests.bench.lockstep import LockStep
from tests.bench.trials.test_whole_trial import prepared

SECONDS = 0.2
THROTTLE = frozenset({"throttle"})
TO_MOTORCYCLE = frozenset({"motorcycle"})
ALL_SENDERS = frozenset({"motorcycle"})


class Heard(LockStep):
    """A motorcycle with faults, and every frame that it sends: (ms, identifier, payload)."""

    def __init__(self, *faults) -> None:
        plan = FaultPlan(faults, seed=3)
        super().__init__(replace(prepared().scenario, faults=plan))
        self.sender = Sender(self.codec)

    def run(self, milliseconds: int, command: ActuatorCommand | None = None):
        for _ in range(milliseconds):
            if command:
                self.send(*self.sender.encode(command))
            self.live()
        frames = []
        while (frame := self._ours.recv(0)) is not None:
            now = round((frame.timestamp - 1.0) * 1e3)
            frames.append((now, frame.arbitration_id, bytes(frame.data)))
        return frames

    def of(self, frames, name: str):
        return [
            (now, data) for now, number, data in frames if number == self.codec.identifier(name)
        ]


@pytest.fixture(scope="module")
def healthy():
    with Heard() as bus:
        return bus.run(200)


def statuses(healthy, *faults):
    """ThrottleStatus without and with faults, and whether the other messages are as they were."""
    with Heard(*faults) as bus:
        frames = bus.run(200)
        number = bus.codec.identifier("ThrottleStatus")
        others = [sorted(f[1:] for f in each if f[1] != number) for each in (healthy, frames)]
        return bus.of(healthy, "ThrottleStatus"), bus.of(frames, "ThrottleStatus"), others


@pytest.mark.parametrize("sender", ["throttle", "motorcycle"])
def test_a_lost_node_is_silent_in_its_time_and_no_other_is(healthy, sender: str) -> None:
    where = Where(0.05, 0.1, frozenset({0x30}), frozenset({sender}))
    before, after, (untouched, others) = statuses(healthy, Lost(1.0, where))
    assert [data for _, data in after] == [d for t, d in before if not 50 <= t < 100]
    assert others == untouched


def test_a_corrupted_frame_has_one_bit_inverted_and_its_fault_is_seen(healthy) -> None:
    before, after, _ = statuses(healthy, Corrupted(1.0, Where(senders=THROTTLE)))
    with Heard() as bus:
        assert len(after) == len(before)
        for (_, right), (_, wrong) in zip(before, after, strict=True):
            bits = int.from_bytes(right, "big") ^ int.from_bytes(wrong, "big")
            assert bits.bit_count() == 1
            assert "CRC" in str(bus.codec.decode(0x30, wrong))


def test_a_delayed_frame_is_late_by_its_delay(healthy) -> None:
    before, after, _ = statuses(healthy, Delayed(1.0, 0.030, where=Where(senders=THROTTLE)))
    assert [d for _, d in after] == [d for _, d in before][: len(after)]
    late = [b - a for (a, _), (b, _) in zip(before, after, strict=False)]
    assert set(late) == {30}


def test_a_frozen_node_repeats_its_last_frame(healthy) -> None:
    before, after, _ = statuses(healthy, Frozen(Where(0.1, senders=THROTTLE)))
    assert len(after) == len(before)
    assert len({d for t, d in after if t >= 101}) == 1


def test_a_duplicated_frame_is_sent_twice(healthy) -> None:
    before, after, _ = statuses(healthy, Duplicated(1.0, Where(senders=THROTTLE)))
    assert len(after) == 2 * len(before)


def test_a_reordered_frame_leaves_after_the_next_one() -> None:
    late, next_one = Frame(0x30, b"late"), Frame(0x20, b"next")
    faults = NodeFaults(FaultPlan((Reordered(1.0, where=Where(senders=THROTTLE)),)))
    faults.send(late, "throttle", 0.001)
    assert faults.leaving(0.001) == []
    faults.send(next_one, "ecu", 0.002)
    assert faults.leaving(0.002) == [next_one, late]


def test_commands_that_do_not_arrive_run_into_the_watchdog() -> None:
    command = ActuatorCommand(Authority.THROTTLE, 0.1, 0.0, 0.0)
    with Heard(Lost(1.0, Where(0.05, receivers=TO_MOTORCYCLE))) as bus:
        bus.run(150, command)
        [timeout] = bus.motorcycle.watchdog_timeouts
        assert timeout == pytest.approx(0.070, abs=0.0015)


def test_the_same_plan_gives_the_same_frames() -> None:
    fault = Lost(0.3, Where(senders=ALL_SENDERS))
    with Heard(fault) as one, Heard(fault) as other:
        frames = one.run(100)
        assert frames == other.run(100)
        assert len(frames) > 100


@pytest.mark.parametrize(
    ("fault", "words"),
    [
        (Disturbed(1.0), ["destroys frames on the wire", "lost or corrupted"]),
        (Lost(1.0, Where(senders=frozenset({"gps"}))), ["senders", "gps", "throttle"]),
        (Lost(1.0, Where(receivers=frozenset({"ecu"}))), ["receivers", "ecu", "motorcycle"]),
    ],
)
def test_a_plan_that_no_node_can_carry_out_is_refused(fault, words) -> None:
    with pytest.raises(InputError) as refusal:
        NodeFaults(FaultPlan((fault,)))
    for word in words:
        assert word in str(refusal.value)


def test_a_plan_is_read_from_its_file(tmp_path) -> None:
    plan = FaultPlan((Lost(0.5, Where(1.0, 2.0, senders=THROTTLE)),), seed=4)
    path = tmp_path / "plan.json"
    path.write_text(plan_text(plan), encoding="utf-8")
    assert load_plan(path) == plan


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("{", ["plan.json", "not a fault plan"]),
        (json.dumps({"seed": 0, "faults": [{"fault": "lots"}]}), ["plan.json", "lots"]),
        (None, ["plan.json", "cannot be read"]),
    ],
)
def test_a_file_that_is_no_plan_is_refused_with_its_name(tmp_path, content, words) -> None:
    path = tmp_path / "plan.json"
    if content is not None:
        path.write_text(content, encoding="utf-8")
    with pytest.raises(InputError) as refusal:
        load_plan(path)
    for word in words:
        assert word in str(refusal.value)
