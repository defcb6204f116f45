"""Laws of the quick look: margins are the gate's, verdicts follow from figures, pooling keeps 95 %."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from slipbench.bench.trials.preparation import prepare
from slipbench.bench.trials.run import run_trial
from slipbench.identification.response.identify import identify
from slipbench.identification.response.response import FrequencyResponse
from slipbench.identification.session.measures import (
    Measures,
    measures,
    response_from,
    response_tree,
)
from slipbench.identification.session.pooled import pooled
from slipbench.identification.session.quick_look import look_tree, quick_look_of
from slipbench.identification.session.repeatability import Repeatability, repeatability
from slipbench.identification.session.verdict import verdict
from slipbench.protocol.recording.run_folder import read
from tests.bench.session.plans import EXCITATION, trial_file

FREQUENCY = np.linspace(0.5, 12, 116)
SEED = 20261125


def truth(frequency: np.ndarray = FREQUENCY) -> np.ndarray:
    """A lag of 4 Hz with 15 ms of dead time."""
    return 0.2 * np.exp(-2j * np.pi * frequency * 0.015) / (1 + 1j * frequency / 4)


def measured(
    generator: np.random.Generator, noise: float = 0.004, factor: complex = 1.0
) -> FrequencyResponse:
    """The true response with complex noise of standard deviation `noise` on each line."""
    n = FREQUENCY.size
    error = noise * (generator.standard_normal(n) + 1j * generator.standard_normal(n)) / np.sqrt(2)
    value = factor * truth() + error
    coherence = np.full(n, 0.99)
    deviation = np.full(n, noise)
    return FrequencyResponse(
        "throttle_command", "slip", FREQUENCY, value, coherence, deviation, 2.0, "made"
    )


def generator() -> np.random.Generator:
    print(f"seed {SEED}")
    return np.random.default_rng(SEED)


def test_noise_alone_is_seldom_a_difference_and_a_change_of_a_tenth_always_is():
    made = generator()
    chances = []
    for _ in range(300):
        found = repeatability(measured(made), measured(made))
        chances.append(found.chance)
        assert found.distance == pytest.approx(found.expected, rel=0.5)
    assert np.mean(np.array(chances) < 0.05) == pytest.approx(0.05, abs=0.04)
    for _ in range(30):
        found = repeatability(measured(made, factor=1.15), measured(made))
        assert found.chance < 1e-6
        assert found.distance > 0.1


def test_the_interval_of_a_pooled_response_holds_the_truth_in_95_percent():
    """Also where the runs differ by more than their own noise: the Birge ratio widens it."""
    made = generator()
    for spread in (0.0, 0.02):
        inside = []
        for _ in range(200):
            runs = [
                measured(made, factor=1 + spread * made.standard_normal(2) @ (1, 1j))
                for _ in range(4)
            ]
            found = pooled(runs)
            near = np.abs(np.real((found.value - truth()) * np.exp(-1j * np.angle(truth()))))
            inside.append(np.mean(near <= found.gain_band))
        print(f"spread {spread}: {np.mean(inside):.3f} of the lines inside")
        assert 0.90 <= np.mean(inside) <= 0.985


def test_one_run_is_its_own_pool_and_more_runs_narrow_the_interval():
    made = generator()
    runs = [measured(made) for _ in range(9)]
    assert pooled(runs[:1]) is runs[0]
    assert np.median(pooled(runs).deviation) < 0.5 * np.median(runs[0].deviation)
    with pytest.raises(ValueError, match="no response"):
        pooled([])


def test_a_response_survives_the_file():
    made = measured(generator())
    again = response_from(json.loads(json.dumps(response_tree(made))))
    assert np.array_equal(again.value, made.value)
    assert again.stride == made.stride


FINE = Measures(
    "run",
    "sweep",
    "throttle",
    "2 %",
    "gear 2, 14000 rpm",
    measured(np.random.default_rng(1)),
    planned=(0.5, 12.0),
    band=(0.5, 12.0),
    covered=1.0,
    coherence=0.99,
    margins={"slip": 0.4, "engine_speed": 0.9, "throttle_deviation": 0.0},
    larger=3.0,
)


@pytest.mark.parametrize(
    ("changes", "word", "reason"),
    [
        ({}, "good", "0.5 to 12.0 Hz reliable"),
        (
            {"trip": "slip", "detail": "slip of 8.1%"},
            "other amplitude",
            "slip of 8.1%; 1.4 % instead of 2 %",
        ),
        ({"trip": "brake", "detail": "brake at 3 bar"}, "repeat", "the rider braked"),
        ({"trip": "of_next_year"}, "repeat", "of_next_year"),
        ({"late": "9 ticks"}, "repeat", "timing is invalid: 9 ticks"),
        ({"clipping": 0.02}, "other amplitude", "at its stop for 2.0%"),
        ({"margins": {"slip": 0.05}}, "other amplitude", "only 5% of the range to limits.slip"),
        ({"covered": 0.5, "margins": {"slip": 0.8}}, "other amplitude", "3 % instead of 2 %"),
        ({"covered": 0.5, "margins": {"slip": 0.8}, "larger": 1.0}, "repeat", "50% of the planned"),
        ({"coherence": 0.7}, "repeat", "median coherence is 0.70"),
        ({"response": None, "no_response": "closed loop"}, "go on", "closed loop"),
        ({"response": None, "actuator": "", "no_response": "no teeth"}, "repeat", "no teeth"),
        ({"repeatability": Repeatability(0.2, 0.03, 1e-9, 20)}, "repeat", "differs by 20%"),
        ({"repeatability": Repeatability(0.2, 0.2, 0.4, 20)}, "good", ""),
        ({"repeatability": Repeatability(0.05, 0.01, 1e-9, 20)}, "good", ""),
    ],
)
def test_the_verdict_follows_from_the_figures(changes, word, reason):
    found = verdict(replace(FINE, **changes))
    assert found.word == word
    assert reason in found.reason
    spoilt = {"trip", "clipping"} & set(changes) or found.word == "repeat"
    assert found.counts == (not spoilt)


def run(folder: Path, name: str, **tables: dict) -> Path:
    file = folder / trial_file(folder, excitation={**EXCITATION, "duration": "6 s"}, **tables)
    run_trial(prepare(file), folder / name, None)
    return folder / name


def test_the_margin_to_the_slip_limit_is_that_of_the_gate(tmp_path):
    """A limit just above the measured peak does not trip, one just below it does."""
    peak = 0.08 * (1 - quick_look_of(run(tmp_path, "a")).measures.margins["slip"])
    for factor, trip, margin in ((1.01, "", 0.01), (0.99, "slip", 0.0)):
        limit = {"slip": f"{100 * factor * peak:.4f} %"}
        figures = quick_look_of(run(tmp_path, f"at-{factor}", limits=limit)).measures
        assert figures.trip == trip
        assert figures.margins["slip"] == pytest.approx(margin, abs=0.02)


def test_clipping_is_the_share_that_the_actuator_did_not_follow(tmp_path):
    found = identify(read(run(tmp_path, "free")))
    assert measures(found).clipping == 0.0
    command = found.base.signals["throttle_command"]
    part = command[found.window.exciting]
    middle, amplitude = np.median(part), np.ptp(part) / 2
    clipped = np.minimum(command, middle + amplitude / 2)
    base = replace(found.base, signals={**found.base.signals, "throttle_command": clipped})
    share = measures(replace(found, base=base)).clipping
    held = 6.0 / (6.0 + 1.0 + 0.5)  # excitation in the time with authority
    assert share == pytest.approx(held * np.mean(part > middle + amplitude / 2), abs=0.05)
    assert share > 0.2


def test_a_recording_without_its_end_or_its_frames_gets_a_verdict(tmp_path):
    whole = run(tmp_path, "whole")
    look = look_tree(quick_look_of(whole))
    assert look["verdict"] == "good"
    json.dumps(look, allow_nan=False)
    (whole / "frames.log").write_bytes((whole / "frames.log").read_bytes()[:100_000])
    assert look_tree(quick_look_of(whole))["verdict"] == "repeat"
    (whole / "frames.log").write_bytes(b"")
    look = look_tree(quick_look_of(whole))
    assert look["verdict"] == "repeat"
    assert "cannot be identified" in look["reason"]
