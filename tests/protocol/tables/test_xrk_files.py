"""Laws: an XRK file gives the channels, times and units that were written; damage is said."""

import zlib

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from slipbench.protocol.errors import InputError
from slipbench.protocol.recording.role_map import TableRules
from slipbench.protocol.tables import is_table, read_table, samples
from tests.protocol.tables.xrk_writer import INTEGER, Channel, message, xrk

pytest.importorskip("libxrk", reason="pip install 'slipbench[logs]'")

ANY = TableRules()
RPM, PERCENT, GRAVITY, DEGREE_C, KMH = 15, 1, 3, 17, 16  # AiM's numbers of units
BEGUN = 1000  # ms
CHANNELS = [
    Channel("Engine RPM", RPM, [(BEGUN + 10 * k, 5000.0 + k) for k in range(50)]),
    Channel("Throttle", PERCENT, [(BEGUN + 20 * k, 2.5 * k) for k in range(25)]),
    Channel("Pedal", PERCENT, [(BEGUN + 20 * k, 3.5 * k) for k in range(25)]),
    Channel("InlineAcc", GRAVITY, [(BEGUN + 5 + 20 * k, 0.01 * k) for k in range(25)]),
    Channel("Water Temp", DEGREE_C, [(BEGUN + 500, 80.0), (BEGUN + 900, 81.0)]),
]
FILE = xrk(CHANNELS)
values = st.floats(-1e6, 1e6, width=32)
courses = st.lists(st.tuples(st.integers(1, 400), values), min_size=1, max_size=20)


def written(tmp_path_factory, content: bytes, ending: str = "xrk"):
    path = tmp_path_factory.mktemp("aim") / f"run.{ending}"
    path.write_bytes(content)
    return path


@given(st.lists(courses, min_size=1, max_size=4), st.booleans())
@settings(max_examples=60, deadline=None)
def test_channels_are_what_was_written(tmp_path_factory, drawn, packed) -> None:
    channels = []
    for number, course in enumerate(drawn):
        times = BEGUN + np.cumsum([step for step, _ in course])
        course_of = [(int(t), v) for t, (_, v) in zip(times, course, strict=True)]
        channels.append(Channel(f"Channel {number}", KMH, course_of))
    first = min(c.samples[0][0] for c in channels)
    content = zlib.compress(xrk(channels)) if packed else xrk(channels)
    table = read_table(written(tmp_path_factory, content, "xrz" if packed else "xrk"))
    assert not table.warnings
    for channel in channels:
        found = samples(table, channel.name, "", ANY)
        assert found.time == pytest.approx([1e-3 * (t - first) for t, _ in channel.samples])
        assert found.value == pytest.approx([np.float32(v) for _, v in channel.samples])
        assert table.units[channel.name] == "km/h"


def test_channels_of_one_time_base_share_its_column_and_units_are_known(tmp_path_factory) -> None:
    path = written(tmp_path_factory, FILE)
    assert is_table(path)
    table = read_table(path)
    assert table.clocks["Throttle"] == table.clocks["Pedal"] != table.clocks["Engine RPM"]
    assert len(set(table.clocks.values())) == 4
    units = {c.name: table.units[c.name] for c in CHANNELS}
    assert list(units.values()) == ["rpm", "%", "%", "standard_gravity", "degC"]
    assert samples(table, "InlineAcc", "", ANY).value[10] == pytest.approx(0.1)
    assert "5 channels" in table.layout[0]


def table_or_sentence(path):
    """The table; None where the file is refused with a sentence that names it."""
    try:
        return read_table(path)
    except InputError as refused:
        said = str(refused)
    assert str(path) in said
    return None


def test_whole_numbers_are_read(tmp_path_factory) -> None:
    course = [(BEGUN + 10 * k, float(k - 3)) for k in range(8)]
    table = read_table(written(tmp_path_factory, xrk([Channel("Count", 11, course, INTEGER)])))
    assert list(samples(table, "Count", "", ANY).value) == [k - 3 for k in range(8)]


@given(st.integers(1, len(FILE) - 1))
@settings(max_examples=80, deadline=None)
def test_a_file_that_breaks_off_is_read_up_to_there(tmp_path_factory, length) -> None:
    path = written(tmp_path_factory, FILE[:length])
    table = table_or_sentence(path)
    if table is None:
        assert length < 1000
        return
    for channel in CHANNELS:
        if channel.name in table.names:
            found = samples(table, channel.name, "", ANY)
            assert list(found.value) == pytest.approx(
                [v for _, v in channel.samples][: len(found.value)]
            )


@given(st.data(), st.binary(min_size=1, max_size=4))
@settings(max_examples=80, deadline=None)
def test_damage_ends_in_a_table_or_a_sentence(tmp_path_factory, data, junk) -> None:
    at = data.draw(st.integers(0, len(FILE) - 5))
    content = FILE[:at] + junk + FILE[at + len(junk) :]
    table = table_or_sentence(written(tmp_path_factory, content))
    assert table is None or table.names


def test_damage_is_said(tmp_path_factory) -> None:
    at = FILE.index(b"(S") + 12 * 20
    content = FILE[:at] + b"\xff" * 30 + FILE[at + 30 :]
    table = read_table(written(tmp_path_factory, content))
    (warning,) = table.warnings
    assert "damaged or broken off" in warning
    assert len(samples(table, "Engine RPM", "", ANY).value) < 50


def test_a_packed_file_that_breaks_off_is_said(tmp_path_factory) -> None:
    packed = zlib.compress(FILE)
    table = read_table(written(tmp_path_factory, packed[: len(packed) * 3 // 4], "xrz"))
    assert "broken off" in table.warnings[0]
    assert len(samples(table, "Engine RPM", "", ANY).value) < 50


@pytest.mark.parametrize(
    "content",
    [message("CNF", b""), message("CNF", b"x" * 40), zlib.compress(b"no log" * 9), FILE[:40]],
    ids=["no channel", "no message in the configuration", "packed text", "broken off"],
)
def test_what_holds_no_channel_is_said(tmp_path_factory, content) -> None:
    path = written(tmp_path_factory, content)
    with pytest.raises(InputError, match="no channels in this AiM log") as refused:
        read_table(path)
    assert refused.value.remedy
