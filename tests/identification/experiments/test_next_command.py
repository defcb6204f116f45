"""The command `next`: a trial file that the bench runs, or a message that says what to do."""

import re
import shutil
from pathlib import Path

import pytest

from slipbench.bench.trials.preparation import prepare
from slipbench.bench.trials.run import run_trial
from slipbench.identification.experiments import search
from slipbench.identification.mismatch.runs import open_analysis
from slipbench.identification.mismatch.simulation.piece import Piece
from slipbench.plant.vehicles import builtin_vehicle
from slipbench.protocol.configuration import load_toml
from tests.bench.test_commands import run as slipbench
from tests.identification.experiments.folders import analysis_folder

QUICK = search.Effort(refined=1, rounds=1, offered=1, drawn=1)


@pytest.fixture(scope="module")
def analysis(tmp_path_factory):
    return analysis_folder(tmp_path_factory.mktemp("analysis") / "memo", ("nothing", "backlash"))


def test_the_designed_trial_runs_in_the_limits_of_the_recorded_one(
    analysis, monkeypatch, capsys, tmp_path
):
    monkeypatch.setattr(search, "THOROUGH", QUICK)
    out = tmp_path / "next.toml"
    arguments = ("next", analysis, "--straight", "900m", "--out", out)
    status, said, err = slipbench(monkeypatch, capsys, *arguments)
    assert (status, "Traceback" in err) == (0, False), err
    assert re.search(r"shows whether there is backlash \(expected log-likelihood ratio", said)
    tree, recorded = load_toml(out), load_toml(analysis / "run" / "trial.toml")
    kept = {key: value for key, value in tree["limits"].items() if key != "distance"}
    assert kept.items() <= recorded["limits"].items()
    assert float(tree["limits"]["distance"].split()[0]) <= 900.0
    outcome = run_trial(prepare(out), tmp_path / "run", None)
    assert outcome.done, outcome.trip
    status, _, err = slipbench(monkeypatch, capsys, *arguments)
    assert status == 2
    assert "nothing is overwritten" in err


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--straight", "900 Hz"), "--straight"),
        (("--straight", "900m", "--between", "backlash"), "two or more hypotheses"),
        (("--straight", "900m", "--between", "nothing,backlsh"), "did you mean 'backlash'"),
        (("--straight", "900m", "--trial", "absent.toml"), "absent.toml"),
        (("--straight", "150m", "--between", "nothing,backlash"), "longer straight"),
    ],
)
def test_a_mistake_ends_with_2_and_nothing_is_written(
    analysis, monkeypatch, capsys, tmp_path, options, words
):
    out = tmp_path / "next.toml"
    status, _, err = slipbench(monkeypatch, capsys, "next", analysis, "--out", out, *options)
    assert status == 2
    assert words in err
    assert "Traceback" not in err
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (None, "no analysis lies in this folder"),
        ("{", "not valid JSON"),
        ("[]", "expected: a table"),
        ('{"version": 1, "vehicle": "a", "improvd": "b", "runs": []}', "did you mean 'improved'"),
        ('{"version": 9, "vehicle": "a", "improved": "b", "runs": []}', "another version"),
        (
            '{"version": 1, "vehicle": "a", "improved": "v.improved.toml", "runs": []}',
            "none of the recordings",
        ),
    ],
)
def test_a_folder_without_a_readable_analysis_is_refused(
    analysis, monkeypatch, capsys, tmp_path, text, words
):
    folder = tmp_path / "broken"
    folder.mkdir()
    shutil.copyfile(analysis / "run" / "trial.toml", folder / "t.toml")
    shutil.copyfile(analysis / "v.improved.toml", folder / "v.improved.toml")
    if text is not None:
        (folder / "hypotheses.json").write_text(text)
    arguments = ("next", folder, "--straight", "900m", "--out", tmp_path / "out.toml")
    status, _, err = slipbench(monkeypatch, capsys, *arguments)
    assert status == 2
    assert words in err, err
    assert "Traceback" not in err


def test_where_nothing_is_open_the_message_names_the_option(
    monkeypatch, capsys, tmp_path, analysis
):
    folder = tmp_path / "closed"
    shutil.copytree(analysis, folder)
    text = (folder / "hypotheses.json").read_text()
    (folder / "hypotheses.json").write_text(re.sub(r'"questions": .*\]\]', '"questions": []', text))
    status, _, err = slipbench(monkeypatch, capsys, "next", folder, "--straight", "900m")
    assert status == 2
    assert "--between" in err


def test_an_analysis_names_its_recordings_by_paths_that_can_be_read_again(analysis):
    """hypotheses.json has these: the design reads the recordings through them."""
    (name,) = open_analysis(builtin_vehicle("nominal"), [analysis / "run"], []).runs
    assert Path(name) == analysis / "run"
    assert Piece.of(Path(name)).read().frame_count > 0
