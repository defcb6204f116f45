"""Laws of XCP on the bus of a test: values, times, errors; our slave is judged by pyxcp as well."""

import math
import struct
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import can
import numpy as np
import pytest

from slipbench.bench.testing.plugin import OPTIONS
from slipbench.bench.testing.setup import Choice, Setup
from slipbench.bench.testing.xcp.a2l import read_a2l
from slipbench.bench.testing.xcp.session import XcpSession
from slipbench.protocol.errors import InputError
from slipbench.protocol.tables import read_table
from tests.bench.testing.xcp_slave import ANSWER, COMMAND, EVENT_CHANNEL, XcpSlave

OPTIONS_OF = {name: default for name, default, _ in OPTIONS}
A2L = """
ASAP2_VERSION 1 60
/begin PROJECT ecu "comment with /begin MEASUREMENT inside // and /* this"
  /begin MODULE m ""
    /begin MOD_COMMON "" BYTE_ORDER {order} /end MOD_COMMON
    /* /begin MEASUREMENT commented out */
    /begin IF_DATA XCP
      /begin XCP_ON_CAN 0x0100 CAN_ID_MASTER 0x7E0 CAN_ID_SLAVE 0x7E8 BAUDRATE 1000000
      /end XCP_ON_CAN
    /end IF_DATA
    /begin COMPU_METHOD rpm "engine speed" RAT_FUNC "%8.1" "rpm"
      COEFFS 0 4 0 0 0 1
    /end COMPU_METHOD
    /begin COMPU_METHOD celsius "" LINEAR "%4.1" "degC"
      COEFFS_LINEAR 0.5 -40
    /end COMPU_METHOD
    /begin COMPU_METHOD odd "" RAT_FUNC "%4.1" "" COEFFS 0 1 0 0 1 0 /end COMPU_METHOD
    /begin MEASUREMENT speed "crank speed" UWORD rpm 0 0 0 16383 ECU_ADDRESS 0x20001000
    /end MEASUREMENT
    /begin MEASUREMENT oil "oil temperature" SBYTE celsius 0 0 -100 200
      ECU_ADDRESS 0x20001002 ECU_ADDRESS_EXTENSION 0x1
    /end MEASUREMENT
    /begin MEASUREMENT torque "" FLOAT32_IEEE NO_COMPU_METHOD 0 0 -1000 1000
      PHYS_UNIT "N m" ECU_ADDRESS 0x20001004
    /end MEASUREMENT
    /begin MEASUREMENT gear "" UBYTE NO_COMPU_METHOD 0 0 0 7 BIT_MASK 0x70 ECU_ADDRESS 0x20001003
    /end MEASUREMENT
    /begin MEASUREMENT wide "" FLOAT64_IEEE NO_COMPU_METHOD 0 0 0 1 ECU_ADDRESS 0x20001008
    /end MEASUREMENT
    /begin MEASUREMENT nowhere "" UBYTE NO_COMPU_METHOD 0 0 0 1 ECU_ADDRESS 0x666 /end MEASUREMENT
    /begin MEASUREMENT virtual "" UBYTE NO_COMPU_METHOD 0 0 0 1 /end MEASUREMENT
  /end MODULE
/end PROJECT
"""


def rpm(now: float) -> float:
    return 8000 + 2000 * math.sin(20 * now)


def memory_of(now: Callable[[], float], order: str) -> Callable[[int, int], bytes | None]:
    """Memory of the ECU: speed, oil, gear, torque; nothing else can be read."""

    def memory(address: int, size: int) -> bytes | None:
        raw = round(4 * rpm(now()))
        whole = struct.pack(f"{order}HbBf", raw, 100, 0x35, 123.5)
        first = address - 0x20001000
        return whole[first : first + size] if 0 <= first <= len(whole) - size else None

    return memory


@pytest.fixture
def a2l(tmp_path: Path) -> Path:
    path = tmp_path / "ecu.a2l"
    path.write_text(A2L.format(order="MSB_LAST"), encoding="utf-8")
    return path


@pytest.fixture
def bench(tmp_path: Path) -> Iterator[Setup]:
    made = Setup(Choice.of(OPTIONS_OF), tmp_path, "test")
    yield made
    made.close()


def add_slave(bench: Setup, order: str = "<", **options) -> XcpSlave:
    memory = memory_of(lambda: bench.bus.now, order)
    slave = XcpSlave(bench.bus.node("ecu"), memory, order, **options)
    bench.bus.every("1 ms", slave.tick)
    return slave


@pytest.mark.parametrize(("keyword", "order"), [("MSB_LAST", "<"), ("MSB_FIRST", ">")])
def test_values_are_read_by_name_in_their_units(
    bench: Setup, tmp_path: Path, keyword: str, order: str
) -> None:
    path = tmp_path / "ecu.a2l"
    path.write_text(A2L.format(order=keyword), encoding="utf-8")
    add_slave(bench, order)
    session = bench.xcp.connect(path)
    assert session.read("speed") == pytest.approx(rpm(bench.bus.now), abs=60)
    assert session.read("oil") == 10.0
    assert session.read("torque") == 123.5
    assert session.read("gear") == 3
    assert session.measurement("speed").unit == "rpm"
    assert session.measurement("torque").unit == "N m"
    assert session.measurement("oil").extension == 1
    session.disconnect()


def check_samples(bench: Setup, session: XcpSession, period: float, late: float) -> None:
    times, values = session.trace("speed")
    assert np.diff(times) == pytest.approx(period, abs=2e-3)
    assert values == pytest.approx([rpm(at) for at in times - late], abs=2000 * 20 * 1.1e-3 + 1)
    assert set(session.trace("torque")[1]) == {123.5}
    assert set(session.trace("oil")[1]) == {10.0}
    assert bench.problems() == []


def test_polled_values_have_the_times_of_their_responses(bench: Setup, a2l: Path) -> None:
    add_slave(bench)
    session = bench.xcp.connect(a2l)
    session.poll(["speed", "torque", "oil"], "20 ms")
    bench.bus.run("1 s")
    assert session.trace("speed")[0].size == pytest.approx(50, abs=2)
    check_samples(bench, session, 0.020, 0.0)


def test_daq_lists_bring_values_at_the_events_of_the_ecu(bench: Setup, a2l: Path) -> None:
    add_slave(bench)
    session = bench.xcp.connect(a2l)
    session.daq(["torque", "speed", "oil", "gear"], EVENT_CHANNEL)  # 4 + 2 + 1 and 1 byte
    bench.bus.run("1 s")
    assert session.trace("speed")[0].size == pytest.approx(100, abs=2)
    check_samples(bench, session, 0.010, 0.0)
    assert set(session.trace("gear")[1]) == {3.0}
    session.disconnect()
    number = session.trace("speed")[0].size
    bench.bus.run("100 ms")
    assert session.trace("speed")[0].size == number


def test_samples_are_in_the_recording_beside_the_frames(
    bench: Setup, a2l: Path, tmp_path: Path
) -> None:
    bench.vehicle  # noqa: B018
    add_slave(bench)
    session = bench.xcp.connect(a2l)
    session.daq(["torque", "speed"], EVENT_CHANNEL)
    bench.bus.run("500 ms")
    folder = bench.recording.save()
    table = read_table(folder / "tables" / "xcp.csv")
    assert table.units["speed"] == "rpm"
    assert np.allclose(table.data["speed"].to_numpy(), session.trace("speed")[1])
    recording = bench.recording.read()
    assert recording.description["tables"] == {"xcp": "tables/xcp.csv"}
    assert recording.channels["engine_speed"].value.size > 50


def test_the_same_run_gives_the_same_samples(tmp_path: Path, a2l: Path) -> None:
    def table() -> str:
        bench = Setup(Choice.of(OPTIONS_OF), tmp_path, "test")
        add_slave(bench)
        bench.xcp.connect(a2l).poll(["speed", "oil"], "10 ms")
        bench.bus.run("300 ms")
        bench.close()
        return bench.xcp.table()

    first = table()
    assert len(first.splitlines()) > 50
    assert first == table()


# Errors


def test_an_ecu_that_does_not_answer_is_named_with_its_identifier(bench: Setup, a2l: Path) -> None:
    with pytest.raises(InputError, match=r"does not answer: CONNECT(.|\n)*0x7e8 within 100 ms"):
        bench.xcp.connect(a2l)


@pytest.mark.parametrize(
    ("act", "said"),
    [
        (lambda s: s.read("sped"), "did you mean speed"),
        (lambda s: s.read("wide"), "does not fit into one packet"),
        (lambda s: s.read("virtual"), "no measurement 'virtual'"),
        (
            lambda s: s.read("nowhere"),
            "SHORT_UPLOAD of nowhere(.|\n)*access to the memory is denied",
        ),
        (lambda s: s.daq(["speed"], 7), "event channel 7(.|\n)*out of range"),
        (lambda s: s.daq(["speed"] * 9, EVENT_CHANNEL), "ALLOC_ODT_ENTRY(.|\n)*too many"),
    ],
)
def test_what_the_ecu_or_the_file_refuses_is_named(bench: Setup, a2l: Path, act, said) -> None:
    add_slave(bench, most_entries=8)
    session = bench.xcp.connect(a2l)
    with pytest.raises(InputError, match=said):
        act(session)


def test_measurements_that_end_or_never_begin_fail_the_test(bench: Setup, a2l: Path) -> None:
    slave = add_slave(bench)
    session = bench.xcp.connect(a2l)
    session.poll(["speed"], "10 ms")
    bench.bus.run("100 ms")
    assert bench.problems() == []
    slave.silent = True
    bench.bus.run("300 ms")
    assert any("no response to SHORT_UPLOAD of speed" in each for each in bench.problems())


def test_a_refused_poll_fails_the_test(bench: Setup, a2l: Path) -> None:
    add_slave(bench)
    bench.xcp.connect(a2l).poll(["nowhere"], "10 ms")
    bench.bus.run("100 ms")
    assert any("access to the memory is denied" in each for each in bench.problems())
    assert any("no sample of nowhere" in each for each in bench.problems())


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("/end PROJECT", "", "no whole A2L file"),
        ("/end MODULE", "/end PROJECT", "no whole A2L file"),
        ("UWORD", "UFOO", "unknown type"),
        ("BYTE_ORDER MSB_LAST", "BYTE_ORDER BIG_ENDIAN", "the byte order is not certain"),
        ("SBYTE celsius", "SBYTE odd", "the conversion is not linear"),
        ("SBYTE celsius", "SBYTE kelvin", "the conversion is not in the file"),
        ("0x20001000", "0x2000G000", "damaged"),
        ("0x20001000", "-1", "damaged"),
        ("BIT_MASK 0x70", "BIT_MASK 0", "damaged"),
        ("COEFFS 0 4 0 0 0 1", "COEFFS 0 4", "damaged"),
        ("ECU_ADDRESS ", "ADDRESS ", "no measurement with an address"),
        ("CAN_ID_MASTER", "CAN_ID", "does not state the CAN identifiers"),
    ],
)
def test_a_file_that_cannot_be_used_is_named(
    bench: Setup, a2l: Path, old: str, new: str, said: str
) -> None:
    text = a2l.read_text(encoding="utf-8")
    assert old in text
    a2l.write_text(text.replace(old, new), encoding="utf-8")
    with pytest.raises(InputError, match=said):
        bench.xcp.connect(a2l)


@pytest.mark.parametrize(
    "text",
    ["", "/*" * 200_000, "/begin A " * 100_000, '"' * 99_999, "/begin A /end A " * 50_000, "\0"],
    ids=["empty", "comments", "nested", "quotes", "blocks", "NUL"],
)
def test_a_hostile_file_ends_in_a_message(tmp_path: Path, text: str) -> None:
    path = tmp_path / "hostile.a2l"
    path.write_text(text)
    with pytest.raises(InputError):
        read_a2l(path)


def test_pyxcp_reads_the_same_from_the_slave(tmp_path: Path) -> None:
    """The slave is no mirror of our own mistakes: another master agrees with it."""
    pyxcp = pytest.importorskip("pyxcp.master", reason="pip install pyxcp to run this test")
    from pyxcp.config import create_application_from_config

    ended = threading.Event()
    with (
        can.Bus(interface="virtual", channel="xcp") as ours,
        can.Bus(interface="virtual", channel="xcp") as theirs,
    ):
        slave = XcpSlave(ours, memory_of(lambda: 0.0, "<"))

        def serve() -> None:
            while not ended.is_set():
                slave.tick(0, 0)
                time.sleep(1e-3)

        thread = threading.Thread(target=serve)
        thread.start()
        try:
            application = create_application_from_config(
                {"Transport": {"CAN": {"can_id_master": COMMAND, "can_id_slave": ANSWER}}}
            )
            with pyxcp.Master("CAN", application, transport_layer_interface=theirs) as master:
                master.connect()
                assert master.shortUpload(2, 0x20001000) == struct.pack("<H", 32000)
                master.freeDaq()
                master.allocDaq(1)
                master.allocOdt(0, 1)
                master.allocOdtEntry(0, 0, 1)
                master.setDaqPtr(0, 0, 0)
                master.writeDaq(0xFF, 2, 0, 0x20001000)
                master.setDaqListMode(0, 0, EVENT_CHANNEL, 1, 0)
                assert master.startStopDaqList(2, 0).firstPid == 4
                assert slave.tables == [[(0x20001000, 2)]]
                master.disconnect()
        finally:
            ended.set()
            thread.join()
