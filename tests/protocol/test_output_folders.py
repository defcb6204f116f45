"""A command makes all folders for its results, or none."""

import pytest
from typer.testing import CliRunner

from slipbench.command import app
from slipbench.protocol.output_folders import check_page, make_folders


def test_all_folders_are_made(tmp_path):
    (tmp_path / "there").mkdir()
    make_folders(tmp_path / "a" / "b", tmp_path / "there", tmp_path / "a" / "b", tmp_path / "c")
    assert sorted(p.name for p in tmp_path.rglob("*")) == ["a", "b", "c", "there"]


@pytest.mark.parametrize("wrong", ["file", "file/x", "loop/x", "x" * 300, "a/file"])
def test_where_one_cannot_be_made_none_is(tmp_path, wrong):
    (tmp_path / "file").write_bytes(b"kept")
    (tmp_path / "loop").symlink_to("loop")
    (tmp_path / "a").mkdir()
    (tmp_path / "a" / "file").write_bytes(b"kept")
    before = sorted(tmp_path.rglob("*"))
    with pytest.raises(OSError, match=str(tmp_path)):
        make_folders(tmp_path / "new" / "deep", tmp_path / wrong)
    assert sorted(tmp_path.rglob("*")) == before


def test_a_page_that_can_be_written_is_checked_without_a_trace(tmp_path):
    (tmp_path / "page.md").write_text("old")
    for name in ("page.md", "new.md", "a/b/new.md"):
        check_page(tmp_path / name)
    assert [path.name for path in tmp_path.iterdir()] == ["page.md"]
    assert (tmp_path / "page.md").read_text() == "old"


@pytest.mark.parametrize("name", [".", "file/page.md", "loop", "x" * 300, "a/" + "x" * 300])
def test_a_page_that_cannot_be_written_is_refused_before_the_work(tmp_path, name):
    (tmp_path / "file").touch()
    (tmp_path / "loop").symlink_to("loop")
    with pytest.raises(OSError, match=r".") as refused:
        check_page(tmp_path / name)
    assert refused.value.filename


def test_a_page_needs_a_folder_for_its_figures(tmp_path):
    (tmp_path / "figures").touch()
    with pytest.raises(NotADirectoryError):
        check_page(tmp_path / "page.md")


def test_a_study_whose_page_is_a_folder_is_not_begun(tmp_path):
    (tmp_path / "page.md").mkdir()
    words = ["--cases", "1", "--seed", "1", "--out", str(tmp_path / "study")]
    done = CliRunner().invoke(app, ["prove", *words, "--page", str(tmp_path / "page.md")])
    assert isinstance(done.exception, IsADirectoryError)
    assert [path.name for path in tmp_path.iterdir()] == ["page.md"]
