"""Laws of `slipbench check`: a healthy bus has no finding, each planted trouble has one, nothing is sent."""

from dataclasses import replace

import can
import pytest

from slipbench.bench.check.listen import Listener
from slipbench.bench.check.observed_roles import observed_roles
from slipbench.bench.check.report import check_report, summary
from slipbench.bench.loop.clock import SimulatedClock
from slipbench.protocol.binding.binding import Binding
from slipbench.protocol.codec.codec import Sender
from slipbench.protocol.codec.messages import ActuatorCommand, Authority
from tests.bench.check.harness import changed, own, traffic, with_rules, world
from tests.protocol.binding.foreign import foreign_binding

OWN = own()


@pytest.fixture(scope="module")
def healthy() -> list[can.Message]:
    with world(OWN) as made:
        return made.frames(1.5)


@pytest.fixture(scope="module")
def bindings(tmp_path_factory) -> list[Binding]:
    return [foreign_binding(seed, tmp_path_factory.mktemp(f"f{seed}")) for seed in (1, 2)]


def test_a_healthy_bus_has_every_role_live_and_no_finding(healthy) -> None:
    report = check_report(OWN, traffic(OWN, healthy))
    assert [each.role for each in report.roles if not each.is_live] == []
    assert [str(each) for each in report.findings] == []
    assert report.status == 0
    assert report.missing == ()
    text = summary(report)
    assert "nothing is missing for a trial" in text
    assert "rpm" in text  # the value in the unit of the database


@pytest.mark.parametrize("number", [0, 1])
def test_a_foreign_bus_with_other_protections_is_as_healthy(bindings, number) -> None:
    binding = bindings[number]
    with world(binding) as made:
        report = check_report(binding, traffic(binding, made.frames(1.5)))
    assert [each.role for each in report.roles if not each.is_live] == []
    assert [str(each) for each in report.findings] == []
    assert report.status == 0


def identifier(binding: Binding, message: str) -> int:
    return binding.database.message(message).identifier


def test_a_role_that_falls_silent_is_named(healthy) -> None:
    throttle, end = identifier(OWN, "ThrottleStatus"), healthy[-1].timestamp
    cut = [f for f in healthy if f.arbitration_id != throttle or f.timestamp < end - 0.2]
    report = check_report(OWN, traffic(OWN, cut))
    silent = {each.role for each in report.roles if each.state == "silent"}
    assert silent == {
        "throttle_position",
        "throttle_authority",
        "throttle_fault",
        "throttle_current",
    }
    assert report.status == 3


def test_a_role_that_never_comes_is_named(healthy) -> None:
    optical = identifier(OWN, "OpticalSpeed")
    report = check_report(OWN, traffic(OWN, [f for f in healthy if f.arbitration_id != optical]))
    assert {each.role for each in report.roles if each.state == "never received"} == {
        "optical_speed"
    }
    assert report.status == 3


def test_nothing_received_is_status_2_and_lists_what_came(healthy) -> None:
    stranger = [changed(frame, arbitration_id=0x7A5) for frame in healthy[:50]]
    for frames in ([], stranger):
        report = check_report(OWN, traffic(OWN, frames))
        assert report.status == 2
        assert "nothing was received" in summary(report)
    assert "0x7a5" in summary(report)


@pytest.mark.parametrize(
    "protection",
    [
        {"profile": "E2E1", "data_id": 0x0FFF},
        {"profile": "E2E5", "data_id": 0x0020},
        {"profile": "plain", "checksum": {"signal": "crc", "kind": "xor"}},
    ],
    ids=lambda each: each["profile"],
)
def test_a_protection_that_the_frames_do_not_have_is_contradicted_with_the_one_they_have(
    healthy, protection
) -> None:
    wrong = with_rules(OWN, EcuStatus={"protection": protection})
    report = check_report(wrong, traffic(wrong, healthy))
    found = [each for each in report.findings if each.role == "messages.EcuStatus.protection"]
    assert len(found) == 1
    assert 'profile = "E2E1"' in found[0].remedy  # what the frames obey
    assert report.status == 3


def test_a_counter_that_stands_is_contradicted(healthy) -> None:
    rule = {"protection": {"profile": "plain", "counter": "authority"}}
    wrong = with_rules(OWN, EcuStatus=rule)
    report = check_report(wrong, traffic(wrong, healthy))
    assert any("counter does not count" in each.found for each in report.findings)


def test_a_request_that_another_node_sends_is_a_finding(healthy) -> None:
    sender, sent = Sender(OWN.codec()), []
    for number in range(40):
        command = ActuatorCommand(Authority.NONE, 0.0, 0.0, number * 1e-3)
        name, data = sender.encode(command)
        sent.append(
            can.Message(
                arbitration_id=name,
                data=data,
                is_extended_id=False,
                timestamp=healthy[0].timestamp + number * 1e-3,
            )
        )
    report = check_report(OWN, traffic(OWN, healthy + sent))
    found = [each for each in report.findings if "another node sends ActuatorCommand" in each.what]
    assert len(found) == 1
    assert "throttle_request" in found[0].role
    assert report.status == 3


def test_a_wrong_scale_of_a_speed_and_a_wrong_unit_are_findings(healthy) -> None:
    assert OWN.roles is not None
    roles = dict(OWN.roles.roles)
    roles["engine_speed"] = roles["engine_speed"].model_copy(update={"scale": 60.0})
    wrong = replace(OWN, roles=OWN.roles.model_copy(update={"roles": roles}))
    report = check_report(wrong, traffic(wrong, healthy))
    assert [each.role for each in report.findings] == ["engine_speed"]
    assert "unit" in report.findings[0].remedy


def test_a_message_that_comes_more_rarely_than_stated_is_a_finding(healthy) -> None:
    wrong = with_rules(OWN, EngineStatus={"cycle_time": "1 ms"})
    found = check_report(wrong, traffic(wrong, healthy)).findings
    assert [each.role for each in found] == ["messages.EngineStatus.cycle_time"]
    assert "every 5 ms" in found[0].found


def test_one_signal_for_two_speeds_is_a_finding_and_for_an_axle_and_its_side_is_none(
    healthy,
) -> None:
    assert OWN.roles is not None
    speed = OWN.roles.roles["optical_speed"].model_copy(update={"clock": "bus", "time_signal": ""})
    for added, count in ((("vehicle_speed",), 1), ((), 0)):
        roles = {**OWN.roles.roles, **dict.fromkeys(added, speed)}
        binding = replace(OWN, roles=OWN.roles.model_copy(update={"roles": roles}))
        found = check_report(binding, traffic(binding, healthy)).findings
        assert len(found) == count
        assert all("also bound to optical_speed" in each.what for each in found)


def test_damaged_frames_make_a_role_faulty(healthy) -> None:
    ecu = identifier(OWN, "EngineStatus")
    bad = [
        changed(frame, data=bytes([frame.data[0] ^ 1, *frame.data[1:]]))
        if frame.arbitration_id == ecu and number % 5 == 0
        else frame
        for number, frame in enumerate(healthy)
    ]
    states = {each.role: each for each in observed_roles(OWN, traffic(OWN, bad))}
    assert states["engine_speed"].state == "faulty"
    assert (states["engine_speed"].faults or {})["wrong CRC"] > 10
    assert states["throttle_position"].is_live


def test_lost_frames_are_counted_and_do_not_make_a_role_faulty(healthy) -> None:
    ecu = identifier(OWN, "EngineStatus")
    seen = 0
    kept = []
    for frame in healthy:
        seen += frame.arbitration_id == ecu
        if frame.arbitration_id != ecu or seen % 7:
            kept.append(frame)
    states = {each.role: each for each in observed_roles(OWN, traffic(OWN, kept))}
    assert states["engine_speed"].is_live
    assert (states["engine_speed"].faults or {})["lost"] > 10


def test_listening_sends_nothing_and_takes_the_stated_time() -> None:
    with world(OWN) as made:
        made.frames(0.2)
        sent_before = made.bus.wire.now_ns

        class Waiting:
            """A bus whose wait for a frame lets the time pass."""

            sent = 0

            def recv(self, timeout: float) -> can.Message | None:
                if (frame := made.ours.recv(0)) is None:
                    made.clock.sleep_until_ns(made.clock.now_ns() + 1_000_000)
                return frame

            def send(self, *_: object) -> None:
                self.sent += 1

        bus = Waiting()
        listener = Listener({"bus": bus}, made.clock, OWN.database)
        heard = listener.listen(1.0)
        recent = listener.recent()
    assert bus.sent == 0
    assert made.bus.wire.now_ns > sent_before
    assert heard.duration == pytest.approx(1.0, abs=0.2)
    assert len(recent.log) == len(heard.log)
    assert all(each.age is not None and each.age < 0.6 for each in check_report(OWN, heard).roles)


def test_frames_that_wait_at_the_end_are_read_before_a_role_counts_as_silent(healthy) -> None:
    """A busy machine reads late: the age of a role is not the time that its frames waited."""

    class Late:
        """All frames wait already, and the time to listen is over with the first one."""

        def __init__(self) -> None:
            self.waiting, self.clock = list(healthy), SimulatedClock()

        def recv(self, timeout: float) -> can.Message | None:
            if timeout:
                self.clock.sleep_until_ns(self.clock.now_ns() + 2_000_000_000)
            return self.waiting.pop(0) if self.waiting else None

    bus = Late()
    report = check_report(OWN, Listener({"bus": bus}, bus.clock, OWN.database).listen(1.0))
    assert report.frames == len(healthy)
    assert [each.role for each in report.roles if not each.is_live] == []
