"""Laws of designed trials in a session: offered, never ridden without an answer, resumed anywhere."""

import io
import json
import shutil
from dataclasses import dataclass
from itertools import count
from pathlib import Path

import pytest

from slipbench import session_experiment, session_offer
from slipbench.bench.session.designed_runs import answered, designed_runs, offers, write_offer
from slipbench.bench.session.session import open_session, run_session
from slipbench.bench.session.session_folder import locked
from slipbench.bench.trials.connection import Connection
from slipbench.identification.experiments import settling
from slipbench.identification.experiments.sequential_test import RunEvidence
from slipbench.protocol.configuration import load_toml
from slipbench.protocol.errors import InputError
from slipbench.session_commands import look
from tests.bench.session.analyses import NOMINAL, backlash_plan, explained_by_files
from tests.bench.test_commands import run as slipbench


@dataclass
class Day:
    """A session command that can be given again and again."""

    monkeypatch: pytest.MonkeyPatch
    capsys: pytest.CaptureFixture[str]
    folder: Path

    def __post_init__(self):
        self.out = self.folder / "out"
        self.plan = backlash_plan(self.folder)

    def give(self, *more):
        arguments = ("session", self.plan, "--out", self.out, "--simulate", "--explain", NOMINAL)
        arguments = (*arguments, "--straight", "900m", *more)
        return slipbench(self.monkeypatch, self.capsys, *arguments)

    @property
    def runs(self):
        return sorted(path.name for path in (self.out / "runs").iterdir())


@pytest.fixture
def day(monkeypatch, capsys, tmp_path):
    return Day(monkeypatch, capsys, tmp_path)


def without_search(monkeypatch):
    """The design is replaced by a trial that was planned, with another waveform."""

    def fixed(session, *_):
        tree = load_toml(session.trial_path(session.runs[0]))
        wave = {"waveform": "square", "frequency": "1 Hz", "duration": "2 s"}
        kept = {k: v for k, v in tree["excitation"].items() if k not in ("start", "stop")}
        return {**tree, "excitation": {**kept, **wave}}, "A square wave: shows backlash"

    monkeypatch.setattr(session_offer, "designed_trial", fixed)


def test_an_accepted_offer_is_ridden_explained_again_and_settles_the_question(
    day, monkeypatch, planned
):
    """Trial and evidence are given; designs: tests/identification/experiments."""
    calls = explained_by_files(monkeypatch)
    without_search(monkeypatch)
    with_constant_evidence(monkeypatch)
    shutil.copytree(planned, day.folder, dirs_exist_ok=True)
    status, said, err = day.give("--accept")
    assert status == 0, err
    designed = ["designed_1-1", "designed_2-1"]
    assert day.runs == [*designed, "sweep-1", "sweep-2"]
    assert calls == [["sweep-1"], ["sweep-1", *designed[:1]], ["sweep-1", *designed]]
    assert "open: nothing or backlash" in said
    assert "backlash stands, the others are rejected" in said
    assert "settled after 2 designed runs" in said
    report = json.loads((day.out / "session.json").read_text())
    assert report["designed"][0].startswith("designed_1: accepted: ")
    assert "Designed trials" in (day.out / "report.html").read_text()
    status, said, _ = day.give("--accept")
    assert status == 0
    assert len(calls) == 3, "an analysis was repeated"
    assert "\noffer" not in said


def test_nothing_is_ridden_without_an_answer_and_a_refusal_holds(day, monkeypatch, planned):
    explained_by_files(monkeypatch)
    shutil.copytree(planned, day.folder, dirs_exist_ok=True)
    without_search(monkeypatch)
    for _ in range(2):  # there is no terminal to answer at
        status, said, _ = day.give()
        assert status == 0
        assert "not answered: give the same command at a terminal, or with --accept" in said
        assert day.runs == ["sweep-1", "sweep-2"]
    answered(offers(day.out)[0], "declined")
    status, said, _ = day.give("--accept")
    assert "the last offer was declined" in said
    assert day.runs == ["sweep-1", "sweep-2"]


def test_where_nothing_is_open_no_trial_is_offered(day, monkeypatch, planned):
    explained_by_files(monkeypatch, ())
    shutil.copytree(planned, day.folder, dirs_exist_ok=True)
    status, said, _ = day.give("--accept")
    assert status == 0
    assert "no trial is designed: the analysis left nothing open" in said
    assert offers(day.out) == ()


class Killed(BaseException):
    """What ends the process in a test; nothing catches it."""


def with_constant_evidence(monkeypatch):
    """The evidence of a run is given: it rejects nothing, then enough."""

    def evidence_of(asked, earlier, run):
        nats = 10.0 if earlier else 1.0
        return (RunEvidence(run.name, {"nothing": -nats, "backlash": 0.0}),)

    monkeypatch.setattr(settling, "evidence_of", evidence_of)


@pytest.fixture(scope="module")
def planned(tmp_path_factory):
    """Folder of a session whose planned runs are recorded."""
    folder = tmp_path_factory.mktemp("planned")
    plan = backlash_plan(folder)
    with locked(folder / "out"):
        assert run_session(open_session(plan, folder / "out"), Connection(), look, print)
    return folder


KILLS = [
    (session_experiment, "explained", True),
    (session_offer, "designed_trial", True),
    (session_experiment, "accepted", True),
    (session_experiment, "with_evidence", False),
]


@pytest.mark.parametrize(("module", "place", "after"), KILLS)
def test_a_session_that_ends_in_any_step_goes_on_there(
    day, monkeypatch, planned, module, place, after
):
    """Two designed trials settle it, wherever the session ended and however often."""
    explained_by_files(monkeypatch)
    without_search(monkeypatch)
    with_constant_evidence(monkeypatch)
    shutil.rmtree(day.out, ignore_errors=True)
    shutil.copytree(planned, day.folder, dirs_exist_ok=True)
    kept, calls = getattr(module, place), count(1)

    def killed(*arguments):
        if next(calls) == 2:
            if after:
                kept(*arguments)
            raise Killed
        return kept(*arguments)

    with monkeypatch.context() as context:
        context.setattr(module, place, killed)
        with pytest.raises(Killed):
            day.give("--accept")
    status, said, err = day.give("--accept")
    assert status == 0, err
    assert day.runs == ["designed_1-1", "designed_2-1", "sweep-1", "sweep-2"]
    assert [one.answer for one in offers(day.out)] == ["accepted", "accepted"]
    evidence = json.loads((day.out / "designed" / "evidence.json").read_text())
    assert [run[0]["run"] for run in evidence] == ["designed_1-1", "designed_2-1"]
    assert "settled after 2 designed runs" in said


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--accept",), "no --straight"),
        (("--straight", "900m"), "no --explain"),
        (("--straight", "900 Hz", "--explain", NOMINAL), "--straight"),
    ],
)
def test_an_option_that_lacks_another_is_refused(monkeypatch, capsys, tmp_path, options, words):
    plan = backlash_plan(tmp_path)
    arguments = ("session", plan, "--out", tmp_path / "out", "--simulate", *options)
    status, _, err = slipbench(monkeypatch, capsys, *arguments)
    assert status == 2
    assert words in err
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(("reply", "answer"), [("y\n", "accepted"), ("\n", "declined")])
def test_the_answer_at_a_terminal_is_kept_and_no_answer_is_no_consent(
    monkeypatch, tmp_path, reply, answer
):
    class Terminal(io.StringIO):
        def isatty(self):
            return True

    offer = write_offer(tmp_path, 1, load_toml(trial(tmp_path)), "shows backlash")
    monkeypatch.setattr("sys.stdin", Terminal(""))
    with pytest.raises(KeyboardInterrupt):
        session_offer.accepted(offer, False, print)
    assert offers(tmp_path)[0].answer == ""
    monkeypatch.setattr("sys.stdin", Terminal(reply))
    assert session_offer.accepted(offer, False, print) == (answer == "accepted")
    assert offers(tmp_path)[0].answer == answer


def test_a_designed_trial_needs_a_name_of_its_own_and_an_answer_that_can_be_read(tmp_path):
    with locked(tmp_path):
        offer = write_offer(tmp_path, 1, load_toml(trial(tmp_path)), "text")
        assert designed_runs(tmp_path, ()) == (), "not answered"
        (run,) = designed_runs_after(tmp_path, offer)
        assert run.name == "designed_1-1"
        with pytest.raises(InputError, match="same name"):
            designed_runs(tmp_path, (run,))
        offer.path.with_suffix(".json").write_text('{"text": "", "answer": "perhaps"}')
        with pytest.raises(InputError, match="designed anew"):
            offers(tmp_path)


def designed_runs_after(folder, offer):
    answered(offer, "accepted")
    return designed_runs(folder, ())


def trial(folder):
    backlash_plan(folder)
    return folder / "base.toml"
