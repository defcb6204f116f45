"""Laws: a database that would decode to wrong values is refused, a sloppy one is read."""

import hashlib

import pytest

from slipbench.dbc import MOTORBIKE, MOTORBIKE_FD
from slipbench.protocol.configuration import read_toml
from slipbench.protocol.database.database import load_database
from slipbench.protocol.errors import InputError
from slipbench.protocol.recording.role_map import RoleMap
from tests.recordings import recording

ROLES = MOTORBIKE.with_name("motorbike_roles.toml")

REFUSED = {
    "overlap": (
        'BO_ 5 M: 8 A\n SG_ one : 0|9@1+ (1,0) [0|0] "" A\n SG_ two : 8|4@1+ (1,0) [0|0] "" A\n',
        ["message M", "one", "two", "overlap", "bit 8"],
    ),
    "overlap across byte orders": (
        'BO_ 5 M: 8 A\n SG_ one : 7|16@0+ (1,0) [0|0] "" A\n SG_ two : 8|4@1+ (1,0) [0|0] "" A\n',
        ["message M", "one", "two", "overlap"],
    ),
    "overlap under one multiplexer value": (
        'BO_ 5 M: 8 A\n SG_ mux M : 0|4@1+ (1,0) [0|0] "" A\n'
        ' SG_ one m1 : 8|9@1+ (1,0) [0|0] "" A\n SG_ two m1 : 16|4@1+ (1,0) [0|0] "" A\n',
        ["message M", "one", "two", "overlap"],
    ),
    "outside": (
        'BO_ 5 M: 2 A\n SG_ one : 8|9@1+ (1,0) [0|0] "" A\n',
        ["message M", "signal one", "17", "16"],
    ),
    "big-endian outside": (
        'BO_ 5 M: 2 A\n SG_ one : 8|2@0+ (1,0) [0|0] "" A\n',
        ["message M", "signal one", "17", "16"],
    ),
    "message longer than a frame": (
        'BO_ 5 M: 65 A\n SG_ one : 0|8@1+ (1,0) [0|0] "" A\n',
        ["message M", "65 bytes"],
    ),
    "message of a length that FD does not have": (
        'BO_ 5 M: 9 A\n SG_ one : 0|8@1+ (1,0) [0|0] "" A\n',
        ["message M", "9 bytes"],
    ),
    "signal without bits": (
        'BO_ 5 M: 8 A\n SG_ one : 0|0@1+ (1,0) [0|0] "" A\n',
        ["one", "M", "0"],
    ),
    "signal wider than 64 bits": (
        'BO_ 5 M: 16 A\n SG_ one : 0|65@1+ (1,0) [0|0] "" A\n',
        ["message M", "signal one", "65 bits"],
    ),
    "float of 20 bits": (
        'BO_ 5 M: 8 A\n SG_ one : 0|20@1- (1,0) [0|0] "" A\nSIG_VALTYPE_ 5 one : 1;\n',
        ["message M", "signal one", "20 bits", "32"],
    ),
    "two messages under one identifier": (
        'BO_ 5 M: 8 A\n SG_ one : 0|8@1+ (1,0) [0|0] "" A\n\n'
        'BO_ 5 N: 8 A\n SG_ two : 0|8@1+ (1,0) [0|0] "" A\n',
        ["M", "N", "0x5"],
    ),
    "identifier of 12 bits": (
        'BO_ 2048 M: 8 A\n SG_ one : 0|8@1+ (1,0) [0|0] "" A\n',
        ["M", "0x800"],
    ),
    "two signals of one name": (
        'BO_ 5 M: 8 A\n SG_ one : 0|8@1+ (1,0) [0|0] "" A\n SG_ one : 8|8@1+ (1,0) [0|0] "" A\n',
        ["message M", "same name"],
    ),
    "scale 0": (
        'BO_ 5 M: 8 A\n SG_ one : 0|8@1+ (0,0) [0|0] "" A\n',
        ["message M", "signal one", "scale 0"],
    ),
    "text": ("this is a letter, not a database\n", ["usable DBC", "line 1"]),
    "broken off in a signal": (
        'BO_ 5 M: 8 A\n SG_ one : 0|8@1+ (1,0) [0|1] "" A\n\nBO_ 6 N: 8 A\n SG_ two : 0|8@1+ (1,0',
        ["usable DBC", "message N", "0 of 1 signals", "line 4"],
    ),
    "broken off in a statement": (
        'BO_ 5 M: 8 A\n SG_ one : 0|32@1+ (1,0) [0|1] "" A\n\nSIG_VALTYPE_ 5 one : 1',
        ["usable DBC", "SIG_VALTYPE_", "breaks off"],
    ),
    "broken off in a comment": (
        'BO_ 5 M: 8 A\n SG_ one : 0|8@1+ (1,0) [0|1] "" A\n\nCM_ SG_ 5 one "this is',
        ["usable DBC"],
    ),
    "nothing": ("", ["usable DBC"]),
}


@pytest.mark.parametrize("what", REFUSED)
def test_a_contradictory_database_is_refused_by_file_message_and_signal(what, tmp_path):
    text, named = REFUSED[what]
    path = tmp_path / "bad.dbc"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError) as refusal:
        load_database(path)
    told = str(refusal.value)
    assert str(path) in told
    assert "remedy" in told
    for word in named:
        assert word in told


@pytest.mark.parametrize("content", [bytes(range(256)) * 4, b"\x00" * 100, b"\xff\xfe" * 50])
def test_what_is_no_text_is_refused_too(content, tmp_path):
    path = tmp_path / "noise.dbc"
    path.write_bytes(content)
    with pytest.raises(InputError, match=r"noise\.dbc"):
        load_database(path)


def test_a_missing_file_or_a_folder_is_refused_by_its_path(tmp_path):
    for path in (tmp_path, tmp_path / "none.dbc"):
        with pytest.raises(InputError, match=str(path)):
            load_database(path)


def test_every_fault_is_told_at_once(tmp_path):
    path = tmp_path / "bad.dbc"
    path.write_text(
        'BO_ 5 M: 1 A\n SG_ one : 0|9@1+ (1,0) [0|0] "" A\n\n'
        'BO_ 6 N: 1 A\n SG_ two : 0|10@1+ (1,0) [0|0] "" A\n',
        encoding="utf-8",
    )
    with pytest.raises(InputError, match=r"signal one.*signal two"):
        load_database(path)


SLOPPY = {
    "cp1252": 'BO_ 5 M: 8 A\n SG_ t : 0|8@1+ (1,0) [0|0] "\xb0C" A\n'.encode("cp1252"),
    "utf-8": 'BO_ 5 M: 8 A\n SG_ t : 0|8@1+ (1,0) [0|0] "°C" A\n'.encode(),
    "byte order mark": '\ufeffBO_ 5 M: 8 A\n SG_ t : 0|8@1+ (1,0) [0|0] "°C" A\n'.encode(),
    "line ends of Windows": 'BO_ 5 M: 8 A\r\n SG_ t : 0|8@1+ (1,0) [0|0] "°C" A\r\n'.encode(),
    "no FD mark": 'BO_ 5 M: 16 A\n SG_ t : 64|8@1+ (1,0) [0|0] "°C" A\n'.encode(),
    "signals of no message": (
        'BO_ 5 M: 8 A\n SG_ t : 0|8@1+ (1,0) [0|0] "°C" A\n\n'
        "BO_ 3221225472 VECTOR__INDEPENDENT_SIG_MSG: 0 Vector__XXX\n"
        ' SG_ lost : 0|8@1+ (1,0) [0|0] "" Vector__XXX\n'
    ).encode(),
}


@pytest.mark.parametrize("what", SLOPPY)
def test_a_sloppy_database_is_read(what, tmp_path):
    path = tmp_path / "sloppy.dbc"
    path.write_bytes(SLOPPY[what])
    database = load_database(path)
    assert [message.name for message in database.messages] == ["M"]
    signal = database.message("M").signal("t")
    assert signal.unit == "°C"
    assert (signal.minimum, signal.maximum) == (None, None)
    assert database.message("M").cycle_time is None
    assert database.sha256 == hashlib.sha256(SLOPPY[what]).hexdigest()


def test_signals_of_different_multiplexer_values_may_share_bits(tmp_path):
    path = tmp_path / "mux.dbc"
    path.write_text(
        'BO_ 5 M: 8 A\n SG_ mux M : 0|4@1+ (1,0) [0|0] "" A\n'
        ' SG_ one m1 : 8|9@1+ (1,0) [0|0] "" A\n SG_ two m2 : 16|4@1+ (1,0) [0|0] "" A\n',
        encoding="utf-8",
    )
    message = load_database(path).message("M")
    assert message.signal("mux").is_multiplexer
    assert message.signal("two").multiplexer == "mux"
    assert message.signal("two").multiplexer_ids == (2,)


@pytest.mark.parametrize(
    ("name", "messages"),
    [
        ("gt86_gt350/ford_lincoln_base_pt.dbc", 331),
        ("subaru_wrx/sample_can_spec.dbc", 8),
        ("yamaha_r1/session.dbc", 6),
        ("comma2k19/segment.dbc", 2),
    ],
)
def test_databases_of_real_vehicles_are_read(name, messages):
    assert len(load_database(recording(name)).messages) == messages


@pytest.mark.parametrize("path", [MOTORBIKE, MOTORBIKE_FD], ids=lambda path: path.stem)
def test_our_database_says_everything_of_every_signal(path):
    database = load_database(path)
    assert set(database.nodes) == {
        "Gateway",
        "ECU",
        "Throttle",
        "RearEncoder",
        "FrontEncoder",
        "Optical",
        "RiderControls",
    }
    without_unit = {
        "crc",
        "counter",
        "authority",
        "layout",
        "tooth_count",
        "tick",
        "gear",
        "teeth_per_turn",
        "phase",
        "trip",
        "button",
        "faulty",
        "valid",
    }
    for message in database.messages:
        assert message.comment
        assert message.cycle_time > 0
        assert set(message.senders) <= set(database.nodes)
        assert len(message.senders) == 1
        for signal in message.signals:
            assert signal.comment
            assert signal.receivers
            assert set(signal.receivers) <= set(database.nodes) - set(message.senders)
            assert signal.start_value is not None
            assert signal.minimum < signal.maximum
            assert bool(signal.unit) != (signal.name in without_unit)
            low, high = (raw * signal.scale + signal.offset for raw in signal.raw_range)
            assert low <= signal.minimum
            assert signal.maximum <= high
            start = signal.start_value * signal.scale + signal.offset
            assert signal.minimum <= start <= signal.maximum


def test_our_roles_name_signals_that_exist():
    for path in (MOTORBIKE, MOTORBIKE_FD):
        database = load_database(path)
        for source in read_toml(ROLES, RoleMap).roles.values():
            for name in (*source.signals, *filter(None, [source.time_signal])):
                message, signal = name.split(".")
                assert database.message(message).signal(signal)
            for name in filter(None, (source.teeth, source.anchor)):
                assert database.message(name)
            assert (source.clock == "bus") == (not source.time_signal and not source.teeth)
