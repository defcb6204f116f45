"""From a trial file over simulated CAN to a resonance: nothing is known but the run folder."""

import json

import pytest
from typer.testing import CliRunner

from slipbench.command import app
from tests.paths import DEMONSTRATION

TRIAL = """
name = "short_sweep"
vehicle = "{vehicle}"
[operating_point]
gear = 2
engine_speed = "14000 rpm"
engine_speed_window = "400 rpm"
[excitation]
actuator = "throttle"
waveform = "linear_sweep"
amplitude = "3 %"
start = "1 Hz"
stop = "12 Hz"
duration = "8 s"
[limits]
throttle = ["0.5 %", "30 %"]
throttle_deviation = "6 %"
throttle_rate = "600 %/s"
spark = ["-12 deg", "4 deg"]
spark_rate = "1000 deg/s"
engine_speed = ["11000 rpm", "15500 rpm"]
speed = ["30 m/s", "70 m/s"]
slip = "8 %"
distance = "2500 m"
"""


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    vehicle = DEMONSTRATION
    folder = tmp_path_factory.mktemp("trial")
    (folder / "short.toml").write_text(TRIAL.format(vehicle=vehicle))
    made = CliRunner().invoke(
        app, ["trial", str(folder / "short.toml"), "--out", str(folder / "r")]
    )
    assert made.exit_code == 0, made.output
    return folder / "r"


def test_a_short_sweep_shows_resonance_coherence_and_slip(run):
    result = CliRunner().invoke(app, ["identify", str(run)])
    assert result.exit_code == 0, result.output
    found = json.loads((run / "identification.json").read_text(encoding="utf-8"))
    assert 7.0 < found["resonance"]["frequency"] < 8.8
    assert 1.4 < found["resonance"]["peak"] < 2.5
    assert found["coherence_min"] > 0.9
    assert -0.005 < found["slip"]["low"] < found["slip"]["high"] < 0.03
    assert found["slip"]["mean"] == pytest.approx(0.012, abs=0.004)
    assert all(abs(clock["drift_ppm"]) < 20 for clock in found["clocks"].values())
    assert found["faults"] == []
    assert found["left_out"] == []
