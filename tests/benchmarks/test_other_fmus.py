"""FMUs of other tools: the laws of what is recorded, and what happens without the packages."""

import numpy as np
import pytest

pytest.importorskip("fmpy", reason="pip install 'slipbench[fmu]'")

from benchmarks.other_fmus import fetch, run, truth
from benchmarks.other_fmus.cases import CASES
from benchmarks.other_fmus.explained import is_right
from benchmarks.other_fmus.page import page

FOUND = {"mismatch": {"found": True}, "equivalents": [["lag.u", "lag.y"]]}


def test_a_ball_without_drag_falls_and_bounces_as_the_textbook_says():
    times = 1e-3 * np.arange(1000)
    height = truth.ball(0.7, 0.0, times)
    hit = np.sqrt(2.0 / 9.81)
    falling, since = times < hit, times - hit
    assert np.allclose(height[falling], 1.0 - 0.5 * 9.81 * times[falling] ** 2, atol=1e-9)
    rising = (since > 0.0) & (since < 1.4 * hit)
    expected = 0.7 * 9.81 * hit * since[rising] - 0.5 * 9.81 * since[rising] ** 2
    assert np.allclose(height[rising], expected, atol=1e-9)


def test_a_ramp_behind_a_lag_is_late_by_the_time_constant():
    ramp = 0.01 * np.arange(1000)
    shown = truth.lagged(ramp, 0.01, 0.3)
    assert np.allclose(shown[500:], ramp[500:] - 0.3, atol=1e-6)


def test_without_the_packages_the_page_stays(monkeypatch, tmp_path, capsys):
    def absent():
        raise fetch.AbsentError("pip cannot download it: no network")

    old = tmp_path / "page.md"
    old.write_text("as it was", encoding="utf-8")
    monkeypatch.setattr(run, "fetch", absent)
    monkeypatch.setattr(run, "PAGE", old)
    run.main([])
    assert old.read_text(encoding="utf-8") == "as it was"
    assert "no network" in capsys.readouterr().out


def test_a_case_is_right_where_a_tied_name_means_what_was_planted():
    case = next(c for c in CASES if c.right == ("lag.command", "lag.shown"))
    tied = FOUND | {"equivalents": [["lag.command", "delay.shown"]]}
    assert is_right(case, ["delay.shown"], tied)
    assert not is_right(case, ["delay.shown"], FOUND)
    assert not is_right(case, ["lag.command", "offset.shown"], FOUND)


def test_a_case_that_was_not_run_is_not_on_the_page():
    assert "0 of 0 cases" in page([], {})
    assert CASES[0].title not in page([], {})
