"""A new file is written whole or not at all, never over another, and every fault is an InputError."""

import pytest

from slipbench.protocol.errors import InputError
from slipbench.protocol.new_file import new_file


@pytest.fixture
def folder(tmp_path):
    """A folder with a file, a folder, a link to nowhere and a loop of links."""
    (tmp_path / "file").write_text("kept")
    (tmp_path / "sub").mkdir()
    (tmp_path / "nowhere").symlink_to(tmp_path / "missing")
    (tmp_path / "loop").symlink_to(tmp_path / "loop")
    return tmp_path


@pytest.mark.parametrize(
    "name", ["file", "sub", "nowhere", "loop", "file/x", "loop/x", "a\0b", "x" * 300, "x" * 252]
)
def test_what_cannot_be_a_new_file_is_refused_and_nothing_changes(folder, name):
    before = sorted(folder.iterdir())
    with pytest.raises(InputError), new_file(folder / name) as draft:
        draft.write_text("new")
    assert sorted(folder.iterdir()) == before
    assert (folder / "file").read_text() == "kept"


def write_and_fail(path, fault):
    with new_file(path) as draft:
        draft.mkdir()
        (draft / "part").write_text("x")
        raise fault


@pytest.mark.parametrize("fault", [OSError("disk full"), ValueError("x"), KeyboardInterrupt()])
def test_nothing_is_left_behind_when_writing_fails(folder, fault):
    before = sorted(folder.iterdir())
    expected = InputError if isinstance(fault, OSError) else type(fault)
    with pytest.raises(expected):
        write_and_fail(folder / "new", fault)
    assert sorted(folder.iterdir()) == before


def test_a_draft_becomes_the_file(folder):
    with new_file(folder / "new" / "x") as draft:
        draft.write_text("whole")
    assert [path.name for path in (folder / "new").iterdir()] == ["x"]
    assert (folder / "new" / "x").read_text() == "whole"


def test_a_draft_that_was_left_or_leads_elsewhere_is_replaced(folder):
    (folder / "new.part").symlink_to(folder / "file")
    with new_file(folder / "new") as draft:
        draft.write_text("whole")
    assert (folder / "file").read_text() == "kept"
    assert (folder / "new").read_text() == "whole"
