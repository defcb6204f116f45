"""What no frame can carry is refused when the trial file is read, by name and with the range."""

import shutil

import pytest

from slipbench import dbc
from slipbench.bench.trials.excitation import plan_excitation
from slipbench.bench.trials.preparation import prepare
from slipbench.bench.trials.wire_limits import CARRIED, check_wire
from slipbench.protocol.database.database import load_database
from slipbench.protocol.errors import InputError
from tests.bench.conditions import trial_file
from tests.paths import DEMONSTRATION, TRIALS

DATABASE = load_database(dbc.MOTORBIKE)


def check(**changes):
    trial = trial_file(**changes)
    check_wire(trial, plan_excitation(trial), DATABASE, "trial.toml")


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("limits.throttle", [0.0, 1.2]),
        ("limits.throttle", [-0.1, 0.3]),
        ("limits.spark", ["-45 deg", "4 deg"]),
        ("limits.spark", ["-12 deg", "41 deg"]),
        ("limits.engine_speed", ["11000 rpm", "26000 rpm"]),
        ("limits.speed", ["30 m/s", "200 m/s"]),
        ("limits.grip_closed", -0.01),
        ("limits.brake_pressure", 2e7),
        ("limits.clutch", 1.1),
        ("operating_point.engine_speed", "30000 rpm"),
    ],
)
def test_a_value_that_the_wire_cannot_carry_is_refused_by_name_and_range(key, value):
    with pytest.raises(InputError, match=rf"{key} = .* is not in .*\.") as refused:
        check(**{key.replace(".", "__"): value})
    assert CARRIED[key][1] in str(refused.value)
    assert DATABASE.origin in str(refused.value)


def test_the_ends_of_the_range_are_carried():
    check(
        limits__throttle=[0.0, 1.0],
        limits__spark=["-40 deg", "40 deg"],
        limits__clutch=1.0,
        limits__engine_speed=["0 rpm", "25000 rpm"],
        limits__speed=["-10 m/s", "150 m/s"],
    )


@pytest.mark.parametrize(
    ("actuator", "amplitude"), [("throttle", "0.009 %"), ("spark", "0.01 deg")]
)
def test_an_excitation_that_the_command_rounds_to_nothing_is_refused(actuator, amplitude):
    with pytest.raises(InputError, match=f"less than one step of ActuatorCommand.{actuator}"):
        check(excitation__actuator=actuator, excitation__amplitude=amplitude)


def test_every_value_at_once_is_told():
    with pytest.raises(InputError, match=r"limits\.spark.*; limits\.clutch"):
        check(limits__spark=["-90 deg", "90 deg"], limits__clutch=2.0)


def test_a_trial_is_refused_before_anything_is_opened(tmp_path):
    text = (TRIALS / "throttle_sweep.toml").read_text()
    text = text.replace('["-12 deg", "4 deg"]', '["-60 deg", "4 deg"]')
    text = text.replace("../../plant/vehicles/", "")
    shutil.copy(DEMONSTRATION, tmp_path)
    (tmp_path / "trial.toml").write_text(text)
    with pytest.raises(InputError, match=r"limits\.spark") as refused:
        prepare(tmp_path / "trial.toml", dbc.MOTORBIKE)
    assert "trial.toml" in str(refused.value)


@pytest.mark.parametrize("path", sorted(TRIALS.glob("*.toml")), ids=lambda path: path.stem)
def test_our_own_trials_are_carried(path):
    prepare(path, dbc.MOTORBIKE)
