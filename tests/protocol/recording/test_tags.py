"""Laws of tags: what is written is read back, nothing else of run.toml changes, faults are named."""

from datetime import date

import pytest
from hypothesis import given
from hypothesis import strategies as st

from slipbench.protocol.configuration import load_toml
from slipbench.protocol.errors import InputError
from slipbench.protocol.recording.tags import parse_tag, tags_of, write_tags

RUN = '# before\n[run]\nname = "a" # kept\nstart = 2026-05-03T10:00:00Z\n'
KEYS = st.from_regex(r"[a-z][a-z0-9_]{0,39}", fullmatch=True)
TEXTS = st.text(min_size=1, max_size=200).filter(lambda t: t.isprintable() and t.strip())
VALUES = (
    TEXTS
    | st.integers(-(2**53) + 1, 2**53 - 1)
    | st.floats(-1e299, 1e299)
    | st.dates(date(1, 1, 1))
    | st.booleans()
)


def as_read(value):
    if isinstance(value, bool):
        return str(value).lower()
    return value.isoformat() if isinstance(value, date) else value


@given(before=st.dictionaries(KEYS, VALUES), changes=st.dictionaries(KEYS, st.none() | VALUES))
def test_what_is_written_is_read_back(tmp_path_factory, before, changes):
    folder = tmp_path_factory.mktemp("run")
    (folder / "run.toml").write_text(RUN)
    write_tags(folder, before)
    write_tags(folder, changes)
    found = tags_of(load_toml(folder / "run.toml"), "run.toml")
    expected = {key: as_read(v) for key, v in {**before, **changes}.items() if v is not None}
    assert found == expected
    assert (folder / "run.toml").read_text().startswith(RUN)


@pytest.mark.parametrize(
    ("text", "key", "value"),
    [
        ("tyre=new", "tyre", "new"),
        ("mileage = 812", "mileage", 812),
        ("temperature=-3.5", "temperature", -3.5),
        ("date=2026-05-03", "date", date(2026, 5, 3)),
        ("wet=true", "wet", True),
        ("number=007", "number", "007"),
        ("note=a=b", "note", "a=b"),
        ("list=[1, 2]", "list", "[1, 2]"),
        ("track=", "track", None),
    ],
)
def test_a_value_is_what_toml_reads_else_text(text, key, value):
    assert parse_tag(text) == (key, value)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("tyre", "KEY=VALUE"),
        ("Tyre=new", "Tyre"),
        ("=new", "tags"),
        ("a b=new", "a b"),
        ("x=inf", "finite"),
        ("x=" + "y" * 201, "200 printable"),
    ],
)
def test_what_is_no_tag_is_refused(text, words):
    with pytest.raises(InputError, match=words):
        parse_tag(text)


@pytest.mark.parametrize(
    "table", ["tyre = [1, 2]", "Tyre = 1", "a = nan", "b = 12:00:00", "c = ''"]
)
def test_a_table_with_a_fault_is_refused_and_stays(tmp_path, table):
    text = f"{RUN}\n[tags]\n{table}\n"
    (tmp_path / "run.toml").write_text(text)
    with pytest.raises(InputError, match=r"tags\."):
        write_tags(tmp_path, {"track": "Mugello"})
    assert (tmp_path / "run.toml").read_text() == text


def test_without_a_description_nothing_is_made(tmp_path):
    with pytest.raises(InputError, match=r"run\.toml"):
        write_tags(tmp_path, {"track": "Mugello"})
    assert list(tmp_path.iterdir()) == []
