"""Every fault that is injected; one case is one row of docs/fault_matrix.md."""

from functools import partial

from slipbench.bench.bus.faults import (
    Corrupted,
    Delayed,
    Disturbed,
    Duplicated,
    Frozen,
    Lost,
    Reordered,
    Where,
)
from slipbench.protocol.codec.messages import TripReason
from tests.faults import ending
from tests.faults.devices import (
    AT,
    FieldReplaced,
    FieldsFrozen,
    OneToothOfATurn,
    Silent,
    Slowing,
    Teeth,
    second_vehicle,
)
from tests.faults.run_case import Case

GATEWAY = frozenset({"gateway"})
MOTORCYCLE = frozenset({"motorcycle"})
TO_BENCH, TO_MOTORCYCLE = Where(AT, receivers=GATEWAY), Where(AT, receivers=MOTORCYCLE)
TEETH = 16  # of the demonstration vehicle's encoders


def _encoder(wheel: str, missing: bool) -> dict[str, Teeth]:
    return {wheel: OneToothOfATurn(TEETH, missing)}


BUS = (
    Case(
        "disturbed",
        "1 % of all frames destroyed on the wire",
        TripReason.NONE,
        bus=(Disturbed(0.01),),
        why="CAN repeats them",
    ),
    Case(
        "lost some",
        "1 % of the frames to the bench lost",
        TripReason.NONE,
        bus=(Lost(0.01, Where(receivers=GATEWAY)),),
        why="the next frame arrives within `limits.stale`",
        vcan="test_sockets.py::test_a_listener_that_does_not_read_loses_the_newest_and_is_not_told",
    ),
    Case(
        "lost to us", "all frames to the bench lost", TripReason.STALE, bus=(Lost(1.0, TO_BENCH),)
    ),
    Case(
        "lost to it",
        "all frames to the motorcycle lost",
        TripReason.AUTHORITY_LOST,
        bus=(Lost(1.0, TO_MOTORCYCLE),),
    ),
    Case(
        "corrupted some",
        "1 % of the frames to the bench corrupted",
        TripReason.NONE,
        bus=(Corrupted(0.01, Where(receivers=GATEWAY)),),
        why="only `limits.faults` faulty frames in a row trip",
    ),
    Case(
        "corrupted to us",
        "all frames to the bench corrupted",
        TripReason.FAULTY,
        bus=(Corrupted(1.0, TO_BENCH),),
    ),
    Case(
        "corrupted to it",
        "all frames to the motorcycle corrupted",
        TripReason.AUTHORITY_LOST,
        bus=(Corrupted(1.0, TO_MOTORCYCLE),),
    ),
    Case(
        "duplicated to us",
        "all frames to the bench duplicated",
        TripReason.TWO_SENDERS,
        bus=(Duplicated(1.0, TO_BENCH),),
        why="a single repeated counter is ignored; so many may be a second vehicle",
    ),
    Case(
        "duplicated to it",
        "all frames to the motorcycle duplicated",
        TripReason.NONE,
        bus=(Duplicated(1.0, TO_MOTORCYCLE),),
        why="the devices ignore a repeated counter",
    ),
    Case(
        "reordered some",
        "5 % of the frames to the bench arrive after the next frame",
        TripReason.NONE,
        bus=(Reordered(0.05, where=Where(receivers=GATEWAY)),),
        why="a late value is one period old",
    ),
    Case(
        "delayed a little",
        "all frames to the bench delayed by 5 ms",
        TripReason.NONE,
        bus=(Delayed(1.0, 0.005, where=TO_BENCH),),
        why="less than `limits.stale`; a constant delay can be detected only when it begins",
    ),
    Case(
        "delayed",
        "all frames to the bench delayed by 30 ms",
        TripReason.STALE,
        bus=(Delayed(1.0, 0.030, where=TO_BENCH),),
    ),
    Case(
        "repeated to us",
        "all frames to the bench repeat the last payload",
        TripReason.FAULTY,
        bus=(Frozen(TO_BENCH),),
    ),
    Case(
        "repeated to it",
        "all frames to the motorcycle repeat the last payload",
        TripReason.AUTHORITY_LOST,
        bus=(Frozen(TO_MOTORCYCLE),),
    ),
    Case(
        "bench off the bus",
        "bus-off of the bench",
        TripReason.BUS_OFF,
        bus=(Disturbed(1.0, Where(AT, senders=GATEWAY)),),
        vcan="test_sockets.py::test_an_error_frame_of_the_kernel_tells_that_the_controller_is_off",
    ),
    Case(
        "motorcycle off the bus",
        "bus-off of the motorcycle",
        TripReason.STALE,
        bus=(Disturbed(1.0, Where(AT, senders=MOTORCYCLE)),),
        within=0.0245,
        why="by the rules of CAN its controller goes bus-off after 32 attempts, 3 ms; then it "
        "receives no command, and the watchdog of 20 ms runs",
    ),
)

DEVICES = (
    *(
        Case(
            f"counter of {name}",
            f"counter of {name} frozen, values change",
            TripReason.STALE if name == "EngineStatus" else TripReason.FAULTY,
            failing=partial(FieldsFrozen, name),
        )
        for name in ("EcuStatus", "ThrottleStatus", "EngineStatus", "OpticalSpeed")
    ),
    Case(
        "counter of RiderControls",
        "counter of RiderControls frozen, values change",
        TripReason.STALE,
        failing=partial(FieldsFrozen, "RiderControls"),
    ),
    # Age and number of faulty frames exceed their limits within one tick; the age is checked first.
    Case(
        "engine speed frozen",
        "engine speed and its time stamp frozen",
        TripReason.STALE,
        failing=partial(FieldsFrozen, "EngineStatus", ("engine_speed", "time")),
    ),
    Case(
        "engine speed stuck",
        "engine speed frozen, its time stamp advances",
        TripReason.NONE,
        failing=partial(FieldsFrozen, "EngineStatus", ("engine_speed",)),
        why="no other sensor measures engine speed; in gear, `limits.speed` and `limits.slip` "
        "of the rear wheel bound it as well",
    ),
    Case(
        "throttle stuck",
        "throttle position frozen, its time stamp advances",
        TripReason.NONE,
        failing=partial(FieldsFrozen, "ThrottleStatus", ("position",)),
        why="no decision uses it: the gate checks the command and what the devices grant",
    ),
    Case(
        "optical frozen",
        "optical speed and its time stamp frozen",
        TripReason.FAULTY,
        failing=partial(FieldsFrozen, "OpticalSpeed", ("speed", "time")),
    ),
    Case(
        "optical stuck",
        "optical speed frozen, its time stamp advances",
        TripReason.NONE,
        failing=partial(FieldsFrozen, "OpticalSpeed", ("speed",)),
        why="detected when the speed of the motorcycle has changed by `limits.front_slip` or "
        "`limits.slip`; here it is almost constant",
    ),
    Case(
        "engine speed jumps",
        "engine speed jumps by 3000 rpm",
        TripReason.ENGINE_SPEED,
        failing=partial(FieldReplaced, "EngineStatus", "engine_speed", lambda speed: speed + 314.0),
    ),
    Case(
        "gear jumps",
        "gear jumps to neutral",
        TripReason.GEAR,
        failing=partial(FieldReplaced, "EngineStatus", "gear", lambda _: 0),
    ),
    Case(
        "optical jumps",
        "optical speed jumps by 15 %",
        TripReason.SLIP,
        failing=partial(FieldReplaced, "OpticalSpeed", "speed", lambda speed: 1.15 * speed),
    ),
    Case(
        "optical drops out",
        "optical sensor reports an invalid speed",
        TripReason.STALE,
        failing=partial(FieldReplaced, "OpticalSpeed", "valid", lambda _: False),
    ),
    Case(
        "optical silent",
        "optical sensor silent",
        TripReason.STALE,
        failing=partial(Silent, frozenset({"OpticalSpeed"})),
    ),
    Case(
        "throttle fault",
        "throttle body reports a fault",
        TripReason.THROTTLE_FAULT,
        failing=partial(FieldReplaced, "ThrottleStatus", "faulty", lambda _: True),
    ),
    Case(
        "device clock",
        "the ECU's clock jumps by an hour",
        TripReason.NONE,
        failing=partial(FieldReplaced, "EcuStatus", "time", lambda time: time + 3600.0),
        why="time stamps must advance, not be right; the record has the bench's arrival times",
    ),
    Case(
        "second vehicle",
        "a second vehicle is switched on, in the same state",
        TripReason.TWO_SENDERS,
        failing=lambda: second_vehicle,
    ),
    *(
        Case(
            f"{wheel} tooth {words}",
            f"{wheel} encoder: a tooth {words}",
            reason,
            teeth=partial(_encoder, wheel, missing),
            why="counted from the first wrong tooth, at most 38 ms after the fault",
        )
        for wheel, reason in (("rear", TripReason.SLIP), ("front", TripReason.FRONT_WHEEL))
        for words, missing in (("missing", True), ("doubled", False))
    ),
    Case(
        "wheel lock",
        "rear wheel stops within 0.1 s",
        TripReason.SLIP,
        teeth=lambda: {"rear": Slowing(10.0)},
    ),
    Case(
        "front lock",
        "front wheel stops within 0.1 s",
        TripReason.FRONT_WHEEL,
        teeth=lambda: {"front": Slowing(10.0)},
    ),
    Case(
        "wheelie",
        "wheelie: the front wheel loses 30 % of its speed a second",
        TripReason.FRONT_WHEEL,
        teeth=lambda: {"front": Slowing(0.3)},
        within=0.36,
        why="a wheel in the air keeps turning; it cannot be told from a rolling wheel until it is "
        "`limits.front_slip` (10 %) slower, which takes 0.33 s here; below that limit, tyre "
        "growth with speed (4 %) and a misplaced tooth (4 %) look the same; a trial may set a "
        "lower limit",
    ),
    Case(
        "vehicle killed",
        "kill -9 or SIGSTOP of the vehicle",
        TripReason.STALE,
        failing=Silent,
        vcan="test_faults.py::test_a_vehicle_that_is_killed_or_stopped_is_not_commanded_any_more",
    ),
)

BENCH = (
    Case(
        "loop killed",
        "kill -9 of the loop",
        TripReason.NONE,
        bench=ending.killed_loop,
        message="the loop's process died (signal 9)",
        vcan="test_killed_bench.py::test_the_devices_take_authority_back_within_their_time",
    ),
    Case(
        "loop stopped",
        "SIGSTOP of the loop for 0.1 s",
        TripReason.TIMING,
        bench=ending.stopped_loop,
        vcan="test_faults.py::test_a_loop_that_is_stopped_loses_authority_and_does_not_take_it_again",
    ),
    Case(
        "recorder killed",
        "kill -9 of the recorder",
        TripReason.RECORDER,
        bench=ending.dead_recorder,
        why="on real processes and a loaded machine see below: killed recorder under load",
        vcan="test_faults.py::test_a_recorder_that_is_killed_ends_the_trial",
    ),
    Case(
        "ring full",
        "SIGSTOP of the recorder until the ring is full",
        TripReason.RECORDER,
        bench=ending.recorder_that_does_not_read,
        within=0.035,
        why="detected when the ring is full: 64 slots here, 12 s of frames in real time",
        vcan="test_faults.py::test_a_recorder_that_is_stopped_for_a_while_loses_nothing",
    ),
    Case(
        "disk full",
        "disk full",
        TripReason.RECORDER,
        bench=ending.full_disk,
        vcan="test_faults.py::test_a_recorder_whose_writes_are_refused_ends_the_trial_and_keeps_what_it_wrote",
    ),
)

CASES = (*BUS, *DEVICES, *BENCH)
