"""Trials under slip control, over simulated CAN: the slip goes where its target goes."""

from pathlib import Path

import numpy as np
import pytest

from slipbench import dbc
from slipbench.bench.trials.preparation import check_controller, prepare
from slipbench.bench.trials.run import run_trial
from slipbench.identification.design.prefilter import OVERSHOOT
from slipbench.identification.report.headline import headline
from slipbench.identification.response.following import QUICK, Following
from slipbench.identification.response.identify import identify
from slipbench.identification.signals.filters import low_pass
from slipbench.identification.signals.motion import Motion
from slipbench.identification.signals.trial_window import TrialWindow
from slipbench.protocol.configuration import load_toml, parse, read_toml
from slipbench.protocol.controller_file import ControllerFile
from slipbench.protocol.errors import InputError
from slipbench.protocol.recording.run_folder import read
from slipbench.protocol.trial_file import TrialFile
from tests.paths import CONTROLLERS, TRIALS, with_full_paths

STEPS = {"throttle": 0.001, "spark": 0.0006, "mixed": 0.001}  # of the target, either way


def shortened(tmp_path: Path, actuator: str, **excitation) -> Path:
    """The project's own trial, four seconds long, beside its files."""
    text = (TRIALS / f"slip_steps_{actuator}.toml").read_text(encoding="utf-8")
    text = text.replace('duration = "8 s"', 'duration = "4 s"')
    text = with_full_paths(text)
    for key, value in excitation.items():
        text = text.replace(f"{key} = ", f"{key} = {value} # ")
    path = tmp_path / f"{actuator}.toml"
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize("actuator", ["throttle", "spark", "mixed"])
def test_the_slip_steps_with_its_target_and_authority_goes_back(tmp_path, actuator):
    prepared = prepare(shortened(tmp_path, actuator), dbc.MOTORBIKE)
    outcome = run_trial(prepared, tmp_path / "run", None)
    assert outcome.state.trip is None
    found = identify(read(tmp_path / "run"))
    assert isinstance(found.motion, Motion)
    assert isinstance(found.window, TrialWindow)
    slip, at, half = found.motion.slip.ratio, found.window.exciting.start, 1000
    levels = [
        np.mean(slip[at + k * half + 600 : at + (k + 1) * half - 100]) for k in range(4)
    ]  # up, down, up, down
    step = 2 * STEPS[actuator]
    np.testing.assert_allclose(np.diff(levels), [-step, step, -step], atol=0.2 * step)
    assert all("closed loop" in left.reason for left in found.left_out if "slip" in left.analysis)
    followed = found.following
    assert followed is not None
    assert np.ptp(followed.target) == pytest.approx(step)
    assert followed.error < 0.5 * step  # the flanks are in it
    assert followed.steps is not None
    overshoots_no_more_than_designed(followed, step)
    assert headline(found).startswith("Slip control: rms tracking error")


def overshoots_no_more_than_designed(followed: Following, step: float) -> None:
    """Beyond a step's target lie the designed overshoot and what the slip does at rest as well.

    One step up and one down in a trial of 4 s: the greatest of 25 independent values of noise and
    wind lies 2 to 3 deviations off, and 0.12 % of slip, all that the spark makes, is some ten of
    them. So a bound on the overshoot of a single step is one on its noise: the bound must know it.
    """
    slip = low_pass(followed.slip, 1000.0, QUICK)
    up = np.where(followed.target > followed.target.mean(), 1.0, -1.0)
    beyond = (up * (slip - followed.target)).reshape(-1, 1000)  # of every half period
    settled = float(np.sqrt(np.mean(beyond[:, 500:-100] ** 2)))
    print(f"beyond {beyond[:, :-100].max() / step:.2f}, settled {settled / step:.3f} of a step")
    assert beyond[:, :-100].max() <= OVERSHOOT * step + 4.0 * settled


def controller(**changes) -> ControllerFile:
    tree = load_toml(CONTROLLERS / "throttle.toml")
    return parse(tree | changes, ControllerFile, "controller.toml")


TRIAL = read_toml(TRIALS / "slip_steps_throttle.toml", TrialFile)


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"period": 0.002}, "another command period"),
        ({"limits": {"low": -0.07, "high": 0.05, "rate": 5.0}}, "further or faster"),
        ({"limits": {"low": -0.05, "high": 0.07, "rate": 5.0}}, "further or faster"),
        ({"limits": {"low": -0.05, "high": 0.05, "rate": 7.0}}, "further or faster"),
    ],
)
def test_a_controller_that_could_trip_the_trial_is_refused_before_it(changes, told):
    with pytest.raises(InputError, match=told):
        check_controller(controller(**changes), TRIAL, "controller.toml")


@pytest.mark.parametrize(
    ("actuator", "rate", "told"),
    [
        ("throttle", "throttle_rate", "move the throttle faster"),
        ("spark", "spark_rate", "move the spark faster"),
        ("mixed", "throttle_rate", "move the throttle faster"),
    ],
)
def test_a_hand_back_that_could_be_too_quick_is_refused_before_it(actuator, rate, told):
    """The limit is where the farthest way within the hand-back takes the whole rate."""
    trial = read_toml(TRIALS / f"slip_steps_{actuator}.toml", TrialFile)
    tree = load_toml(CONTROLLERS / f"{actuator}.toml")
    allowed = getattr(trial.limits, rate)
    bounds = tree["mixed"]["throttle"] if actuator == "mixed" else tree["limits"]
    farthest = max(abs(bounds["low"]), abs(bounds["high"]))
    way = farthest + (0.0 if actuator == "spark" else trial.limits.throttle_deviation)
    file = parse(tree, ControllerFile, "controller.toml")
    for share, refused in ((1.01, False), (0.99, True)):
        quick = trial.model_copy(update={"hand_back": share * way / allowed})
        if refused:
            with pytest.raises(InputError, match=told):
                check_controller(file, quick, "controller.toml")
        else:
            check_controller(file, quick, "controller.toml")


def test_a_controller_without_a_target_and_a_target_without_a_controller_are_refused():
    tree = load_toml(TRIALS / "slip_steps_throttle.toml")
    for wrong in (
        {k: v for k, v in tree.items() if k != "controller"},
        tree | {"excitation": tree["excitation"] | {"actuator": "throttle"}},
    ):
        with pytest.raises(InputError, match="go together"):
            parse(wrong, TrialFile, "trial.toml")


def test_a_wet_patch_is_met_where_the_trial_says():
    from slipbench.bench.vehicle.road import Road

    road = Road(
        parse(
            load_toml(TRIALS / "slip_steps_throttle.toml")
            | {
                "road": [
                    {"of": "grip", "from": "10 m", "to": "30 m", "factor": 0.5},
                    {"of": "load", "from": "20 m", "to": "40 m", "factor": 0.6},
                ]
            },
            TrialFile,
            "trial.toml",
        ).road
    )
    places = [9.9, 10.0, 20.0, 30.0, 40.0]
    assert [road.factors(p) for p in places] == [
        (1.0, 1.0),
        (0.5, 1.0),
        (0.5, 0.6),
        (1.0, 0.6),
        (1.0, 1.0),
    ]
