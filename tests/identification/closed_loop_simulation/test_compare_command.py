"""What `slipbench compare` is given: files, folders, and what it refuses before any ride."""

import pytest

from slipbench.identification.closed_loop_simulation.commands import one_of_each_name
from slipbench.protocol.errors import InputError


def test_a_folder_stands_for_its_files_in_order(tmp_path):
    for name in ("b", "a"):
        (tmp_path / f"{name}.toml").write_text("")
    (tmp_path / "notes.txt").write_text("")
    assert [p.stem for p in one_of_each_name([tmp_path])] == ["a", "b"]
    assert len(one_of_each_name([tmp_path, tmp_path / "a.toml"])) == 2


def test_a_folder_without_controllers_says_how_to_make_one(tmp_path):
    with pytest.raises(InputError, match="slipbench design"):
        one_of_each_name([tmp_path])


def test_of_two_with_one_name_none_is_lost(tmp_path):
    (tmp_path / "other").mkdir()
    one, two = tmp_path / "a.toml", tmp_path / "other" / "a.toml"
    with pytest.raises(InputError, match="two controller files with the same name"):
        one_of_each_name([one, two])
