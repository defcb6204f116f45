"""A design by its public function: nothing printed, choices checked before anything is read."""

import math

import pytest

import slipbench
from slipbench.examples import TRIALS
from slipbench.identification.design import controller_design
from slipbench.identification.design.controller_design import Specification, required_margins
from slipbench.identification.design.from_runs import NoPath, Path
from slipbench.protocol.configuration import read_toml
from slipbench.protocol.controller_file import ControllerFile
from slipbench.protocol.errors import InputError
from slipbench.protocol.trial_file import TrialFile
from tests.identification.design.test_loop_design import problem

MARGINS = required_margins(6.0, 40.0, 2.0)


@pytest.mark.parametrize(
    ("gain", "phase", "peak", "named"),
    [
        (-1.0, 40.0, 2.0, "gain margin"),
        (1e9, 40.0, 2.0, "gain margin"),  # 10 ** 5e7 overflows
        (math.nan, 40.0, 2.0, "gain margin"),
        (6.0, -1.0, 2.0, "phase margin"),
        (6.0, math.inf, 2.0, "phase margin"),
        (6.0, 40.0, 1.0, "sensitivity peak"),
        (6.0, 40.0, math.nan, "sensitivity peak"),
    ],
)
def test_a_margin_that_is_not_possible_is_refused(tmp_path, gain, phase, peak, named):
    margins = {"gain_margin": gain, "phase_margin": phase, "sensitivity": peak}
    with pytest.raises(InputError, match=named):
        slipbench.design(["none"], "throttle", tmp_path / "x.toml", **margins)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("period", [0.0, -1.0, math.nan, math.inf, 1e4])
def test_a_sample_time_out_of_range_is_refused(tmp_path, period):
    with pytest.raises(InputError, match="sample time"):
        slipbench.design(["none"], "throttle", tmp_path / "x.toml", period=period)


@pytest.mark.parametrize(
    "choice",
    [
        Specification("brake", MARGINS),
        Specification("throttle", MARGINS, "fuzzy"),
        Specification("mixed", MARGINS, "pid"),
        Specification("mixed", MARGINS, scheduled=True),
        Specification("spark", MARGINS, "internal_model", scheduled=True),
    ],
)
def test_choices_that_do_not_fit_together_are_refused(choice):
    with pytest.raises(InputError):
        choice.check()


def test_a_design_prints_nothing_and_returns_the_file_that_it_writes(tmp_path, monkeypatch, capfd):
    """The path of an identified run is replaced by an exact model; all that follows is real."""
    limits = read_toml(TRIALS / "throttle_sweep.toml", TrialFile).limits
    known = Path("throttle", problem(), 50.0, 0.17, ("exact",), limits)
    monkeypatch.setattr(controller_design, "path_of", lambda *_: known)
    found = slipbench.design([], "throttle", tmp_path / "x.toml", law="internal_model")
    assert capfd.readouterr() == ("", "")
    assert read_toml(tmp_path / "x.toml", ControllerFile) == found
    assert found.designed["gain_margin_db"] >= 6.0
    assert found.designed["phase_margin_deg"] >= 40.0
    assert found.designed["sensitivity_peak"] <= 2.0


def test_runs_that_do_not_excite_the_actuator_are_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(controller_design, "path_of", lambda *_: NoPath("no response"))
    with pytest.raises(InputError, match="no controller can be designed for the spark"):
        slipbench.design([], "spark", tmp_path / "x.toml")
    assert not list(tmp_path.iterdir())
