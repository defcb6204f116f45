"""GVRET CSV of SavvyCAN: every frame as it was logged, every line a frame or an error."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from slipbench.protocol.errors import InputError
from slipbench.protocol.logs import read_log
from tests.hostile.damage import damaged, fuzz, survives
from tests.recordings import recording

HEAD = "Time Stamp,ID,Extended,Bus,LEN,D1,D2,D3,D4,D5,D6,D7,D8\n"
HEAD_2 = "Time Stamp,ID,Extended,Dir,Bus,LEN,D1,D2,D3,D4,D5,D6,D7,D8\n"

frames = st.lists(
    st.tuples(
        st.integers(0, 2**52),
        st.booleans(),
        st.integers(0, 0x1FFFFFFF),
        st.integers(0, 9),
        st.booleans(),
        st.binary(max_size=8) | st.binary(min_size=12, max_size=12),
    ),
    min_size=1,
    max_size=20,
)


def written(frames, direction):
    """Write frames as SavvyCAN does: 8 cells at the least, a comma at the end of each line."""
    yield HEAD_2 if direction else HEAD
    for time, extended, identifier, bus, sent, data in frames:
        identifier &= 0x1FFFFFFF if extended else 0x7FF
        cells = [f"{byte:02X}" for byte in data] + ["00"] * (8 - len(data))
        way = [("Rx", "Tx")[sent]] if direction else []
        head = [str(time), f"{identifier:08X}", str(extended).lower(), *way, str(bus)]
        yield ",".join([*head, str(len(data)), *cells]) + ",\n"


@pytest.mark.parametrize("direction", [False, True])
def test_every_frame_is_read_as_it_was_logged(tmp_path, direction):
    @fuzz
    @given(frames)
    def attempt(frames):
        path = tmp_path / "x.csv"
        path.write_text("".join(written(frames, direction)))
        found = read_log(path).frames
        ordered = sorted(frames, key=lambda frame: frame[0])
        assert found.time_ns.tolist() == [frame[0] * 1000 for frame in ordered]
        for row, (_, extended, identifier, bus, sent, data) in enumerate(ordered):
            assert found.identifier[row] == identifier & (0x1FFFFFFF if extended else 0x7FF)
            assert bool(found.extended[row]) == extended
            assert found.buses[found.bus[row]] == f"can{bus}"
            assert bool(found.sent[row]) == (sent and direction)
            assert bool(found.fd[row]) == (len(data) > 8)
            assert found.data[row, : found.length[row]].tobytes() == data

    attempt()


@pytest.mark.parametrize(
    "line",
    [
        "1000,00000123,false,0,8,01,02\n",  # fewer bytes than its length
        "1000,00000800,false,0,1,01\n",  # a standard identifier of 12 bits
        "1000,20000000,true,0,1,01\n",
        "1000,00000123,false,0,9,1,2,3,4,5,6,7,8,9\n",  # no length of CAN FD
        "99999999999999999999,00000123,false,0,1,01\n",
        "1000,00000123,maybe,0,1,01\n",
        "hello\n",
    ],
)
def test_a_line_that_is_no_frame_is_named(tmp_path, line):
    path = tmp_path / "x.csv"
    path.write_text(HEAD + "1,00000123,false,0,1,01\n" + line + "2,00000123,false,0,1,01\n")
    with pytest.raises(InputError, match="line 3"):
        read_log(path)


def test_a_line_that_breaks_off_is_left_out(tmp_path):
    path = tmp_path / "x.csv"
    path.write_text(HEAD + "1,00000123,false,0,1,01,\n2,00000123,fal")
    reading = read_log(path)
    assert len(reading.frames) == 1
    assert "is incomplete" in reading.warnings[0]
    path.write_text(HEAD + "1,00000123,false,0,1,01,\n2,00000123,false,0,1,02,")
    assert len(read_log(path).frames) == 2


def test_a_damaged_file_is_read_or_refused(tmp_path):
    @fuzz
    @given(damaged((HEAD + "1,00000123,false,0,2,01,02,00,\n" * 8).encode()))
    def attempt(data):
        survives(read_log, tmp_path / "x.csv", data)

    attempt()


def test_savvycan_s_own_sample_is_read_to_the_last_frame():
    path = recording("formats/GVRET_Log.csv")
    reading = read_log(path)
    assert len(reading.frames) == len(path.read_text().splitlines()) - 1
    assert reading.format == "GVRET CSV (SavvyCAN)"
    assert reading.frames.time_ns[0] == 166_064_000_000
    assert reading.frames.identifier[0] == 0x21A
    assert reading.frames.data[0].tobytes() == bytes.fromhex("FE3612FE690507AD")
    assert not reading.warnings
