"""Laws of CAN messages as JSON: every frame is valid under its schema, and equals what is decoded."""

import json
import math

import jsonschema
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mcap.reader import make_reader

from slipbench.dbc import MOTORBIKE, MOTORBIKE_FD
from slipbench.protocol.database.database import load_database
from slipbench.protocol.database.layout import Database, Message, Signal
from slipbench.protocol.export import export_run
from slipbench.protocol.export.json_messages import json_messages, message_schema, signal_schema
from slipbench.protocol.logs.candump import parse_pieces
from slipbench.protocol.logs.candump_line import format_line
from slipbench.protocol.logs.decode import decode, sort_log

START = 1_700_000_000_123_456_000
LENGTH = 8  # bytes
WORDS = st.text("abcdefghijklmnopqrstuvwxyz \"\\'°²µ", min_size=1, max_size=12)


@st.composite
def signals(draw, name):
    """A signal of any kind; signals of a message may overlap."""
    is_float = draw(st.booleans())
    length = draw(st.sampled_from([32, 64]) if is_float else st.integers(1, 32))
    little = draw(st.booleans())
    first = draw(st.integers(0, 8 * LENGTH - length))
    last_named = min((1 << length) - 1, 12)
    return Signal(
        name,
        start=first if little else 8 * (first // 8) + 7 - first % 8,
        length=length,
        little_endian=little,
        signed=not is_float and draw(st.booleans()),
        is_float=is_float,
        scale=draw(st.sampled_from([1, 0.5, 2, 1e-3])),
        offset=draw(st.sampled_from([0, -40, 0.25])),
        unit=draw(st.sampled_from(["", "rad/s", "°C", "%"])),
        comment=draw(st.just("") | WORDS),
        choices={} if is_float else draw(st.dictionaries(st.integers(0, last_named), WORDS)),
    )


@st.composite
def messages(draw):
    """A message with a multiplexed signal."""
    count = draw(st.integers(1, 4))
    plain = [draw(signals(f's{number} "%')) for number in range(count)]
    switch = Signal("switch", 0, 2, is_multiplexer=True)
    shown = draw(signals("shown"))
    within = Signal(**{**vars(shown), "multiplexer": "switch", "multiplexer_ids": (1, 2)})
    return Message("Any", 0x123, LENGTH, (switch, within, *plain))


def log_of(frames, identifier=0x123):
    lines = [
        format_line(START + 1000 * row, "can0", identifier, data) for row, data in enumerate(frames)
    ]
    return parse_pieces([b"".join(lines)], "test", [])


def finite(samples):
    """Values of a signal by row, without those that are no number."""
    pairs = zip(samples.rows.tolist(), samples.exact.tolist(), strict=True)
    return {row: value for row, value in pairs if math.isfinite(value)}


def validator(message):
    schema = message_schema(message)
    jsonschema.Draft202012Validator.check_schema(schema)
    return jsonschema.Draft202012Validator(schema)


@given(messages(), st.lists(st.binary(min_size=LENGTH, max_size=LENGTH), min_size=1, max_size=12))
@settings(deadline=None, max_examples=150)
def test_every_frame_is_valid_and_equals_what_is_decoded(message, frames):
    sorted_log = sort_log(log_of(frames), Database("test", "", (message,)))
    check = validator(message)
    found, count = json_messages(sorted_log)
    trees = [json.loads(text) for _, text in found]
    for tree in trees:
        check.validate(tree)
    decoded = decode(sorted_log)["Any"]
    assert count == sum(samples.rows.size for samples in decoded.values())
    for name, samples in decoded.items():
        assert {row: tree[name] for row, tree in enumerate(trees) if name in tree} == finite(
            samples
        )


def test_a_value_of_another_type_and_an_unknown_member_are_invalid():
    message = Message("Any", 1, 8, (Signal("speed", 0, 16, unit="m/s"),))
    check = validator(message)
    assert check.is_valid({"speed": 3})
    for wrong in ({"speed": "3"}, {"speed": None}, {"sped": 3}, {"speed": 3.5}, [3]):
        assert not check.is_valid(wrong)


def test_a_schema_names_type_unit_comment_and_value_table():
    speed = signal_schema(Signal("speed", 0, 16, scale=0.01, unit="m/s", comment="of the wheel"))
    assert speed == {"type": "number", "unit": "m/s", "description": "of the wheel [m/s]"}
    gear = signal_schema(Signal("gear", 0, 2, choices={0: "neutral", 1: "first"}))
    titles = [(each["const"], each["title"]) for each in gear["oneOf"]]
    assert titles == [(0, "neutral"), (1, "first"), (2, "2"), (3, "3")]
    special = signal_schema(Signal("t", 0, 8, offset=-40, unit="°C", choices={255: "invalid"}))
    assert special["choices"] == [{"title": "invalid", "const": 215}]
    assert "oneOf" not in special


def test_names_that_a_value_table_uses_twice_stay_apart():
    schema = signal_schema(Signal("x", 0, 2, choices={1: "reserved", 2: "reserved"}))
    titles = [each["title"] for each in schema["oneOf"]]
    assert titles == ["0", "reserved (1)", "reserved (2)", "3"]


def types_of(schema):
    """Types of the members of an object, as the parsers of the applications require them."""
    return {member["type"] for member in schema["properties"].values()}


@pytest.mark.parametrize("path", [MOTORBIKE, MOTORBIKE_FD], ids=["classic", "fd"])
def test_the_schemas_of_a_database_have_what_the_applications_read(path):
    """A single type for each member; an enumeration with `const` and `title` alone."""
    for message in load_database(path).messages:
        schema = message_schema(message)
        assert types_of(schema) <= {"number", "integer"}
        for signal in message.signals:
            member = schema["properties"][signal.name]
            assert member.get("unit", "") == signal.unit
            assert signal.comment in member.get("description", "")
            named = {each["title"] for each in member.get("oneOf", member.get("choices", []))}
            assert named >= set(signal.choices.values())
            assert all(isinstance(each["const"], int | float) for each in member.get("oneOf", []))


@pytest.mark.parametrize("path", [MOTORBIKE, MOTORBIKE_FD], ids=["classic", "fd"])
def test_a_file_with_schemas_reads_back_as_what_was_recorded(path, tmp_path):
    database, seed = load_database(path), 11
    print("seed", seed)
    random = np.random.default_rng(seed)
    lines = []
    for row in range(1500):
        message = database.messages[random.integers(len(database.messages))]
        data = random.bytes(message.length)
        flags = 1 if message.fd else None
        time = START + row * 250_000
        extended = message.extended
        lines.append(
            format_line(time, "can0", message.identifier, data, extended=extended, fd_flags=flags)
        )
    run = tmp_path / "run"
    run.mkdir()
    (run / "frames.log").write_bytes(b"".join(lines))
    (run / "database.dbc").write_bytes(path.read_bytes())
    read = {}
    with export_run(run, "mcap").path.open("rb") as file:
        for schema, channel, message in make_reader(file).iter_messages(log_time_order=False):
            tree = json.loads(message.data)
            jsonschema.validate(tree, json.loads(schema.data))
            read.setdefault(channel.topic, []).append((message.log_time, tree))
    log = parse_pieces(lines, "test", [])
    for name, wanted in decode(sort_log(log, database)).items():
        for signal, samples in wanted.items():
            times = {log.time_ns[row]: value for row, value in finite(samples).items()}
            got = {t: tree[signal] for t, tree in read[f"/can0/{name}"] if signal in tree}
            assert got == times, (name, signal)
    assert sum(map(len, read.values())) == 2 * len(lines)
