"""identification.json and comparison.json of every kind of recording follow their JSON schema."""

import json
from dataclasses import replace
from pathlib import Path

import jsonschema
import numpy as np
import pytest

from slipbench.identification.commands import studied, write_comparison, write_report
from slipbench.identification.report.identification_file import FILES, schema
from slipbench.identification.response.identify import identify
from slipbench.identification.response.selection import Selection
from slipbench.protocol.recording.recording import BusFault
from tests.identification.synthetic_recording import Truth, recording, sweep_trial
from tests.paths import ROOT

SQUARE = {"waveform": "square", "frequency": "0.5 Hz"}


def without(made, *roles):
    return replace(made, channels={k: v for k, v in made.channels.items() if k not in roles})


def square(t):
    return np.where((t >= 0) & (t < 20), np.sign(np.sin(np.pi * t)), 0.0)


FAULTY = (BusFault("EcuStatus", "lost", 7, 2.5),)
KINDS = {
    "sweep": lambda: (recording(Truth(noise=0.02)), None),
    "square": lambda: (recording(Truth(noise=0.02), sweep_trial(**SQUARE), square), None),
    "noise alone": lambda: (recording(Truth(noise=20.0)), None),
    "no response": lambda: (recording(Truth(gain=0.0)), None),
    "no trial": lambda: (recording(Truth(), phases=False), None),
    "window": lambda: (recording(Truth(noise=0.02), phases=False), Selection((3.0, 23.0))),
    "any output": lambda: (recording(Truth()), Selection(output="engine_speed")),
    "no wheel": lambda: (without(recording(Truth()), "rear_teeth"), None),
    "no reference": lambda: (without(recording(Truth()), "optical_speed"), None),
    "faults and warnings": lambda: (
        replace(recording(Truth()), faults=FAULTY, description={"warnings": ["a clock jumped"]}),
        None,
    ),
}


def valid(path, name):
    tree = json.loads(path.read_text(encoding="utf-8"))
    jsonschema.Draft202012Validator(schema(name)).validate(tree)
    FILES[name].model_validate(tree)
    return tree


@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_of_recording_gives_a_valid_file(kind, tmp_path):
    made, selection = KINDS[kind]()
    found = identify(made, selection)
    write_report(found, studied(found), tmp_path, None)
    tree = valid(tmp_path / "identification.json", "identification")
    assert tree["verdict"]["reasons"]


def test_a_comparison_gives_a_valid_file(tmp_path):
    runs = []
    for seed in range(2):
        made = replace(recording(Truth(noise=0.02, seed=seed)), folder=Path(f"run{seed}"))
        found = identify(made)
        runs.append((found, studied(found)))
    write_comparison(runs, tmp_path, None)
    valid(tmp_path / "comparison.json", "comparison")


@pytest.mark.parametrize("name", FILES)
def test_the_schema_is_one_and_is_in_the_reference(name):
    jsonschema.Draft202012Validator.check_schema(schema(name))
    path = ROOT / "docs" / "reference" / f"{name}.schema.json"
    assert json.loads(path.read_text(encoding="utf-8")) == schema(name)


def test_an_unknown_key_or_a_missing_version_is_no_identification_file(tmp_path):
    found = identify(recording(Truth()))
    write_report(found, studied(found), tmp_path, None)
    tree = valid(tmp_path / "identification.json", "identification")
    check = jsonschema.Draft202012Validator(schema("identification"))
    assert not check.is_valid({**tree, "surprise": 1})
    assert not check.is_valid({k: v for k, v in tree.items() if k != "schema_version"})
    assert not check.is_valid({**tree, "duration": "long"})
