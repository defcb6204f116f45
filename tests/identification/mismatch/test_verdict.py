"""verdict.json conforms to its published schema for every result."""

import json
from dataclasses import replace
from importlib.resources import files
from pathlib import Path

import jsonschema
import pytest

from slipbench.identification.mismatch.fit.floor import LackOfFit
from slipbench.identification.mismatch.fit.held_out import Error, veto
from slipbench.identification.mismatch.naming.interval import Estimate
from slipbench.identification.mismatch.reporting.improvement import (
    Change,
    Improvement,
    OutputImprovement,
)
from slipbench.identification.mismatch.reporting.memo import left_out, lines, sentence, with_spread
from slipbench.identification.mismatch.reporting.output import prepare_places, with_training
from slipbench.identification.mismatch.reporting.verdict import (
    INTERVALS,
    FoundCurve,
    FoundEffect,
    Location,
    Verdict,
    as_json,
)
from slipbench.protocol.errors import InputError

SCHEMA = json.loads(
    (files("slipbench.identification.mismatch.reporting") / "verdict.schema.json").read_text()
)
WHERE = Location(
    "driveline",
    "driveline torque",
    "twist",
    "a kink about 0",
    500.0,
    400.0,
    (6.0, 12.0),
    (1000.0, 1400.0),
    "both",
    "engine speed",
    "rad/s",
)
SLACK = FoundEffect(
    "backlash", "", "driveline", (Estimate("slack", "rad", 12.2e-3, 11.8e-3, 12.6e-3),), 3000.0
)
TEETH = Error("rear_teeth", "rad/s", 0.41, 0.2, 0.12, 0.11, "repeated trials", (0.2, 0.4))
DELAY = Improvement(
    365.0,
    (280.0, 450.0),
    (
        OutputImprovement(
            "rear_teeth",
            "rad/s",
            0.7,
            Change(0.02975, 0.02977, (0.985, 1.016)),
            Change(0.0105, 0.0098, (0.91, 0.95)),
            (3.0, 9.0),
            Change(0.004, 0.003, (0.6, 0.9)),
        ),
    ),
)
"""A true delay of 2 ms: the full reduction of the simulation error is calibration."""
FALLS = Improvement(
    2000.0,
    (1500.0, 2500.0),
    (
        OutputImprovement(
            "rear_teeth",
            "rad/s",
            1.0,
            Change(0.2, 0.12, (0.5, 0.7)),
            Change(0.02, 0.01, (0.4, 0.6)),
        ),
    ),
)
VERDICTS = {
    "nothing": Verdict(False, 1.0),
    "interrupted": Verdict(True, 0.01, WHERE, complete=False),
    "interrupted at once": Verdict(None, None, complete=False),
    "interrupted later": Verdict(None, 0.4, complete=False),
    "failed": Verdict(None, None, complete=False, failure="calibration: ValueError: no"),
    "named": Verdict(
        True,
        1e-9,
        WHERE,
        (SLACK,),
        equivalents=(("backlash", "hardening_cush"),),
        rivals={"backlash": {"hardening_cush": 4.0}},
        not_excited=("rate_limit",),
        next_trial={"why": "it would", "trial": {"name": "next_trial"}},
        improvement=FALLS,
        vetoes=(veto("hardening_cush", -12.0, 5.0),),
        held_out=(TEETH,),
        headline="rear_teeth",
        lack_of_fit=(LackOfFit((("a", "b"),), 3.0, 1e-3),),
    ),
    "unknown": Verdict(
        True,
        1e-9,
        WHERE,
        unknown=True,
        shape="a dead zone",
        held_out=(TEETH,),
        curve=FoundCurve("driveline torque", "N m", "twist", (0.0, 1.0), (0.0, 2.0), 9.0, 8.0),
    ),
}


@pytest.mark.parametrize("name", VERDICTS)
def test_every_verdict_keeps_to_the_schema(name):
    jsonschema.validate(json.loads(as_json(VERDICTS[name])), SCHEMA)
    assert lines(VERDICTS[name])


def test_the_first_sentence_names_place_size_and_proof():
    said = sentence(VERDICTS["named"])
    assert said.startswith("The driveline has backlash (slack 12.2 +- 0.4 mrad)")
    assert (
        "the simulation error of rear teeth falls by 40 % (95 %: 30 to 50 %) against the"
        " re-calibrated file, from 0.2 to 0.12 rad/s;"
        " held-out log-likelihood gain 2000 nats (95 %: 1500 to 2500)"
    ) in said


def test_an_improvement_that_is_all_calibration_is_not_said_to_be_one_of_the_effect():
    """The error falls from 0.11 to 0.03 by calibration, and not by the effect."""
    teeth = replace(TEETH, nominal=0.11, calibrated=0.02975, improved=0.02977)
    verdict = replace(VERDICTS["named"], held_out=(teeth,), improvement=DELAY)
    said = sentence(verdict)
    assert (
        "no simulation error falls measurably against the re-calibrated file (rear teeth: 0.02975"
        " re-calibrated, 0.02977 rad/s improved, ratio 0.985 to 1.016)"
    ) in said
    assert "the error from 3 to 9 Hz of rear teeth falls by 25 % (95 %: 10 to 40 %)" in said
    assert "gain 365 nats (95 %: 280 to 450)" in said
    assert "0.11" not in said


def test_an_error_that_rises_is_said_to_rise():
    worse = replace(FALLS.outputs[0], simulation=Change(0.356, 0.382, (1.02, 1.12)))
    said = sentence(
        replace(VERDICTS["named"], improvement=replace(FALLS, outputs=(worse,)), headline="")
    )
    assert "no simulation error falls measurably" in said
    assert "that of rear teeth rises from 0.356 to 0.382 rad/s (ratio 1.020 to 1.120)" in said


def test_the_regressor_and_what_intervals_hold_for_are_always_said():
    along = replace(SLACK, regressor="twist")
    text_lines = lines(replace(VERDICTS["named"], effects=(along,)))
    assert "  backlash acts along the twist" in text_lines
    assert f"  {INTERVALS}" in text_lines
    assert json.loads(as_json(VERDICTS["named"]))["intervals"] == INTERVALS


def test_a_veto_is_data():
    tree = json.loads(as_json(VERDICTS["named"]))
    assert tree["version"] == 6
    assert tree["vetoes"] == [
        {
            "name": "hardening_cush",
            "gain": -12.0,
            "least": 5.0,
            "reason": "the held-out log-likelihood changes by -12 nats, and would rise by at least"
            " 5 nats if it were right",
        }
    ]


def test_an_alarm_and_its_probability_agree():
    for verdict in VERDICTS.values():
        if verdict.p_value is not None and verdict.mismatch is not None:
            assert verdict.mismatch == (verdict.p_value < 0.05)


def test_no_mismatch_is_claimed_only_after_all_tests():
    said = {name: sentence(verdict) for name, verdict in VERDICTS.items()}
    assert said["interrupted at once"] == (
        "Interrupted before any test was complete: no conclusion."
    )
    assert said["failed"] == "The analysis failed before any test was complete: no conclusion."
    assert said["interrupted later"].startswith("Interrupted before all tests were complete")
    tree = json.loads(as_json(VERDICTS["interrupted at once"]))
    assert tree["mismatch"] == {"found": None, "p_value": None}


def test_a_failure_is_named_first():
    first = lines(VERDICTS["failed"])[0]
    assert first.startswith("The analysis failed in calibration: ValueError: no.")


def test_what_was_left_out_of_several_recordings_is_said_once():
    result = Verdict(
        False,
        1.0,
        left_out=(
            *("a: lean_angle: nobody sends it", "b: lean_angle: nobody sends it", "b: x"),
            *("a: brake: nobody sends it", "b: brake: nobody sends it", "b: gear: nobody sends it"),
        ),
    )
    assert list(left_out(result)) == [
        "lean_angle, brake: nobody sends it (a, b)",
        "x (b)",
        "gear: nobody sends it (b)",
    ]
    assert sum("left out" in line for line in lines(result)) == 3


def test_places_are_made_before_the_work_and_refused_before_it(tmp_path):
    prepare_places(tmp_path / "new" / "verdict.json", tmp_path / "also" / "report")
    assert (tmp_path / "new").is_dir()
    assert (tmp_path / "also" / "report").is_dir()
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="give another place"):
        prepare_places(tmp_path / "file" / "verdict.json", None)


@pytest.mark.parametrize(
    ("value", "spread", "told"),
    [
        (99.84, 4.2, "100 +- 4"),
        (12.24, 0.41, "12.2 +- 0.4"),
        (-0.996, 0.05, "-1.00 +- 0.05"),
        (12345.0, 310.0, "12300 +- 300"),
        (2.5e-4, 7e-5, "0.00025 +- 0.00007"),
        (3.14159, 0.0, "3.14"),
        (0.2, 0.97, "0.2 +- 1.0"),
    ],
)
def test_a_number_is_told_as_exactly_as_it_is_known_in_plain_digits(value, spread, told):
    assert with_spread(value, spread) == told


def test_training_runs_are_paths_from_the_folder_of_the_verdict(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    runs = [Path("runs/sweep@0:60"), tmp_path / "runs" / "square"]
    found = with_training(VERDICTS["nothing"], runs, Path("memo"))
    assert found.training == ("../runs/sweep@0:60", "../runs/square")
    jsonschema.validate(json.loads(as_json(found)), SCHEMA)
