"""Safety requirements of a throttle body that grants authority; each raises AssertionError where it is not met."""

from collections.abc import Callable, Sequence
from itertools import pairwise

from slipbench.protocol.codec import e2e
from slipbench.protocol.codec.messages import ActuatorCommand, Authority, ThrottleStatus
from tests.hil.tester import GRIP, RELEASE, Status, Tester

COMMAND_DATA_ID = 0x5110
WRAP = 2**24 * 1e-6  # s, of the time in ThrottleStatus
WATCHDOG, CYCLE = 0.020, 0.001  # s
RATE, CURRENT = 8.0, 8.0  # 1/s and A, limits of the device
NEAR = 0.01  # of the opening
OPEN = ActuatorCommand(Authority.THROTTLE, 0.30, 0.0, 0.0)


def messages(statuses: Sequence[Status]) -> list[ThrottleStatus]:
    """The valid messages; there are some."""
    found = [status.message for status in statuses if status.message is not None]
    assert found, "no valid ThrottleStatus"
    return found


def authority(statuses: Sequence[Status]) -> Authority:
    """Authority reported last."""
    return Authority(messages(statuses)[-1].authority)


def opening(statuses: Sequence[Status]) -> float:
    return messages(statuses)[-1].position


def near(found: float, expected: float) -> bool:
    return abs(found - expected) <= NEAR


def grants(tester: Tester) -> None:
    """HIL-1: a valid command gets authority within 3 cycles, and the plate follows it."""
    tester.run(300, RELEASE)
    margin = round((3 * CYCLE + tester.dut.jitter) / CYCLE)
    assert authority(tester.run(margin, OPEN)) == Authority.THROTTLE
    assert near(opening(tester.run(300, OPEN)), OPEN.throttle)


def silence(tester: Tester) -> None:
    """HIL-2: 20 ms without a command give the throttle back, 15 ms do not."""
    tester.take(OPEN)
    still = 15 - round(tester.dut.jitter / CYCLE)
    assert authority(tester.run(still)) == Authority.THROTTLE
    tester.run(5, OPEN)
    after = tester.run(60)
    back = first(after, lambda m: m.authority == Authority.NONE) - tester.last_command
    assert WATCHDOG - tester.dut.jitter <= back <= WATCHDOG + 2 * CYCLE + tester.dut.jitter, back
    assert near(opening(tester.run(300)), GRIP)


def latch(tester: Tester) -> None:
    """HIL-3: after a silence authority is granted again only after a release."""
    tester.take(OPEN)
    tester.run(60)
    assert {m.authority for m in messages(tester.run(100, OPEN))} == {Authority.NONE}
    assert authority(tester.take(OPEN)) == Authority.THROTTLE


def invalid_commands(tester: Tester) -> None:
    """HIL-4: a command with a wrong CRC or of less than 8 bytes does not count."""
    for change in (lambda d: bytes([d[0] ^ 0x10, *d[1:]]), lambda d: d[:7]):
        tester.take(OPEN)
        assert authority(tester.run(60, OPEN, change=change)) == Authority.NONE


def repeated_commands(tester: Tester) -> None:
    """HIL-5: a command whose counter does not advance does not count."""
    tester.take(OPEN)
    assert authority(tester.run(60, OPEN, held=3)) == Authority.NONE


def range_of_commands(tester: Tester) -> None:
    """HIL-6: a command beyond 100 % does not count, whatever its CRC; the plate does not follow it."""
    tester.take(OPEN)

    def beyond(data: bytes) -> bytes:
        word = int.from_bytes(data, "little") & ~(0x3FFF << 14) | 12000 << 14
        payload = bytearray(word.to_bytes(8, "little"))
        e2e.protect(payload, COMMAND_DATA_ID, payload[1] & 0x0F)
        return bytes(payload)

    found = messages(tester.run(200, OPEN, change=beyond))
    assert max(m.position for m in found) <= OPEN.throttle + NEAR
    assert found[-1].authority == Authority.NONE


def status(tester: Tester) -> None:
    """HIL-7: ThrottleStatus comes every millisecond with a right CRC, its counter and time advancing."""
    milliseconds = 300
    found = tester.run(milliseconds, RELEASE)
    assert len(found) >= 0.9 * milliseconds, f"{len(found)} frames in {milliseconds} ms"
    assert all(each.message is not None for each in found), "wrong CRC"
    counters = [each.counter for each in found]
    assert all((b - a) % e2e.PERIOD == 1 for a, b in pairwise(counters))
    assert all(elapsed(a, b) > 0.0 for a, b in pairwise(messages(found))), "its time stands still"


def rate(tester: Tester) -> None:
    """HIL-8: the plate moves at up to 8 /s, however far the command jumps."""
    tester.take(ActuatorCommand(Authority.THROTTLE, 0.05, 0.0, 0.0))
    found = messages(tester.run(200, ActuatorCommand(Authority.THROTTLE, 0.95, 0.0, 0.0)))
    window = 10  # cycles: the position has a resolution of 1e-4
    rates = [
        (b.position - a.position) / elapsed(a, b)
        for a, b in zip(found, found[window:], strict=False)
        if elapsed(a, b) > 0.0
    ]
    assert rates, "its time stands still"
    assert max(rates) <= 1.15 * RATE, max(rates)
    assert max(rates) >= 0.5 * RATE, "it never moved"


def current(tester: Tester) -> None:
    """HIL-9: the motor current stays within 8 A, also with a jammed plate."""
    tester.take(OPEN)
    tester.dut.jam()
    found = messages(tester.run(400, ActuatorCommand(Authority.THROTTLE, 1.0, 0.0, 0.0)))
    assert max(abs(m.motor_current) for m in found) <= CURRENT + 0.025


def jammed(tester: Tester) -> None:
    """HIL-10: a plate that does not follow is reported as faulty, ends authority and has no current."""
    tester.take(OPEN)
    assert not messages(tester.run(50, OPEN))[-1].faulty
    tester.dut.jam()
    found = messages(tester.run(400, ActuatorCommand(Authority.THROTTLE, 0.6, 0.0, 0.0)))
    assert found[-1].faulty
    assert found[-1].authority == Authority.NONE
    assert found[-1].motor_current == 0.0


def rider_silent(tester: Tester) -> None:
    """HIL-11: without the rider's controls authority ends within 50 ms, and the throttle closes."""
    tester.take(OPEN)
    found = tester.run(80, OPEN, grip=None)
    assert authority(found) == Authority.NONE
    assert opening(tester.run(300, OPEN, grip=None)) <= NEAR


def spark_only(tester: Tester) -> None:
    """HIL-12: authority over the spark alone leaves the throttle to the rider."""
    tester.run(300, RELEASE)
    found = tester.run(200, ActuatorCommand(Authority.SPARK, 0.5, 0.0, 0.0))
    assert all(near(m.position, GRIP) for m in messages(found))


def rider(tester: Tester) -> None:
    """HIL-13: without authority the throttle follows the rider's grip, before and after a grant."""
    for grip in (0.25, 0.05):
        assert near(opening(tester.run(300, grip=grip)), grip)
        tester.take(OPEN)
        tester.run(20, RELEASE)
    assert near(opening(tester.run(300, RELEASE, grip=0.2)), 0.2)


def pause(tester: Tester) -> None:
    """HIL-14: a device that stood still for 50 ms grants nothing until a release, whatever it then reads."""
    tester.take(OPEN)
    tester.dut.stop()
    tester.run(50, OPEN)
    tester.dut.go_on()
    later = [each for each in tester.run(60, OPEN) if each.message is not None][5:]
    assert {m.authority for m in messages(later)} == {Authority.NONE}
    assert authority(tester.take(OPEN)) == Authority.THROTTLE


def elapsed(before: ThrottleStatus, after: ThrottleStatus) -> float:
    """Time (s) of the device's clock between two of its messages; its signal wraps."""
    return (after.time - before.time) % WRAP


def first(statuses: Sequence[Status], holds: Callable[[ThrottleStatus], bool]) -> float:
    """Time (s) of the first message for which it holds."""
    times = [each.time for each in statuses if each.message is not None and holds(each.message)]
    assert times, "it never did"
    return times[0]


REQUIREMENTS: dict[str, Callable[[Tester], None]] = {
    (function.__doc__ or "").partition(":")[0]: function
    for function in (
        grants,
        silence,
        latch,
        invalid_commands,
        repeated_commands,
        range_of_commands,
        status,
        rate,
        current,
        jammed,
        rider_silent,
        spark_only,
        rider,
        pause,
    )
}

# A planted fault of the device (-DPLANTED_NAME), and the requirement that finds it.
PLANTED = {
    "INTEGRAL_MISSING": "HIL-1",
    "WATCHDOG_OFF": "HIL-2",
    "RIDER_IGNORED": "HIL-2",
    "LATCH_MISSING": "HIL-3",
    "CRC_UNCHECKED": "HIL-4",
    "COUNTER_UNCHECKED": "HIL-5",
    "RANGE_UNCHECKED": "HIL-6",
    "COUNTER_STUCK": "HIL-7",
    "TIME_STUCK": "HIL-7",
    "SENDS_TOO_RARELY": "HIL-7",
    "RATE_LIMIT_MISSING": "HIL-8",
    "CURRENT_LIMIT_MISSING": "HIL-9",
    "FOLLOWING_UNCHECKED": "HIL-10",
    "RIDER_TIMEOUT_OFF": "HIL-11",
    "SPARK_MOVES_THROTTLE": "HIL-12",
    "GRIP_FROZEN": "HIL-13",
    "PAUSE_UNCHECKED": "HIL-14",
}
