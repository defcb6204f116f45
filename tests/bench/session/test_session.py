"""Laws of a session plan: what is read, what is run, in which order, and when a run is repeated."""

from dataclasses import replace
from pathlib import Path

import pytest

from slipbench.bench.session.plan_file import read_plan
from slipbench.bench.session.planned_runs import planned_runs
from slipbench.bench.session.rider_line import ArmingWatch, instruction
from slipbench.bench.session.session import open_session, run_session, usable_runs
from slipbench.bench.session.session_folder import locked
from slipbench.bench.trials.connection import Connection
from slipbench.bench.trials.preparation import prepare
from slipbench.bench.trials.run import run_trial
from slipbench.protocol.configuration import load_toml, parse
from slipbench.protocol.errors import InputError
from slipbench.protocol.recording.tags import write_tags
from slipbench.protocol.trial_file import RPM, TrialFile
from slipbench.session_commands import look
from tests.bench.session.plans import EXCITATION, plan_file, trial_file
from tests.bench.test_commands import run as slipbench
from tests.paths import TRIALS


def runs_of(path: Path, folder: Path):
    return planned_runs(read_plan(path), path, folder)


@pytest.mark.parametrize(
    ("order", "names"), [("fixed", "a-1 a-2 a-3 b-1"), ("interleaved", "a-1 b-1 a-2 a-3")]
)
def test_the_order_of_the_runs(tmp_path, order, names):
    path = plan_file(tmp_path, {"name": "a", "repeats": 3}, {"name": "b"}, order=order)
    assert " ".join(run.name for run in runs_of(path, tmp_path)) == names


def test_repeats_differ_in_the_seed_of_the_simulation_only(tmp_path):
    first, second = runs_of(plan_file(tmp_path, {"repeats": 2}), tmp_path)
    assert first.file["seed"] != second.file["seed"]
    assert {**first.file, "seed": 0} == {**second.file, "seed": 0}


def test_a_window_of_speed_is_one_of_crank_speed_in_that_gear(tmp_path):
    path = plan_file(tmp_path, {"gear": 3, "speed": ["40 m/s", "42 m/s"]})
    (run,) = runs_of(path, TRIALS)
    trial = parse(dict(run.file), TrialFile, where="trial")
    vehicle = prepare_vehicle(run)
    per_speed = vehicle.gears[2] / vehicle.rear_wheel.radius
    point = trial.operating_point
    assert point.gear == 3
    low, high = (
        point.engine_speed - point.engine_speed_window,
        point.engine_speed + point.engine_speed_window,
    )
    assert low >= 40 * per_speed - 0.1
    assert high <= 42 * per_speed + 0.1
    assert high - low == pytest.approx(2 * per_speed, rel=0.01)


def prepare_vehicle(run):
    from slipbench.bench.vehicle.virtual_motorcycle import read_vehicle

    return read_vehicle((TRIALS / run.file["vehicle"]).resolve()).motorcycle


@pytest.mark.parametrize(
    ("trial", "words"),
    [
        ({"repaets": 2}, "unknown key 'trial[0].repaets'; did you mean 'repeats'?"),
        ({"repeats": 0}, "trial[0].repeats"),
        ({"name": "a-b"}, "trial[0].name"),
        ({"file": "no_such_sweep"}, "expected: a path, or one of"),
        ({"excitation": {**EXCITATION, "stpo": "1 Hz"}}, "excitation.stpo"),
        ({"actuator": "spark", "amplitude": "3 deg"}, "replaces the whole table"),
        ({"excitation": None, "actuator": "spark"}, "actuator needs an amplitude"),
        ({"excitation": None, "amplitude": "3 deg"}, "excitation.amplitude"),
        ({"gear": 7}, "operating_point"),
        ({"gear": 8, "speed": ["40 m/s", "41 m/s"]}, "the vehicle has no such gear"),
        ({"engine_speed": ["14000 rpm", "13000 rpm"]}, "the lower bound comes first"),
        ({"engine_speed": ["14000", "15000 rpm"]}, "the unit is missing"),
        ({"engine_speed": ["13000 rpm", "14000 rpm"], "speed": ["40 m/s", "41 m/s"]}, "both state"),
        ({"excitation": {**EXCITATION, "amplitude": "9 %"}}, "limits.throttle_deviation"),
    ],
)
def test_a_users_mistake_ends_with_2_before_anything_runs(
    monkeypatch, capsys, tmp_path, trial, words
):
    path = plan_file(tmp_path, trial)
    out = tmp_path / "out"
    status, _, err = slipbench(monkeypatch, capsys, "session", path, "--out", out, "--simulate")
    assert status == 2
    assert words in err
    assert "Traceback" not in err
    assert not list((out / "runs").glob("*"))


def test_a_session_needs_one_place_to_run(monkeypatch, capsys, tmp_path):
    path = plan_file(tmp_path)
    for options in ((), ("--simulate", "--interface", "slipbench")):
        status, _, err = slipbench(
            monkeypatch, capsys, "session", path, "--out", tmp_path / "out", *options
        )
        assert status == 2
        assert "one of --interface, --simulate, --real-time" in err


def test_a_run_that_tripped_is_repeated_as_often_as_the_plan_says(monkeypatch, capsys, tmp_path):
    base = trial_file(tmp_path, rider={"holds_button_for": "2 s"})
    path = plan_file(tmp_path, {"file": base}, attempts=2)
    out = tmp_path / "out"
    status, said, _ = slipbench(monkeypatch, capsys, "session", path, "--out", out, "--simulate")
    assert status == 3
    assert sorted(each.name for each in (out / "runs").iterdir()) == [
        "sweep-1",
        "sweep-1-attempt-2",
    ]
    assert "sweep-1: repeat: it tripped: the rider let the button go" in said
    with locked(out):
        assert usable_runs(open_session(path, out)) == {"sweep": ()}


def test_a_trial_that_needs_another_amplitude_is_not_run_again_as_it_is(
    monkeypatch, capsys, tmp_path
):
    base = trial_file(tmp_path, limits={"slip": "6 %"})
    large = {**EXCITATION, "amplitude": "4 %", "stop": "9 Hz"}
    trial = {"file": base, "repeats": 3, "excitation": large}
    out = tmp_path / "out"
    arguments = ("session", plan_file(tmp_path, trial), "--out", out, "--simulate")
    status, said, _ = slipbench(monkeypatch, capsys, *arguments)
    assert status == 3
    assert "2.8 % instead of 4 % is proposed" in said
    assert "left out until the plan has another amplitude: sweep-2, sweep-3" in said
    assert [each.name for each in (out / "runs").iterdir()] == ["sweep-1"]
    smaller = {"name": "smaller", "file": base, "excitation": {**large, "amplitude": "1 %"}}
    plan_file(tmp_path, trial, smaller)
    status, said, _ = slipbench(monkeypatch, capsys, *arguments)
    assert sorted(each.name for each in (out / "runs").iterdir()) == ["smaller-1", "sweep-1"]


def test_the_second_repeat_is_compared_with_the_first_and_all_are_usable(tmp_path):
    path, said = plan_file(tmp_path, {"repeats": 2}), []
    with locked(tmp_path / "out"):
        session = open_session(path, tmp_path / "out")
        assert run_session(session, Connection(), look, said.append)
        assert [len(runs) for runs in usable_runs(session).values()] == [2]
    text = "\n".join(said)
    assert text.count("repeatability:") == 1
    assert text.index("sweep 2 of 2") < text.index("repeatability:")


def test_the_line_for_the_rider_states_why_the_trial_is_not_armed(tmp_path):
    """The reason is that of the trial's own state machine, and it is gone once the trial arms."""
    prepared = prepare(trial_of(tmp_path))
    run_trial(prepared, tmp_path / "run", None)
    watch = ArmingWatch(prepared, tmp_path / "run", ("can0",))
    assert watch.reason() == ""
    for changes, words in (
        ({"gear": 3}, "gear 2, the trial requires 3"),
        ({"engine_speed": 9000 * RPM}, "the trial requires 9000 +- 400 rpm"),
    ):
        point = prepared.trial.operating_point.model_copy(update=changes)
        other = prepared.trial.model_copy(update={"operating_point": point})
        plan = replace(prepared.plan, trial=other)
        watch = ArmingWatch(replace(prepared, plan=plan), tmp_path / "run", ("can0",))
        assert words in watch.reason()
    assert instruction(prepared.trial).startswith("gear 2, 13600 to 14400 rpm for 500 ms; then")


def test_the_line_is_the_same_however_the_log_is_cut_into_pieces(tmp_path):
    prepared = prepare(trial_of(tmp_path))
    run_trial(prepared, tmp_path / "run", None)
    text = (tmp_path / "run" / "frames.log").read_bytes()
    (tmp_path / "live").mkdir()
    watch = ArmingWatch(prepared, tmp_path / "live", ("can0",))
    assert watch.reason() == "the recording has not begun"
    with (tmp_path / "live" / "frames.log").open("wb", buffering=0) as log:
        for begin in range(0, len(text), 99_991):
            log.write(text[begin : begin + 99_991])
            watch.reason()
    whole = ArmingWatch(prepared, tmp_path / "run", ("can0",))
    assert watch.reason() == whole.reason()
    assert watch._now == whole._now


def trial_of(folder: Path) -> Path:
    tree = load_toml(TRIALS / "throttle_sweep.toml")
    return folder / trial_file(folder, excitation={**tree["excitation"], **EXCITATION})


def test_the_tags_of_the_plan_go_into_the_run_beside_those_written_while_it_ran(tmp_path):
    tags = {"track": "Mugello", "mileage": 812, "temperature": 23.5}
    path, folder = plan_file(tmp_path, tags=tags), tmp_path / "day"

    def tag_it(line):
        if "exciting" in line:
            write_tags(folder / "runs" / "sweep-1", {"tyre": "new"})

    good = {"verdict": "good", "reason": "", "counts": True, "lines": []}
    with locked(folder):
        run_session(open_session(path, folder), Connection(), lambda *_: good, tag_it)
    description = load_toml(folder / "runs" / "sweep-1" / "run.toml")
    assert description["tags"] == {**tags, "tyre": "new"}
    assert description["outcome"]["phase"] == "done"


def test_a_key_that_no_tag_can_have_is_refused(tmp_path):
    with pytest.raises(InputError, match="Tyre"):
        read_plan(plan_file(tmp_path, tags={"Tyre": "new"}))
