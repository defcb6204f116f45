"""Laws of the index: it follows from the folder alone, and nothing in the folder is dropped."""

import json
import os
import shutil
from contextlib import suppress
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from slipbench.identification.season import index
from slipbench.identification.season.columns import entries_of, table_of
from slipbench.identification.season.folders import INDEX, folders
from slipbench.identification.season.index import refreshed
from slipbench.protocol.errors import InputError
from slipbench.protocol.recording.tags import write_tags
from tests.identification.season.seasons import LONG_AGO, age, explain, identify, make_run, write

NAMES = ("a-1", "a-2", "b-1")
SESSIONS = ("monday", "tuesday", "2025/friday")


def made_anew(root: Path):
    shutil.rmtree(root / INDEX, ignore_errors=True)
    return refreshed(root)


def season(root: Path) -> Path:
    for day, name in enumerate(SESSIONS, 1):
        write(root / name / "plan.toml", "name = 'day'\n")
        for number, run in enumerate(NAMES):
            make_run(root / name / "runs" / run, day, {"mileage": 100 * day}, 8.0 + number)
        explain(root / name / "memo", 1.0 + day)
    return root


def change(root: Path, what: str, run: str, value: int) -> None:
    """One change of a season, as users and programs make them."""
    folder = root / run
    if what == "add":
        make_run(folder, 1 + value % 28, {"mileage": value}, 5.0 + value)
    elif not folder.exists():
        return
    elif what == "tag":
        with suppress(InputError):  # of a damaged run
            write_tags(folder, {"mileage": value, "tyre": f"t{value}"})
        age(folder / "run.toml")
    elif what == "remove":
        shutil.rmtree(folder)
    elif what == "identify":
        identify(folder, 5.0 + value)
    elif what == "damage":
        write(folder / "run.toml", b"\xff[run" * (1 + value % 3))
    elif what == "move":
        target = root / "moved" / f"{folder.name}-{value}"
        if not target.exists():
            target.parent.mkdir(exist_ok=True)
            shutil.move(folder, target)


RUNS = st.sampled_from([f"{s}/runs/{r}" for s in SESSIONS for r in (*NAMES, "new")])
CHANGES = st.tuples(
    st.sampled_from(["add", "tag", "remove", "identify", "damage", "move"]),
    RUNS,
    st.integers(0, 1000),
)


@settings(max_examples=10, deadline=None)
@given(st.lists(st.lists(CHANGES, max_size=4), min_size=1, max_size=3))
def test_refreshed_after_any_changes_equals_made_anew(tmp_path_factory, rounds):
    root = season(tmp_path_factory.mktemp("season"))
    refreshed(root)
    for changes in rounds:
        for one in changes:
            change(root, *one)
        found = refreshed(root)
    assert found == made_anew(root)
    runs = [one for one in folders(root) if one.kind == "run"]
    assert [e.folder for e in found if e.folder.kind == "run"] == runs
    assert len(runs) == len(list(root.rglob("run.toml")))


def test_a_moved_folder_has_the_index_made_anew_and_reads_nothing(tmp_path, monkeypatch):
    before = refreshed(season(tmp_path / "here"))
    shutil.move(tmp_path / "here", tmp_path / "there")
    monkeypatch.setattr(index, "read_entries", lambda root, found, scheduler: no_more(found))
    moved = refreshed(tmp_path / "there")
    monkeypatch.undo()
    assert moved == before == made_anew(tmp_path / "there")


def no_more(found):
    assert list(found) == []
    return []


def test_only_a_changed_folder_is_read(tmp_path, monkeypatch):
    root, read = season(tmp_path), []
    refreshed(root)
    identify(root / "monday/runs/a-1", 9.9)
    whole = index.read_entries
    monkeypatch.setattr(
        index, "read_entries", lambda root, found, at: read.extend(found) or whole(root, found, at)
    )
    refreshed(root)
    assert [one.path for one in read] == ["monday/runs/a-1"]


def test_a_change_that_leaves_no_trace_is_found_while_it_may_happen(tmp_path):
    """Two writes within one tick of the file system's clock have the same size and time."""
    root = season(tmp_path)
    path = root / "monday/runs/a-1/run.toml"
    refreshed(root)
    now = (root / INDEX / index.FILE).stat().st_mtime_ns
    os.utime(path, ns=(now, now))
    refreshed(root)
    path.write_text(path.read_text().replace("bike", "moto"))
    os.utime(path, ns=(now, now))
    assert {e.vehicle for e in refreshed(root) if e.folder.path.endswith("monday/runs/a-1")} == {
        "moto"
    }


@pytest.mark.parametrize(
    "content", [b"", b"no parquet", b"PAR1" + bytes(100) + b"PAR1"], ids=["empty", "text", "zeros"]
)
def test_a_damaged_index_is_made_anew_with_a_word(tmp_path, content):
    root, said = season(tmp_path), []
    before = refreshed(root)
    (root / INDEX / index.FILE).write_bytes(content)
    assert refreshed(root, say=said.append) == before
    assert "damaged" in said[0]
    assert refreshed(root, say=said.append) == before
    assert len(said) == 1


def test_an_index_of_another_version_is_made_anew(tmp_path, monkeypatch):
    root, said = season(tmp_path), []
    before = refreshed(root)
    monkeypatch.setattr(index, "VERSION", "of the next slipbench")
    assert refreshed(root, say=said.append) == before
    assert "version" in said[0]


def test_a_folder_that_cannot_be_written_is_listed_all_the_same(tmp_path, monkeypatch):
    root, said = season(tmp_path), []

    def refuse(*_: object, **__: object) -> None:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(Path, "mkdir", refuse)
    found = refreshed(root, say=said.append)
    monkeypatch.undo()
    assert "Permission denied" in said[0]
    assert not (root / INDEX).exists()
    assert found == refreshed(root)


def test_entries_are_their_rows(tmp_path):
    found = refreshed(season(tmp_path))
    assert entries_of(table_of(found)) == found


DAMAGES = {
    "run.toml": (b"\xff", "run.toml: not valid TOML"),
    "trial.toml": (b"name = 1", "trial.toml"),
    "frames.log": (b"", "frames.log is empty"),
    "identification.json": (b"{", "this is no JSON"),
    "quick_look.json": (b"[]", "no result of slipbench"),
}


@pytest.mark.parametrize("name", DAMAGES)
def test_a_damaged_file_is_a_fault_and_the_others_count(tmp_path, name):
    make_run(tmp_path / "a", 1, {"tyre": "new"}, 8.0)
    content, words = DAMAGES[name]
    write(tmp_path / "a" / name, content)
    (found,) = refreshed(tmp_path)
    assert words in found.fault
    assert str(tmp_path) not in found.fault
    if name != "run.toml":
        assert dict(found.tags) == {"tyre": "new"}
    if name != "identification.json":
        assert found.verdict == "good"


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda t: t | {"schema_version": "9"}, "version"),
        (lambda t: t | {"models": [{"input": "u"}, *t["models"]]}, "models"),
        (lambda t: t | {"resonance": {"frequency": "8 Hz"}}, "resonance: frequency"),
        (lambda t: t | {"verdict": {"word": "fine", "reasons": ["x"]}}, "word"),
    ],
)
def test_a_damaged_part_of_an_identification_is_a_fault(tmp_path, change, words):
    path = make_run(tmp_path / "a", 1, {}, 8.0) / "identification.json"
    write(path, json.dumps(change(json.loads(path.read_text()))))
    (found,) = refreshed(tmp_path)
    assert words in found.fault
    assert found.started is not None


@pytest.mark.parametrize("missing", ["run.toml", "frames.log", "trial.toml"])
def test_a_missing_file_is_a_fault(tmp_path, missing):
    (make_run(tmp_path / "a") / missing).unlink()
    (found,) = refreshed(tmp_path)
    assert f"there is no {missing}" in found.fault


def test_a_run_without_an_end_is_incomplete(tmp_path):
    run = make_run(tmp_path / "a")
    write(run / "run.toml", "[run]\nkind = 'trial'\n")
    assert [e.verdict for e in refreshed(tmp_path)] == ["incomplete"]


def test_a_tag_date_is_the_date_of_the_run(tmp_path):
    make_run(tmp_path / "a", 1, {"date": "2024-02-29", "tyre": "new"})
    make_run(tmp_path / "b", 1, {"date": "yesterday"})
    a, b = refreshed(tmp_path)
    assert (a.started.isoformat(), dict(a.tags)) == ("2024-02-29T00:00:00", {"tyre": "new"})
    assert "tags.date = 'yesterday' is no date" in b.fault
    assert b.started.day == 1


def test_links_are_followed_once(tmp_path):
    make_run(tmp_path / "disk" / "a")
    root = tmp_path / "season"
    root.mkdir()
    (root / "link").symlink_to(tmp_path / "disk")
    (root / "again").symlink_to(root)
    (root / "broken").symlink_to(root / "nowhere")
    assert [one.path for one in folders(root)] == ["link/a"]


def test_what_is_no_season_is_refused(tmp_path):
    make_run(tmp_path / "a")
    with pytest.raises(InputError, match="run folder itself"):
        refreshed(tmp_path / "a")
    with pytest.raises(InputError, match="no such folder"):
        refreshed(tmp_path / "b")


def test_the_times_of_these_tests_are_in_the_past() -> None:
    assert Path(__file__).stat().st_mtime_ns > LONG_AGO + 10**12
