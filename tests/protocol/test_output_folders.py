"""A command makes all folders for its results, or none."""

import pytest

from slipbench.protocol.output_folders import make_folders


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
