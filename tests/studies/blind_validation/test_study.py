"""The ground truth is fixed before the analysis, an interrupted study continues, rates are exact."""

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import typer
from distributed import LocalCluster
from scipy import stats
from typer.testing import CliRunner

from slipbench.identification.cluster import Workers
from slipbench.protocol.errors import InputError
from slipbench.studies.blind_validation.commands import register
from slipbench.studies.blind_validation.counting import figures, middle, share
from slipbench.studies.blind_validation.hidden_cases import (
    FINGERPRINT,
    GROUND_TRUTH,
    ground_truth,
    store_ground_truth,
)
from slipbench.studies.blind_validation.page import Provenance, page
from slipbench.studies.blind_validation.posterior import ranks_of, uniformity
from slipbench.studies.blind_validation.score import (
    NORMAL_95,
    Estimate,
    ScoredCase,
    scored,
    what_is_wrong,
)
from slipbench.studies.blind_validation.shortfalls import every_curve, every_interval, every_miss
from slipbench.studies.blind_validation.study import (
    Study,
    observe_again,
    result_path,
    results_so_far,
    run_study,
    source_fingerprint,
)


def square(seed: int, number: int) -> dict:
    """What a case is worth here: nothing that needs an analysis."""
    return {"case": number, "value": seed * number * number}


def verdict(**more) -> dict:
    return {
        "mismatch": {"found": False, "p_value": 1.0},
        "location": None,
        "effects": [],
        "unknown": {"found": False, "shape": ""},
        "equivalents": [],
        "held_out": [],
        "not_excited": [],
        **more,
    }


def result(case: int, told: dict, each: list[float]) -> dict:
    return {
        "case": case,
        "verdict": told,
        "ideal": {"gain": sum(each), "each": each},
        "seconds": {"analysis": 1.0},
    }


def hidden(kind: str, **parameters) -> dict:
    return {
        "kind": kind,
        "subject": "",
        "grade": "moderate",
        "parameters": parameters,
        "places": ["driveline torque"],
    }


def answer(case: int, sort: str, *things: dict) -> dict:
    return {
        "case": case,
        "category": sort,
        "tyre": "brush",
        "careless": False,
        "seconds": [10.0] * 7,
        "hidden": list(things),
    }


def effect(name: str, **intervals) -> dict:
    return {
        "name": name,
        "subject": "",
        "block": "driveline",
        "gain": 100.0,
        "parameters": [
            {"name": n, "value": sum(i) / 2, "unit": "", "interval": list(i)}
            for n, i in intervals.items()
        ],
    }


FOUND = verdict(
    mismatch={"found": True, "p_value": 0.0},
    location={"injection": "driveline torque"},
    effects=[effect("backlash", slack=(7e-3, 9e-3))],
)


def only(*pairs: tuple[dict, dict]) -> list[ScoredCase]:
    answers, results = zip(*pairs, strict=True)
    return scored(answers, results)


def test_a_true_name_with_its_place_and_interval_is_all_right() -> None:
    (one,) = only((answer(0, "moderate", hidden("backlash", slack=8e-3)), result(0, FOUND, [90.0])))
    assert (one.named, one.located, what_is_wrong(one)) == (True, True, "")
    assert [told.holds for told in one.numbers] == [True]
    assert every_interval([one]) == every_curve([one]) == every_miss([one]) == ["None."]


def test_an_interval_that_misses_the_truth_is_listed_with_it() -> None:
    (one,) = only(
        (answer(0, "moderate", hidden("backlash", slack=9.5e-3)), result(0, FOUND, [90.0]))
    )
    assert every_interval([one])[2:] == ["| 0 | backlash | slack | 0.0095 | 0.007 to 0.009 |"]


def test_free_curves_below_their_goal_are_listed_worst_first() -> None:
    pair = (answer(0, "moderate", hidden("backlash", slack=8e-3)), result(0, FOUND, [90.0]))
    (one,) = only(pair)
    several = [replace(one, case=n, curve=s) for n, s in enumerate((0.95, 0.8, math.nan, 0.03))]
    rows = [line.split(" | ") for line in every_curve(several)[2:]]
    assert [(row[0], row[2]) for row in rows] == [("| 3", "3 % |"), ("| 1", "80 % |")]


def test_a_class_that_holds_the_truth_counts_as_its_name() -> None:
    told = {**FOUND, "effects": [effect("hardening_cush")]}
    truth = answer(0, "moderate", hidden("backlash", slack=8e-3))
    (wrong,) = only((truth, result(0, told, [90.0])))
    (right,) = only(
        (truth, result(0, {**told, "equivalents": [["hardening_cush", "backlash"]]}, [90.0]))
    )
    assert what_is_wrong(wrong) == "wrong name"
    assert right.named


def test_what_nobody_can_see_is_no_miss_and_to_claim_it_is() -> None:
    truth = answer(0, "small", hidden("backlash", slack=2e-3))
    quiet, loud = (only((truth, result(0, told, [3.0])))[0] for told in (verdict(), FOUND))
    assert what_is_wrong(quiet) == ""
    assert what_is_wrong(loud) == "alarm, effect not visible"


def test_an_alarm_where_nothing_is_missing_is_a_false_one() -> None:
    (one,) = only((answer(0, "nothing"), result(0, FOUND, [])))
    assert what_is_wrong(one) == "false alarm"
    assert next(f for f in figures([one]) if "False alarms" in f.text).percent == 100.0


def test_of_a_pair_both_must_be_named_and_nothing_else() -> None:
    truth = answer(0, "pair", hidden("backlash", slack=8e-3), hidden("driveline_loss", loss=0.04))
    both = {**FOUND, "effects": [effect("backlash"), effect("driveline_loss")]}
    more = {**both, "effects": [*both["effects"], effect("wind")]}
    cases = [only((truth, result(0, told, [90.0, 90.0])))[0] for told in (FOUND, both, more)]
    assert [c.named for c in cases] == [False, True, False]


def test_what_the_named_things_explain_as_well_is_not_to_be_seen() -> None:
    truth = answer(0, "pair", hidden("backlash", slack=8e-3), hidden("driveline_loss", loss=0.04))
    nearly = {**result(0, FOUND, [90.0, 90.0]), "ideal": {"gain": 103.0, "each": [90.0, 90.0]}}
    (one,) = only((truth, nearly))
    assert (one.visible, one.named) == (("backlash",), True)
    (missed,) = only((truth, {**nearly, "ideal": {"gain": 150.0, "each": [90.0, 90.0]}}))
    assert (missed.visible, missed.named) == (("backlash", "driveline_loss"), False)


def test_a_name_for_what_is_in_no_library_is_a_miss() -> None:
    truth = answer(0, "outside", hidden("spark_lag", time_constant=0.02))
    assert "not in the library" in what_is_wrong(only((truth, result(0, FOUND, [90.0])))[0])


def test_a_name_that_describes_what_no_library_has_fairly_is_no_wrong_name() -> None:
    drift = {**hidden("drifting_scale", per_10_s=0.04), "subject": "engine_speed"}
    truth = answer(0, "outside", drift)
    for name, subject, wrong in (
        ("channel_scale", "engine_speed", ()),
        ("channel_scale", "throttle_position", ("channel_scale.throttle_position",)),
        ("optical_scale", "", ()),
        ("backlash", "", ("backlash",)),
    ):
        told = {**FOUND, "effects": [{**effect(name), "subject": subject}]}
        (one,) = only((truth, result(0, told, [90.0])))
        assert one.wrong_names == wrong
        assert ("wrong name" in what_is_wrong(one)) == bool(wrong)


def ranked(z: float, careless: bool = False, low: float = -1.0, high: float = 2.0) -> Estimate:
    """An estimate of 0 whose truth lies z standard deviations away; the upper side is the wider."""
    return Estimate("", "", z * (high if z > 0 else -low) / NORMAL_95, low, high, 0.0, careless)


def test_ranks_are_those_of_a_normal_posterior_with_the_stated_interval() -> None:
    for z, rank in ((0.0, 0.5), (NORMAL_95, 0.975), (-NORMAL_95, 0.025), (-1.0, 0.158655)):
        assert ranked(z).rank == pytest.approx(rank, abs=1e-5)
    assert math.isnan(Estimate("", "", 1.0, 0.0, 0.0, 0.0).rank)


@pytest.mark.parametrize(("width", "uniform"), [(1.0, True), (2.0, False), (0.5, False)])
def test_ranks_are_uniform_only_where_posteriors_are_as_wide_as_their_errors(
    width: float, uniform: bool
) -> None:
    """Quantiles of a normal distribution; width: of the errors, in units of the stated width."""
    errors = width * stats.norm.ppf((np.arange(400) + 0.5) / 400)
    (plain,) = only((answer(0, "nothing"), result(0, verdict(), [])))
    estimates = tuple(ranked(z) for z in errors)
    liars = tuple(ranked(z, careless=True) for z in np.full(100, 3.0))
    found = uniformity(ranks_of([replace(plain, numbers=estimates + liars)]))
    assert found is not None
    assert len(found.ranks) == 400
    assert (found.ks > 0.01) == uniform
    assert (found.chi_square > 0.01) == uniform
    low, high = found.band
    assert all(low <= c <= high for c in found.counts) == uniform


def test_ranks_in_intervals_that_are_mostly_an_allowance_for_another_formula_do_not_count() -> None:
    (plain,) = only((answer(0, "nothing"), result(0, verdict(), [])))
    widths = (0.02, 0.039, 0.041, 0.5)
    stated = tuple(Estimate("", "", 1.0, 1.0 - w, 1.0 + w, 1.0) for w in widths)
    assert len(ranks_of([replace(plain, numbers=stated)])) == 2


def test_too_few_ranks_are_not_tested() -> None:
    assert uniformity([0.5] * 9) is None


def test_curves_of_memories_are_counted_apart_and_times_are_on_the_page() -> None:
    truths = [
        answer(0, "moderate", hidden("backlash", slack=8e-3)),
        answer(1, "moderate", hidden("radius_growth", growth=1e-5)),
    ]
    results = [
        {**result(n, verdict(), [90.0]), "curve": {"confirmed": part, "possible": 100.0}}
        for n, part in enumerate((40.0, 95.0))
    ]
    results[0]["seconds"] = {"analysis": 7.0}
    cases = scored(truths, results)
    shown = {f.text: f.percent for f in figures(cases)}
    assert shown["... memories and hysteresis"] == pytest.approx(40.0)
    assert shown["... effects without memory"] == pytest.approx(95.0)
    text = page(cases, Provenance("slipbench prove", "f" * 64, "0" * 64, 2, "figures"))
    assert "| all cases | 2 | 4.0 s | 7.0 s | 0.06 s |" in text


def test_every_figure_that_the_issue_asks_for_has_its_goal() -> None:
    goals = {f.text: (f.low, f.high) for f in figures([]) if f.has_goal}
    assert goals["False alarms, nothing missing"] == (0.0, 2.0)
    assert goals["Injection point correct, moderate"][0] == 97.0
    assert goals["Injection point correct, small"][0] == 95.0
    assert goals["Name or equivalence class correct, moderate"][0] == 97.0
    assert goals["Name or equivalence class correct, small"][0] == 92.0
    assert goals["Pairs exact"][0] == 95.0
    assert goals["Triples exact"][0] == 90.0
    assert goals["Detected, effect outside the library"][0] == 95.0
    assert goals["No wrong name, outside the library"][0] == 95.0
    assert goals["Injection point correct, outside the library"][0] == 90.0
    assert goals["95 % intervals that contain the truth"] == (92.0, 97.0)
    assert goals["Share of the true effect's held-out gain, free curve"][0] == 90.0


@pytest.mark.parametrize(
    ("count", "total", "low", "high"),
    [(0, 20, 0.0, 16.84), (19, 20, 75.13, 99.87), (100, 100, 96.38, 100.0)],
)
def test_intervals_are_those_of_the_tables(count: int, total: int, low: float, high: float) -> None:
    """Clopper and Pearson, Biometrika 26 (1934), to two digits."""
    assert share("", count, total).interval == pytest.approx((low, high), abs=0.01)


def test_the_interval_of_a_median_comes_from_order_alone() -> None:
    """Of 10 values, the 2nd and the 9th hold the median in 97.9 % (David and Nagaraja 2003)."""
    found = middle("", [0.1 * k for k in range(1, 11)], low=90.0)
    assert found.interval == pytest.approx((20.0, 90.0))
    assert found.percent == pytest.approx(55.0)
    assert found.met is False


def test_the_page_tells_every_goal_and_every_miss() -> None:
    nothing = answer(0, "nothing"), result(0, FOUND, [])
    backlash = answer(1, "moderate", hidden("backlash", slack=8e-3)), result(1, FOUND, [90.0])
    cases = only(nothing, backlash)
    text = page(cases, Provenance("slipbench prove", "f" * 64, "0" * 64, 4, "figures"))
    assert "not met" in text
    assert "false alarm" in text
    assert "2 of 4 cases are open" in text


def test_a_broken_seal_is_found(tmp_path: Path) -> None:
    store_ground_truth([answer(0, "nothing")], tmp_path)
    assert ground_truth(tmp_path) == [answer(0, "nothing")]
    (tmp_path / FINGERPRINT).write_text("0" * 64)
    with pytest.raises(InputError, match="ground truth was changed"):
        ground_truth(tmp_path)


def test_other_answers_do_not_replace_those_that_were_sealed(tmp_path: Path) -> None:
    store_ground_truth([answer(0, "nothing")], tmp_path)
    with pytest.raises(InputError, match="another study"):
        store_ground_truth([answer(1, "nothing")], tmp_path)
    assert (tmp_path / GROUND_TRUTH).exists()


@pytest.fixture(scope="module", params=[1, 2], ids=["one worker", "two workers"])
def scheduler(request):
    """A cluster that exists; its workers are threads, which start at once."""
    with LocalCluster(
        n_workers=request.param,
        threads_per_worker=1,
        processes=False,
        dashboard_address="127.0.0.1:0",
    ) as cluster:
        yield cluster.scheduler_address


def test_a_study_goes_on_where_it_stopped(tmp_path: Path, scheduler: str) -> None:
    study = Study(5, 3, tmp_path, Workers(scheduler=scheduler))
    first = run_study(study, work=square)
    assert [r["value"] for r in first] == [3 * n * n for n in range(5)]
    result_path(tmp_path, 2).unlink()
    untouched = result_path(tmp_path, 3).stat().st_mtime_ns
    assert run_study(study, work=square) == first == results_so_far(study)
    assert result_path(tmp_path, 3).stat().st_mtime_ns == untouched


@pytest.mark.parametrize(
    "text", ["", "[" * 3000, "[]", '{"case": 1, "answers": "", "source": ""}', "{", "\0"]
)
def test_a_file_without_the_result_of_its_case_is_named(tmp_path: Path, text: str) -> None:
    path = result_path(tmp_path, 0)
    path.parent.mkdir()
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=r"case-0000\.json.*does not hold the result"):
        results_so_far(Study(2, 3, tmp_path))


def test_a_study_without_results_has_no_score(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no case of the study has a result yet"):
        results_so_far(Study(2, 3, tmp_path))


@pytest.mark.parametrize("part", ["verdict", "ideal", "seconds"])
@pytest.mark.parametrize("value", [None, {}, 3])
def test_a_result_that_lacks_a_part_is_named(part: str, value: object) -> None:
    damaged = result(0, verdict(), []) | {part: value}
    with pytest.raises(InputError, match="case 0: the result of a case is damaged"):
        scored([answer(0, "nothing")], [damaged])


def test_results_of_other_source_text_do_not_mix(tmp_path: Path, scheduler: str) -> None:
    study = Study(2, 3, tmp_path, Workers(scheduler=scheduler))
    run_study(study, work=square)
    path = result_path(tmp_path, 1)
    path.write_text(json.dumps({**json.loads(path.read_text()), "source": "another"}))
    with pytest.raises(InputError, match="source differs"):
        run_study(study, work=square)


def test_a_scheduler_that_is_not_there_is_named(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setattr("slipbench.identification.cluster.CONNECT_TIMEOUT", 0.5)
    study = Study(1, 3, tmp_path, Workers(scheduler="tcp://127.0.0.1:9"))
    with pytest.raises(InputError, match="does not answer"):
        run_study(study, work=square)


def seen_again(seed: int, number: int) -> dict:
    return {"ideal": {"gain": 50.0, "each": [50.0], "difference": 50.0}, "possible": 40.0}


def test_to_observe_again_changes_no_verdict(tmp_path: Path, scheduler: str) -> None:
    study = Study(2, 3, tmp_path, Workers(scheduler=scheduler))
    for number in range(2):
        old = {"answers": "", "source": "", **result(number, FOUND, [3.0])}
        old["curve"] = {"confirmed": 20.0, "possible": -9.0}
        result_path(tmp_path, number).parent.mkdir(exist_ok=True)
        result_path(tmp_path, number).write_text(json.dumps(old))
    for new in observe_again(study, work=seen_again):
        assert new["verdict"] == FOUND
        assert new["ideal"]["gain"] == 50.0
        assert new["curve"] == {"confirmed": 20.0, "possible": 40.0}
    untouched = result_path(tmp_path, 0).stat().st_mtime_ns
    observe_again(study, work=seen_again)
    assert result_path(tmp_path, 0).stat().st_mtime_ns == untouched


def test_only_what_decides_a_result_changes_the_fingerprint(tmp_path):
    before = {}
    for name in ("engine.py", "page.py", "systems/tank.py"):
        path = tmp_path / "identification/mismatch" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text("a = 1\n", encoding="utf-8")
        before[name] = path
    first = source_fingerprint(tmp_path)
    for name, path in before.items():
        path.write_text("a = 2\n", encoding="utf-8")
        assert (source_fingerprint(tmp_path) != first) == (name == "engine.py")
        path.write_text("a = 1\n", encoding="utf-8")


def test_the_command_is_described_in_the_words_of_the_field() -> None:
    app = typer.Typer()
    app.callback()(lambda: None)
    register(app)
    text = " ".join(CliRunner().invoke(app, ["prove", "--help"], terminal_width=200).output.split())
    assert "Blind validation: generate hidden cases, analyse, score." in text
    assert [word for word in ("seal", "secret", "proof") if word in text.lower()] == []


FAILED = {"case": 1, "failed": "ValueError: no root"}


@pytest.mark.parametrize(("results", "code"), [([{"case": 0}], 0), ([{"case": 0}, FAILED], 3)])
def test_a_study_with_a_failed_analysis_fails(results, code, tmp_path, monkeypatch):
    package = "slipbench.studies.blind_validation"
    monkeypatch.setattr(f"{package}.study.run_study", lambda *_: results)
    monkeypatch.setattr(f"{package}.publish.publish", lambda *_: ["page: written"])
    app = typer.Typer()
    app.callback()(lambda: None)
    register(app)
    ended = CliRunner().invoke(
        app, ["prove", "--cases", "2", "--seed", "1", "--out", str(tmp_path)]
    )
    assert ended.exit_code == code
    assert "page: written" in ended.output
    assert ("case 1: ValueError: no root" in ended.output) == bool(code)
