"""The verdict at the head of a report: good, with reservations, not usable, each with its reason."""

from dataclasses import replace

import pytest

from slipbench.identification.models.study import study_of
from slipbench.identification.response.identify import identify
from slipbench.identification.response.selection import Selection
from slipbench.identification.session.run_verdict import run_verdict
from slipbench.identification.session.thresholds import THRESHOLDS
from slipbench.protocol.recording.recording import BusFault
from tests.identification.synthetic_recording import Truth, recording


def judged(made, selection=None):
    found = identify(made, selection)
    return run_verdict(found, study_of(found))


@pytest.fixture(scope="module")
def quiet():
    found = identify(recording(Truth(noise=0.02)))
    return found, study_of(found)


def test_a_clear_run_is_good_and_says_what_it_rests_on(quiet):
    verdict = run_verdict(*quiet)
    assert verdict.word == "good"
    assert "reliable" in verdict.reasons[0]
    assert "held-out data" in verdict.reasons[1]


def test_a_recording_without_a_trial_is_not_usable_and_the_remedy_is_named():
    verdict = judged(recording(Truth(), phases=False))
    assert verdict.word == "not usable"
    assert "--window" in verdict.reasons[0]


def test_a_selected_window_of_the_same_recording_is_good():
    verdict = judged(recording(Truth(noise=0.02), phases=False), Selection((3.0, 23.0)))
    assert verdict.word == "good"


def test_a_trip_or_late_ticks_make_a_run_not_usable(quiet):
    found, study = quiet
    for outcome, words in (
        ({"trip": "brake", "detail": "2 bar"}, "braked"),
        ({"invalid": "40 ticks were late"}, "40 ticks were late"),
    ):
        told = replace(found.recording, description={"outcome": outcome})
        verdict = run_verdict(replace(found, recording=told), study)
        assert verdict.word == "not usable"
        assert words in str(verdict)


def test_faulty_frames_and_warnings_are_reservations(quiet):
    found, study = quiet
    told = replace(
        found.recording,
        faults=(
            BusFault("EcuStatus", "lost", 7, 2.5),
            BusFault("0x7ab", "unknown identifier", 9, 0),
        ),
        description={"warnings": ["the clock jumped"]},
    )
    verdict = run_verdict(replace(found, recording=told), study)
    assert verdict.word == "usable with reservations"
    assert verdict.reasons == ("7 frames are faulty", "the clock jumped")


def test_a_model_that_misses_dynamics_or_most_of_the_output_is_a_reservation(quiet):
    found, study = quiet
    whole = study.validations[0]
    poor = replace(study, validations=(replace(whole, fit=THRESHOLDS.held_out.value - 1),))
    assert "NRMSE" in str(run_verdict(found, poor))
    test = replace(whole.tests.cross_correlation, probability=1e-9, share=0.9)
    wrong = replace(whole, tests=replace(whole.tests, cross_correlation=test), error=1.0)
    verdict = run_verdict(found, replace(study, validations=(wrong,)))
    assert verdict.word == "usable with reservations"
    assert "lacks dynamics" in verdict.reasons[0]


def test_noise_that_drowns_the_slip_makes_a_run_not_usable():
    assert judged(recording(Truth(noise=20.0))).word == "not usable"
