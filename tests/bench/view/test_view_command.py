"""Which page `slipbench view` serves for a folder."""

import pytest

from slipbench.protocol.errors import InputError
from slipbench.view_command import is_season, view
from tests.identification.season.seasons import make_run


def test_a_run_and_a_session_are_no_season_and_what_is_above_them_is(tmp_path):
    run = make_run(tmp_path / "2026/monday/runs/a-1")
    assert not is_season(run)
    assert not is_season(tmp_path / "2026/monday")
    assert is_season(tmp_path / "2026")
    assert is_season(tmp_path)


def test_a_folder_without_runs_and_no_folder_are_no_season(tmp_path):
    assert not is_season(tmp_path)
    assert not is_season(tmp_path / "none")


def test_a_season_cannot_be_streamed(tmp_path):
    make_run(tmp_path / "monday/runs/a-1")
    with pytest.raises(InputError, match="cannot be streamed"):
        view(tmp_path, foxglove=True)
