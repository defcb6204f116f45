"""A window, an input and an output are selected by name, and every mistake is said with the remedy."""

import numpy as np
import pytest

from slipbench.identification.commands import write_report
from slipbench.identification.models.study import study_of
from slipbench.identification.report.headline import headline
from slipbench.identification.response.identify import identify
from slipbench.identification.response.response import FrequencyResponse
from slipbench.identification.response.selection import Selection, parse_window
from slipbench.identification.signals.trial_window import TrialWindow
from slipbench.protocol.errors import InputError
from slipbench.protocol.recording.from_arrays import recording_of
from tests.identification.synthetic_recording import Truth, recording

TRUTH = Truth(noise=0.02)


@pytest.fixture(scope="module")
def captured():
    """A recording without a trial and without its phases, as an imported log."""
    return recording(TRUTH, phases=False)


@pytest.mark.parametrize(
    ("text", "window"),
    [
        ("12:42", (12.0, 42.0)),
        ("12-42", (12.0, 42.0)),
        ("0.5:1.25", (0.5, 1.25)),
        ("1:05-2:10", (65.0, 130.0)),
        ("50-1:10.5", (50.0, 70.5)),
    ],
)
def test_a_window_is_in_seconds_or_minutes_and_seconds(text, window):
    assert parse_window(text) == window


@pytest.mark.parametrize(
    "text", ["12", "a:b", "1:2:3", "42:12", "5:5", "-3:4", "1:75-2:00", "nan:3"]
)
def test_a_window_that_cannot_be_read_is_refused(text):
    with pytest.raises(InputError, match="window"):
        parse_window(text)


def test_the_response_of_a_selected_window_is_the_true_one(captured):
    found = identify(captured, Selection((3.0, 23.0), "throttle_position", "slip"))
    assert isinstance(found.window, TrialWindow)
    assert isinstance(found.main, FrequencyResponse)
    assert (found.main.input, found.main.output) == ("throttle_position", "slip")
    known = found.main.reliable
    truth = TRUTH.response(found.main.frequency)
    assert np.median(np.abs(found.main.value / truth - 1)[known]) < 0.03
    study = study_of(found)
    assert study.models
    assert study.validations[0].fit > 80


def test_without_names_it_is_the_actuator_that_moves_and_slip(captured):
    found = identify(captured, Selection((3.0, 23.0)))
    assert found.pair == ("throttle_command", "slip")


def test_any_signal_may_be_the_output(captured):
    found = identify(captured, Selection((3.0, 23.0), "throttle_position", "engine_speed"))
    assert found.main is not None
    assert found.main.unit == "rad/s per 1"
    assert study_of(found).validations


def test_names_alone_keep_the_window_of_the_trial():
    made = recording(TRUTH)
    found = identify(made, Selection(output="engine_speed"))
    plain = identify(made)
    assert isinstance(found.window, TrialWindow)
    assert found.window.exciting == plain.window.exciting
    assert found.pair == ("throttle_command", "engine_speed")


@pytest.mark.parametrize("name", ["Engine Speed", "engine speed", "ENGINE_SPEED"])
def test_case_spaces_and_underscores_make_no_other_name(captured, name):
    found = identify(captured, Selection((3.0, 23.0), "Throttle Position", name))
    assert found.pair == ("throttle_position", "engine_speed")


def test_a_window_may_end_with_the_last_sample_period(captured):
    last = identify(captured, Selection((3.0, 23.0))).base.time
    assert identify(captured, Selection((3.0, last[-1] + 1.5 * (last[1] - last[0]))))
    with pytest.raises(InputError, match="does not fit"):
        identify(captured, Selection((3.0, last[-1] + 3.0 * (last[1] - last[0]))))


@pytest.mark.parametrize(
    ("selection", "words"),
    [
        (Selection((3.0, 23.0), "throtle", "slip"), r"no signal throtle.*throttle_position \[1\]"),
        (Selection((3.0, 23.0), None, "yaw"), r"no signal yaw.*engine_speed \[rad/s\].*slip \[1\]"),
        (Selection((3.0, 230.0)), "does not fit the recording"),
        (Selection((3.0, 3.2)), "does not fit the recording"),
        (Selection((0.2, 2.2), "throttle_position"), "constant in the window"),
        (Selection((3.0, 23.0), "slip", "slip"), "the same signal"),
        (Selection(output="slip"), "--window"),
    ],
)
def test_what_cannot_be_selected_is_said_with_the_remedy(captured, selection, words):
    with pytest.raises(InputError, match=words):
        identify(captured, selection)


def test_quantities_that_are_no_role_keep_their_units(tmp_path):
    rng = np.random.default_rng(4)
    time = 0.01 * np.arange(3000)
    goal = np.sin(2 * np.pi * (0.3 + 0.1 * time) * time)
    speed = 3.0 * goal + 0.01 * rng.standard_normal(time.size)
    values = {"goal": np.degrees(goal), "motor speed": speed}
    units = {"goal": "deg", "motor speed": "rad/s"}
    recorded = recording_of("servo", time, values, units)
    found = identify(recorded, Selection((0.0, 30.0), "goal", "motor speed"))
    assert found.main is not None
    assert found.main.unit == "rad/s per rad"
    assert np.median(found.main.gain[found.main.reliable]) == pytest.approx(3.0, rel=0.02)
    folder = tmp_path / "report"
    write_report(found, study_of(found), folder, None)
    assert "rad/s\u2009/\u2009°" in (folder / "report.html").read_text(encoding="utf-8")
    short = identify(recorded, Selection((0.0, 2.0), "goal", "motor speed"))
    assert headline(short).startswith("The response of motor speed to goal is not given: ")
