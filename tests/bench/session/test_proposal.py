"""Laws of a proposed plan: it fits into the straight, and no trial leaves its limits in simulation."""

import random
import re
import tomllib
from pathlib import Path

import pytest
import tomli_w

from slipbench.bench.session.plan_file import read_plan
from slipbench.bench.session.plan_text import folder_of, write_plan
from slipbench.bench.session.planned_runs import planned_runs
from slipbench.bench.session.proposal import propose
from slipbench.bench.session.questions import QUESTIONS, questions_of
from slipbench.bench.session.straight import fittings, length_of
from slipbench.bench.trials.preparation import prepare
from slipbench.bench.trials.run import run_trial
from slipbench.protocol.errors import InputError
from slipbench.protocol.straight import BEFORE, BRAKING
from tests.bench.test_commands import run as slipbench
from tests.paths import DEMONSTRATION

SEED = 1125
# Parameters of the vehicle file that are drawn, and the range of their factor.
DRAWN = {
    ("engine", "peak_torque"): (0.6, 1.3),
    ("engine", "peak_speed"): (0.75, 1.2),
    ("engine", "opening_scale"): (0.7, 1.5),
    ("tyre", "slip_stiffness"): (0.7, 1.3),
    ("body", "mass"): (0.8, 1.3),
    ("driveline", "stiffness"): (0.6, 1.6),
    ("throttle_servo", "damping"): (0.8, 2.0),
}


def drawn_motorcycle(folder: Path, seed: int) -> Path:
    """Write a vehicle file with drawn parameters and some of the effects."""
    print(f"seed {seed}")
    draw = random.Random(seed)
    tree = tomllib.loads(DEMONSTRATION.read_text(encoding="utf-8"))
    for (block, name), (low, high) in DRAWN.items():
        tree[block][name]["value"] *= draw.uniform(low, high)
    gearing = draw.uniform(0.85, 1.15)
    for ratio in tree["gears"].values():
        ratio["value"] *= gearing
    tree["effects"] = [effect for effect in tree["effects"] if draw.random() < 0.7]
    path = folder / f"drawn-{seed}.toml"
    path.write_text(tomli_w.dumps(tree), encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("seed", "straight", "question"),
    [
        (SEED, 700.0, "throttle_response"),
        (SEED + 1, 900.0, "steps"),
        (SEED + 2, 1200.0, "distortion"),
        (SEED + 3, 600.0, "spark_response"),
    ],
)
def test_no_proposed_trial_leaves_its_limits_in_simulation(tmp_path, seed, straight, question):
    vehicle, plan = drawn_motorcycle(tmp_path, seed), tmp_path / "plan.toml"
    proposed = propose(vehicle, straight, questions_of(question), folder_of(plan), print)
    write_plan(proposed, plan, vehicle, straight)
    runs = planned_runs(read_plan(plan), plan, tmp_path)
    assert len(runs) == QUESTIONS[question].repeats
    last = {**runs[-1].file, "seed": seed}  # noise that the proposal has not seen
    (tmp_path / "last.toml").write_text(tomli_w.dumps(last))
    outcome = run_trial(prepare(tmp_path / "last.toml"), tmp_path / "run", None)
    assert outcome.done, outcome.trip


def test_an_amplitude_falls_until_the_simulation_leaves_the_margin(tmp_path):
    """On a tyre of a tenth of the stiffness, the first amplitudes use up the range of the slip."""
    tree = tomllib.loads(DEMONSTRATION.read_text(encoding="utf-8"))
    tree["tyre"]["slip_stiffness"]["value"] *= 0.1
    tree["effects"] = []
    vehicle, said = tmp_path / "soft.toml", []
    vehicle.write_text(tomli_w.dumps(tree), encoding="utf-8")
    asked = questions_of("throttle_response")
    (one,) = propose(vehicle, 700.0, asked, tmp_path, said.append)
    amplitudes = [line.split()[1] for line in said[1:]]
    assert len(amplitudes) > 1
    assert all("slip of" in line for line in said[1:-1])
    assert one.file["excitation"]["amplitude"] == f"{amplitudes[-1]} %"


def test_a_proposal_fits_into_the_straight_with_the_way_to_brake(tmp_path):
    for seed in range(SEED, SEED + 20):
        vehicle = drawn_motorcycle(tmp_path, seed)
        for straight in (500.0, 700.0, 1000.0, 2000.0):
            try:
                found = fittings(vehicle, straight)
            except InputError as fault:
                needed = float(fault.expected.split()[2])
                assert needed > straight, "refused, although the message states less"
                continue
            for one in found:
                used = one.speed * BEFORE + one.distance + one.speed**2 / (2 * BRAKING)
                assert used <= straight
                assert one.speed * (one.duration + 1.5) <= one.distance


def test_what_is_proposed_is_good_in_the_session_and_no_plan_is_overwritten(
    monkeypatch, capsys, tmp_path
):
    """Each question of the plan is answered: each run has a response and is found good."""
    plan, out = tmp_path / "monday.toml", tmp_path / "out"
    asked = ",".join(QUESTIONS)
    arguments = ("plan", "demonstration", "--straight", "900m", "--questions", asked, "--out", plan)
    status, said, _ = slipbench(monkeypatch, capsys, *arguments)
    assert (status, said) == (0, f"{plan}\n")
    status, _, err = slipbench(monkeypatch, capsys, *arguments)
    assert status == 2
    assert "nothing is overwritten" in err
    once = tmp_path / "once.toml"
    once.write_text(re.sub(r"repeats = \d+", "repeats = 1", plan.read_text()))
    status, said, _ = slipbench(monkeypatch, capsys, "session", once, "--out", out, "--simulate")
    assert status == 0
    for name in QUESTIONS:
        assert f"{name}-1: good: " in said


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--straight", "100m"), "the straight is too short for this motorcycle"),
        (("--straight", "900 Hz"), "--straight"),
        (("--straight", "20 km"), "no straight has this length"),
        (("--straight", "900m", "--questions", "grip"), "unknown question"),
        (("--straight", "900m", "--questions", ","), "no question"),
    ],
)
def test_a_mistake_ends_with_2_and_nothing_is_written(
    monkeypatch, capsys, tmp_path, options, words
):
    plan = tmp_path / "plan.toml"
    arguments = ("plan", "demonstration", "--out", plan, *options)
    status, _, err = slipbench(monkeypatch, capsys, *arguments)
    assert status == 2
    assert words in err
    assert "Traceback" not in err
    assert list(tmp_path.iterdir()) == []


def test_a_length_is_read_with_and_without_a_space():
    assert length_of("900m") == length_of("900 m") == length_of("0.9 km") == 900.0
