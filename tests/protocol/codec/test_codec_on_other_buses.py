"""Laws of the codec on a bus that is not the bench's own: what it needs to be told, what it refuses."""

from dataclasses import replace

import pytest

from slipbench.protocol.codec.codec import Codec, Sender
from slipbench.protocol.codec.faults import Fault, FrameFault
from slipbench.protocol.codec.messages import (
    Authority,
    ChassisStatus,
    Intervals,
    Phase,
    RiderControls,
    ToothIntervals,
    TripReason,
    WheelSpeed,
)
from slipbench.protocol.codec.placement import FieldsAt, SignalAt, TeethAt
from slipbench.protocol.database.layout import Checksum, Database, Message, Protection, Signal
from slipbench.protocol.errors import InputError

SPEED = Signal("v", 16, 16, scale=0.01, unit="m/s")
AT_SPEED = {"RearWheelSpeed": {"speed": SignalAt("Wheel", "v", to="m/s")}}
HEADER = (Signal("crc", 0, 8), Signal("cnt", 8, 8))
PAGE = Signal("page", 0, 4, is_multiplexer=True)


def database(*messages: Message) -> Database:
    return Database("made.dbc", "", messages)


def wheel(**changes) -> Codec:
    message = Message("Wheel", 5, 4, (*HEADER, SPEED), cycle_time=0.01)
    return Codec(database(replace(message, **changes)), AT_SPEED)


def test_a_checksum_needs_no_counter():
    codec = wheel(protection=Protection(0, checksum=Checksum("crc", "sum")))
    sender = Sender(codec)
    for speed in (1.0, 2.0, 3.0):
        (frame,) = sender.frames(WheelSpeed(speed), name="RearWheelSpeed")
        assert codec.decode(5, frame.data) == WheelSpeed(speed)
        assert codec.counter(5, frame.data) is None
        assert sender.counters == {"Wheel": 0}


def test_without_protection_nothing_is_counted():
    codec = wheel()
    sender = Sender(codec)
    for _ in range(3):
        sender.frames(WheelSpeed(1.0), name="RearWheelSpeed")
        assert sender.counters == {"Wheel": 0}
    assert codec.counter(5, bytes(4)) is None


@pytest.mark.parametrize(
    ("changes", "sent"),
    [
        ({}, [0, 10, 20]),
        ({"attributes": {"GenMsgSendType": 1}}, list(range(25))),  # an event
        ({"attributes": {"GenMsgSendType": 0}}, [0, 10, 20]),
        ({"cycle_time": None}, list(range(25))),
    ],
)
def test_a_cyclic_message_waits_for_its_cycle_time_and_an_event_does_not(changes, sent):
    sender = Sender(wheel(**changes))
    speed = WheelSpeed(1.0)
    assert sent == [
        tick for tick in range(25) if sender.frames(speed, name="RearWheelSpeed", now=1e-3 * tick)
    ]


def three_pages() -> Codec:
    """Travel in pages 0 and 1, a wheel speed in page 2, rider controls in every page."""
    signals = (
        PAGE,
        Signal("button", 4, 1),
        *(
            replace(SPEED, name=name, multiplexer="page", multiplexer_ids=(page,), unit=unit)
            for page, (name, unit) in enumerate((("f", "mm"), ("r", "mm"), ("v", "m/s")))
        ),
    )
    controls = dict.fromkeys(("grip", "front_brake", "rear_brake", "clutch"), 0.0)
    return Codec(
        database(Message("Wheel", 5, 4, signals, cycle_time=0.01)),
        {
            "ChassisStatus": {
                "front_travel": SignalAt("Wheel", "f"),
                "rear_travel": SignalAt("Wheel", "r"),
            },
            "RiderControls": {"button": SignalAt("Wheel", "button"), **controls},
            **AT_SPEED,
        },
    )


CONTROLS = RiderControls(True, 0.0, 0.0, 0.0, 0.0)


def pages(frames) -> list[int]:
    return [frame.data[0] & 0xF for frame in frames]


def test_the_pages_that_are_whole_are_sent_and_those_of_other_messages_are_not():
    sender = Sender(three_pages())
    assert sender.frames(CONTROLS) == []
    assert pages(sender.frames(WheelSpeed(1.0), name="RearWheelSpeed")) == [2]
    assert pages(sender.frames(CONTROLS)) == [2]
    assert pages(sender.frames(ChassisStatus(0.1, 0.2))) == [0, 1]
    assert pages(sender.frames(CONTROLS)) == [0, 1, 2]


def test_pages_take_turns_in_their_order_at_the_cycle_time():
    sender = Sender(three_pages())
    for message, name in ((CONTROLS, None), (ChassisStatus(0.1, 0.2), None)):
        sender.frames(message, name=name)
    turns = [
        page
        for tick in range(60)
        for page in pages(
            sender.frames(WheelSpeed(1.0), name="RearWheelSpeed", now=1.0 + 1e-3 * tick)
        )
    ]
    assert turns in ([0, 1, 2, 0, 1, 2], [1, 2, 0, 1, 2, 0], [2, 0, 1, 2, 0, 1])


def encoder(unit: str = "us", **changes) -> Codec:
    """Teeth of a bus that has neither our names nor a header."""
    layouts = tuple(
        Signal(f"t{page}", 16, 16, scale=10, unit=unit, multiplexer="kind", multiplexer_ids=(page,))
        for page in map(int, Intervals)
    )
    signals = (
        Signal("kind", 0, 2, is_multiplexer=True, maximum=len(Intervals) - 1),
        Signal("n", 8, 8),
    )
    message = replace(Message("Encoder", 5, 4, (*signals, *layouts)), **changes)
    return Codec(database(message), {"RearTeeth": TeethAt("Encoder", "kind", "n")})


@pytest.mark.parametrize("counter", ["kind", "n"])
def test_no_signal_of_teeth_lies_where_the_protection_writes(counter):
    with pytest.raises(InputError, match=f"Encoder.{counter} is bound to a role"):
        encoder(protection=Protection(0, counter=counter))


def test_intervals_are_times():
    for unit, si in (("ms", 1e-2), ("s", 10.0)):
        assert encoder(unit).capacity("RearTeeth")[Intervals.SHORT] == (
            1,
            pytest.approx(65535 * si),
        )
    with pytest.raises(InputError, match="the unit 'deg' does not suit this role"):
        encoder("deg")


def test_layout_and_count_have_the_slots_of_their_signals():
    (part,) = encoder().parts("RearTeeth")
    for name in ("kind", "n"):
        assert part.slot(name).name == f"made.dbc: Encoder.{name}"


def test_a_count_of_teeth_wraps_whatever_its_signal_is_called():
    codec = encoder()
    assert codec.parts("RearTeeth")[0].modulo == 256
    for layout in Intervals:
        sent = ToothIntervals(layout, 300, (0.005,))
        assert codec.encode(sent, name="RearTeeth")[1][1] == 300 - 256
        got = codec.decode(*codec.encode(sent, name="RearTeeth"))
        assert (got.layout, got.tooth_count) == (layout, 300 - 256)
        assert got.intervals == pytest.approx((0.005,))


def test_an_identifier_of_29_bits_is_another_one_than_the_same_of_11():
    codec = wheel(extended=True, protection=Protection(0, counter="cnt"))
    (frame,) = Sender(codec).frames(WheelSpeed(3.0), name="RearWheelSpeed")
    assert frame.extended is True
    assert codec.decode(5, frame.data, True) == WheelSpeed(3.0)
    assert codec.counter(5, frame.data, True) == 0
    assert codec.name(5, True) == "Wheel"
    assert codec.decode(5, frame.data).fault is Fault.UNKNOWN
    assert codec.counter(5, frame.data) is None
    assert codec.name(5) is None


def test_a_frame_that_holds_a_part_of_a_message_or_another_page_is_no_message():
    messages = (
        Message("Front", 1, 2, (Signal("f", 0, 16, unit="mm"),)),
        Message("Rear", 2, 2, (Signal("r", 0, 16, unit="mm"),)),
        Message("Wheel", 3, 4, (PAGE, replace(SPEED, multiplexer="page", multiplexer_ids=(2,)))),
    )
    chassis: FieldsAt = {
        "front_travel": SignalAt("Front", "f"),
        "rear_travel": SignalAt("Rear", "r"),
    }
    codec = Codec(database(*messages), {"ChassisStatus": chassis, **AT_SPEED})
    first, second = Sender(codec).frames(ChassisStatus(0.1, 0.2))
    expected = ("a whole message of the bench", "a part of one")
    for data, identifier, name in (
        (first.data, 1, "Front"),
        (second.data, 2, "Rear"),
        (bytes(4), 3, "Wheel"),
    ):
        assert codec.decode(identifier, data) == FrameFault(Fault.UNKNOWN, name, "", *expected)
    assert codec.decode(3, b"\2\0\x64\0") == WheelSpeed(1.0)


def test_a_codec_has_what_is_placed_and_requests_authority_where_a_signal_does():
    demand = Message("Demand", 9, 4, (Signal("on", 0, 2), Signal("set", 16, 16, unit="%")))
    throttle: FieldsAt = {"throttle": SignalAt("Demand", "set", to=""), "spark": 0.0, "time": 0.0}
    for authority, requests in ((SignalAt("Demand", "on"), True), (Authority.NONE, False)):
        placed = {"ActuatorCommand": {**throttle, "authority": authority}}
        codec = Codec(database(demand), placed)
        assert codec.has("ActuatorCommand")
        assert not codec.has("TrialStatus")
        assert codec.requests_authority is requests
    assert not wheel().requests_authority


def status_codec(**values: dict[int, int]) -> Codec:
    signals = tuple(
        Signal(name, 8 * at, 8) for at, name in enumerate(("phase", "authority", "trip"))
    )
    at: FieldsAt = {"tick": 0} | {
        signal.name: SignalAt(
            "Status", signal.name, values=values.get(signal.name, EVERY[signal.name])
        )
        for signal in signals
    }
    return Codec(database(Message("Status", 7, 3, signals)), {"TrialStatus": at})


EVERY = {
    "phase": {int(each): int(each) for each in Phase},
    "trip": {int(each): int(each) for each in TripReason},
    "authority": {0: 0, 1: 1, 2: 2, 3: 3},
}


@pytest.mark.parametrize("field", ["phase", "trip"])
def test_what_the_bench_sends_can_show_each_of_its_values(field):
    status_codec()
    few = {raw: value for raw, value in EVERY[field].items() if value not in (1, 2)}
    kind = {"phase": Phase, "trip": TripReason}[field]
    missing = f"{kind(1).name.lower()}, {kind(2).name.lower()}"
    with pytest.raises(InputError, match=rf"{field} cannot show {missing}, which") as refused:
        status_codec(**{field: few})
    assert f"found: {kind(0).name.lower()}, {kind(3).name.lower()}" in str(refused.value)


def test_an_authority_needs_no_more_than_its_end():
    status_codec(authority={3: 0})
    for values in ({1: 1}, {1: 1, 2: 2}):
        with pytest.raises(InputError, match="authority cannot show none, which"):
            status_codec(authority=values)


def paged_request(throttle: Signal, spark: Signal) -> Codec:
    signals = (
        PAGE,
        Signal("inner", 4, 4, is_multiplexer=True, multiplexer="page", multiplexer_ids=(3,)),
        Signal("on", 8, 2),
        throttle,
        spark,
        replace(SPEED, start=48, multiplexer="page", multiplexer_ids=(5,)),
    )
    message = Message("Wheel", 9, 8, signals)
    request: FieldsAt = {
        "authority": SignalAt("Wheel", "on"),
        "throttle": SignalAt("Wheel", throttle.name, to=""),
        "spark": SignalAt("Wheel", spark.name, to="rad"),
        "time": 0.0,
    }
    return Codec(database(message), {"ActuatorCommand": request, **AT_SPEED})


def test_a_request_lies_in_one_page():
    """Else the ECU would join half of an old request with half of a new one."""
    throttle = Signal("t", 16, 16, scale=0.01, unit="%", multiplexer="page", multiplexer_ids=(1, 2))
    spark = Signal("s", 32, 16, scale=0.01, unit="deg", signed=True)
    with pytest.raises(InputError, match="in several pages of the multiplexed message Wheel") as no:
        paged_request(throttle, replace(spark, multiplexer="inner", multiplexer_ids=(4,)))
    with pytest.raises(InputError, match="in several pages of the multiplexed message Wheel"):
        paged_request(throttle, replace(spark, multiplexer="page", multiplexer_ids=(5,)))
    found = "authority (every page); throttle (page = 1); spark (page = 3 and inner = 4)"
    assert f"found: {found}" in str(no.value)


@pytest.mark.parametrize("counter", ["rpm", "ok", "gear", "page"])
def test_no_signal_of_a_message_lies_where_its_protection_writes(counter):
    """Fields, their validity and the multiplexer that selects them."""
    paged = {"multiplexer": "page", "multiplexer_ids": (1,)} if counter == "page" else {}
    signals = (
        Signal("rpm", 0, 16, unit="rpm", **paged),
        Signal("ok", 16, 4, **paged),
        Signal("gear", 24, 4, **paged),
        replace(PAGE, start=32),
    )
    protection = Protection(0, counter=counter)
    message = Message("Engine", 5, 8, signals, protection=protection)
    at: FieldsAt = {
        "engine_speed": SignalAt("Engine", "rpm", to="rad/s", valid="ok"),
        "gear": SignalAt("Engine", "gear"),
        "spark_advance": 0.0,
        "time": 0.0,
    }
    with pytest.raises(InputError, match=f"Engine.{counter} is bound to a role"):
        Codec(database(message), {"EngineStatus": at})


def test_a_field_where_the_protection_writes_is_refused_with_the_database():
    with pytest.raises(InputError, match=r"made\.dbc: Wheel\.v is bound"):
        wheel(protection=Protection(0, counter="v"))
