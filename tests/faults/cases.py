"""Everything that is made to go wrong, one case a row of docs/fault_matrix.md."""

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
    OneToothOfATurn,
    Silent,
    Slowing,
    Standing,
    Teeth,
    Tells,
    second_vehicle,
)
from tests.faults.ride import Case

SEEN = frozenset({"gateway"})
TOLD = frozenset({"motorcycle"})
TO_US, TO_IT = Where(AT, receivers=SEEN), Where(AT, receivers=TOLD)
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
        bus=(Lost(0.01, Where(receivers=SEEN)),),
        why="the next one comes within `limits.stale`",
        vcan="test_sockets.py::test_a_listener_that_does_not_read_loses_the_newest_and_is_not_told",
    ),
    Case("lost to us", "all frames to the bench lost", TripReason.STALE, bus=(Lost(1.0, TO_US),)),
    Case(
        "lost to it",
        "all frames to the motorcycle lost",
        TripReason.AUTHORITY_LOST,
        bus=(Lost(1.0, TO_IT),),
    ),
    Case(
        "corrupted some",
        "1 % of the frames to the bench corrupted",
        TripReason.NONE,
        bus=(Corrupted(0.01, Where(receivers=SEEN)),),
        why="`limits.faults` in a row trip",
    ),
    Case(
        "corrupted to us",
        "all frames to the bench corrupted",
        TripReason.FAULTY,
        bus=(Corrupted(1.0, TO_US),),
    ),
    Case(
        "corrupted to it",
        "all frames to the motorcycle corrupted",
        TripReason.AUTHORITY_LOST,
        bus=(Corrupted(1.0, TO_IT),),
    ),
    Case(
        "duplicated to us",
        "all frames to the bench come twice",
        TripReason.TWO_SENDERS,
        bus=(Duplicated(1.0, TO_US),),
        why="a repetition is left out by its counter, and now and then is no fault; so many may "
        "be a second vehicle",
    ),
    Case(
        "duplicated to it",
        "all frames to the motorcycle come twice",
        TripReason.NONE,
        bus=(Duplicated(1.0, TO_IT),),
        why="the devices leave out repetitions",
    ),
    Case(
        "reordered some",
        "5 % of the frames to the bench overtaken by the next",
        TripReason.NONE,
        bus=(Reordered(0.05, where=Where(receivers=SEEN)),),
        why="what comes late is older by one frame",
    ),
    Case(
        "delayed a little",
        "all frames to the bench 5 ms late",
        TripReason.NONE,
        bus=(Delayed(1.0, 0.005, where=TO_US),),
        why="less than `limits.stale`; a steady delay shows only when it begins",
    ),
    Case(
        "delayed",
        "all frames to the bench 30 ms late",
        TripReason.STALE,
        bus=(Delayed(1.0, 0.030, where=TO_US),),
    ),
    Case(
        "repeated to us",
        "all frames to the bench repeat the last one",
        TripReason.FAULTY,
        bus=(Frozen(TO_US),),
    ),
    Case(
        "repeated to it",
        "all frames to the motorcycle repeat the last one",
        TripReason.AUTHORITY_LOST,
        bus=(Frozen(TO_IT),),
    ),
    Case(
        "bench off the bus",
        "bus-off of the bench",
        TripReason.BUS_OFF,
        bus=(Disturbed(1.0, Where(AT, senders=SEEN)),),
        vcan="test_sockets.py::test_an_error_frame_of_the_kernel_tells_that_the_controller_is_off",
    ),
    Case(
        "motorcycle off the bus",
        "bus-off of the motorcycle",
        TripReason.STALE,
        bus=(Disturbed(1.0, Where(AT, senders=TOLD)),),
        within=0.0245,
        why="CAN's own rule: 32 attempts, 3 ms, until its controller is off the bus; from then "
        "on it hears no command, and 20 ms of silence count",
    ),
)

DEVICES = (
    *(
        Case(
            f"counter of {name}",
            f"counter of {name} stands, values live",
            TripReason.STALE if name == "EngineStatus" else TripReason.FAULTY,
            failing=partial(Standing, name),
        )
        for name in ("EcuStatus", "ThrottleStatus", "EngineStatus", "OpticalSpeed")
    ),
    Case(
        "counter of RiderControls",
        "counter of RiderControls stands, values live",
        TripReason.STALE,
        failing=partial(Standing, "RiderControls"),
    ),
    # Its age and its faulty frames pass their limits within a tick; the age comes first.
    Case(
        "engine speed frozen",
        "engine speed and its stamp frozen",
        TripReason.STALE,
        failing=partial(Standing, "EngineStatus", ("engine_speed", "time")),
    ),
    Case(
        "engine speed stuck",
        "engine speed frozen, its stamp runs",
        TripReason.NONE,
        failing=partial(Standing, "EngineStatus", ("engine_speed",)),
        why="no other sensor tells engine speed; in gear, `limits.speed` and `limits.slip` of "
        "the rear wheel bound it as well",
    ),
    Case(
        "throttle stuck",
        "throttle position frozen, its stamp runs",
        TripReason.NONE,
        failing=partial(Standing, "ThrottleStatus", ("position",)),
        why="no decision rests on it: the command is judged, and what the devices grant",
    ),
    Case(
        "optical frozen",
        "optical speed and its stamp frozen",
        TripReason.FAULTY,
        failing=partial(Standing, "OpticalSpeed", ("speed", "time")),
    ),
    Case(
        "optical stuck",
        "optical speed frozen, its stamp runs",
        TripReason.NONE,
        failing=partial(Standing, "OpticalSpeed", ("speed",)),
        why="found when the motorcycle's speed has changed by `limits.front_slip` or "
        "`limits.slip`; here it hardly changes",
    ),
    Case(
        "engine speed jumps",
        "engine speed jumps by 3000 rpm",
        TripReason.ENGINE_SPEED,
        failing=partial(Tells, "EngineStatus", "engine_speed", lambda speed: speed + 314.0),
    ),
    Case(
        "gear jumps",
        "gear jumps to neutral",
        TripReason.GEAR,
        failing=partial(Tells, "EngineStatus", "gear", lambda _: 0),
    ),
    Case(
        "optical jumps",
        "optical speed jumps by 15 %",
        TripReason.SLIP,
        failing=partial(Tells, "OpticalSpeed", "speed", lambda speed: 1.15 * speed),
    ),
    Case(
        "optical drops out",
        "optical sensor sees nothing",
        TripReason.STALE,
        failing=partial(Tells, "OpticalSpeed", "valid", lambda _: False),
    ),
    Case(
        "optical silent",
        "optical sensor says nothing",
        TripReason.STALE,
        failing=partial(Silent, frozenset({"OpticalSpeed"})),
    ),
    Case(
        "throttle fault",
        "throttle body reports a fault",
        TripReason.THROTTLE_FAULT,
        failing=partial(Tells, "ThrottleStatus", "faulty", lambda _: True),
    ),
    Case(
        "device clock",
        "the ECU's clock jumps by an hour",
        TripReason.NONE,
        failing=partial(Tells, "EcuStatus", "time", lambda time: time + 3600.0),
        why="stamps must move, not be right; the record's arrival times are the bench's own",
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
            why="counted from the first turn that shows it, at most 38 ms after it broke",
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
        why="a wheel in the air turns on: nothing that is measured differs from a wheel that "
        "rolls until it is `limits.front_slip` (10 %) slow, which takes 0.33 s here; growth "
        "with speed (4 %) and a misplaced tooth (4 %) look the same below that; a trial may "
        "set it lower",
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
        told="the loop's process died (signal 9)",
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
        vcan="test_faults.py::test_a_recorder_that_is_killed_ends_the_trial",
    ),
    Case(
        "ring full",
        "SIGSTOP of the recorder until the ring is full",
        TripReason.RECORDER,
        bench=ending.recorder_that_does_not_read,
        within=0.035,
        why="noticed when the ring is full: 64 slots here, 12 s of frames in real time",
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
