"""After a late failure the earlier results are written, and the failure is reported."""

import json
from dataclasses import replace
from importlib.resources import files

import jsonschema
import pytest
from typer.testing import CliRunner

from slipbench.command import app
from slipbench.identification.mismatch import explain, runs
from slipbench.identification.mismatch.analysis import begin
from slipbench.identification.mismatch.explain import NAMES, STEPS, analyse, run_analysis
from slipbench.identification.mismatch.reporting import conclude, memo_page, output
from slipbench.identification.mismatch.reporting.conclude import verdict
from slipbench.identification.mismatch.reporting.hypotheses import hypotheses
from slipbench.protocol.errors import InputError
from tests.identification.mismatch.spring import recorded, system

SCHEMA = json.loads(
    (files("slipbench.identification.mismatch.reporting") / "verdict.schema.json").read_text()
)


def broken(*_, **__):
    return [][3]


@pytest.fixture(scope="module")
def hardening(tmp_path_factory):
    """A finished analysis of a hardening spring."""
    spring = system(tmp_path_factory.mktemp("spring"))
    learn, prove = (spring.prepare(recorded(s, cube=0.15, seconds=10.0)) for s in (21, 22))
    kinds = [k for k in spring.library if k.name == "cubic" and k.place.name == "deflection"]
    return analyse(begin(spring, [learn], [prove]), kinds)


def stopped(finished, done):
    """The same analysis after this number of steps."""
    a = begin(finished.system, finished.training.records, finished.held_out.records)
    if done > 0:
        a = replace(a, base=finished.base, held_out=finished.held_out, training=finished.training)
    if done > 1:
        a = replace(a, before=finished.before, operating_region=finished.operating_region)
    if done > 2:
        a = replace(a, named=finished.named, headline=finished.headline)
    if done > 5:
        a = replace(a, held_out_runs=finished.held_out_runs, errors=finished.errors)
    return replace(a, done=done)


def explained(a, folder, monkeypatch):
    """Run the command on this analysis; return exit status and output, verdict, memo."""
    monkeypatch.setattr(runs, "open_analysis", lambda *_: a)
    report, verdict_file = folder / "report", folder / "verdict.json"
    command = ["explain", "--vehicle", str(folder / "spring.toml"), "run"]
    done = CliRunner().invoke(app, [*command, "--json", str(verdict_file), "--report", str(report)])
    tree = json.loads(verdict_file.read_text("utf-8"))
    jsonschema.validate(tree, SCHEMA)
    memo = report / "memo.html"
    return done, tree, memo.read_text("utf-8") if memo.exists() else ""


@pytest.mark.parametrize("step", range(len(STEPS)))
def test_a_step_that_fails_loses_nothing_that_was_found_before(
    hardening, step, tmp_path, monkeypatch
):
    steps = (*STEPS[:step], broken, *STEPS[step + 1 :])
    monkeypatch.setattr(explain, "STEPS", steps)
    done, tree, memo = explained(stopped(hardening, step), tmp_path, monkeypatch)
    assert done.exit_code == 1
    assert "Traceback" not in done.output
    assert tree["failure"].startswith(f"{NAMES[step]}: IndexError: list index out of range")
    assert not tree["complete"]
    assert tree["mismatch"]["found"] is (True if step > 1 else None)
    assert bool(tree["effects"]) == (step > 2)
    assert NAMES[step] in memo
    assert (tmp_path / "report" / "spring.improved.toml").exists() == (step > 0)


@pytest.mark.parametrize("step", [0, 1, 2, 5])
def test_an_interruption_concludes_nothing_that_was_not_tested(
    hardening, step, tmp_path, monkeypatch
):
    def interrupt(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(explain, "STEPS", (*STEPS[:step], interrupt, *STEPS[step + 1 :]))
    done, tree, _ = explained(stopped(hardening, step), tmp_path, monkeypatch)
    assert done.exit_code == 130
    assert tree["failure"] == ""
    assert tree["mismatch"]["found"] is (True if step > 1 else None)
    assert (tree["mismatch"]["p_value"] is None) == (step < 2)
    assert ("no conclusion" in done.output) == (step < 2)


@pytest.mark.parametrize(
    ("where", "what"),
    [
        (conclude, "estimates"),
        (memo_page, "curve_svg"),
        (output, "memo_page"),
        (output, "improved_system"),
    ],
)
def test_a_result_that_cannot_be_made_leaves_the_others(
    hardening, where, what, tmp_path, monkeypatch
):
    monkeypatch.setattr(where, what, broken)
    finished = replace(hardening, failure="")
    done, tree, memo = explained(finished, tmp_path, monkeypatch)
    assert tree["mismatch"]["found"] is True
    assert tree["held_out"] or where is conclude
    if where is memo_page:
        assert "Not drawn: figure: IndexError" in memo
    else:
        assert done.exit_code == 1
        assert "IndexError" in tree["failure"]
    assert bool(memo) == (what != "memo_page")


def test_input_that_cannot_be_used_at_all_is_an_input_error(hardening, monkeypatch):
    def refuse(*_):
        raise InputError("no")

    monkeypatch.setattr(explain, "STEPS", (refuse, *STEPS[1:]))
    with pytest.raises(InputError):
        run_analysis(stopped(hardening, 0))


def test_the_memo_quotes_the_trace_of_the_effect_of_a_model_file(hardening):
    effect = verdict(hardening).effects[0]
    assert effect.name == "cubic"
    page = hardening.named.fit.effects[0].kind.page()["Trace"]
    assert effect.trace == " ".join(page.split())
    assert effect.trace


def test_the_memo_leads_with_the_finding_then_figure_hypotheses_and_what_is_open(hardening):
    page = memo_page.memo_page(hardening, verdict(hardening))
    order = [
        "against the re-calibrated file",
        'aria-label="held_out"',
        "<h2>Hypotheses</h2>",
        "What cannot be told apart",
        "What was not excited",
        "Missing effects",
        "Errors on held-out recordings",
    ]
    places = [page.index(words) for words in order]
    assert places == sorted(places)
    assert "Not drawn" not in page
    assert "@media print" in page
    assert "src=" not in page
    assert 'href="http' not in page


def test_the_table_of_hypotheses_has_the_gains_of_what_stands_on_both_sets(hardening):
    result = verdict(hardening)
    first = hypotheses(hardening, result)[0]
    assert first.stands
    assert first.name == "cubic.deflection"
    assert first.training == hardening.named.log_likelihood_gain
    assert first.held_out == result.improvement.log_likelihood_gain > 0.0


def test_the_memo_says_along_what_a_named_effect_acts(hardening):
    assert verdict(hardening).effects[0].regressor == "deflection"
    assert "cubic.deflection" in hardening.named.names
