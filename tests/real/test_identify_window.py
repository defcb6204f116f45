"""A window of a ride that nobody planned as a trial is identified: a superbike's recorded lap."""

import json

import numpy as np
import pytest
from typer.testing import CliRunner

from slipbench.command import app
from slipbench.protocol.recording.import_log import Capture, import_capture
from tests.paths import ROLES
from tests.recordings import recording


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    folder = tmp_path_factory.mktemp("ride") / "run"
    tables = {name: recording(f"yamaha_r1/{name}.csv") for name in ("gps", "lean")}
    log, database = (recording(f"yamaha_r1/session.{end}") for end in ("log", "dbc"))
    import_capture(Capture(log, ROLES / "yamaha_r1.toml", database, tables), folder)
    return folder


def identified(run, out, *options):
    done = CliRunner().invoke(app, ["identify", str(run), "--out", str(out), *options])
    assert done.exit_code == 0, done.output
    return json.loads((out / "identification.json").read_text(encoding="utf-8")), done.output


def test_without_a_window_the_remedy_is_named(run, tmp_path):
    tree, said = identified(run, tmp_path)
    assert tree["verdict"]["word"] == "not usable"
    assert "--window" in said


def test_the_throttle_follows_the_grip_of_the_rider(run, tmp_path):
    names = ("--input", "rider_grip", "--output", "throttle_position")
    tree, _ = identified(run, tmp_path, "--window", "1:00-6:00", *names)
    assert tree["selected"] == {"input": "rider_grip", "output": "throttle_position"}
    (response,) = tree["responses"]
    low = [gain for f, gain in zip(response["frequency"], response["gain"], strict=True) if f < 0.3]
    assert low == pytest.approx([1.0] * len(low), abs=0.2)
    assert np.median(low) == pytest.approx(1.0, abs=0.08)
    assert "Select a part" not in " ".join(tree["verdict"]["reasons"])


def test_slip_over_throttle_of_half_a_minute_has_a_verdict_with_its_reason(run, tmp_path):
    names = ("--input", "throttle_position", "--output", "slip")
    tree, _ = identified(run, tmp_path, "--window", "12:42", *names)
    assert tree["verdict"]["word"] != "good"
    assert tree["verdict"]["reasons"]
    assert tree["trial"]["excited"] == pytest.approx([12.0, 42.1], abs=0.11)
