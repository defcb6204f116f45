"""Whole analyses, small enough for every check: few effects, short recordings."""

import json
from dataclasses import replace
from functools import cache
from importlib.resources import files
from pathlib import Path

import jsonschema
import numpy as np
import pytest

from slipbench.identification.experiments.hypothesis import stated
from slipbench.identification.mismatch import explain
from slipbench.identification.mismatch.analysis import Analysis, begin
from slipbench.identification.mismatch.curves.adequacy import Remainder
from slipbench.identification.mismatch.curves.fit_in_model import fit_curves_in_model
from slipbench.identification.mismatch.explain import analyse, run_analysis
from slipbench.identification.mismatch.reporting.conclude import verdict
from slipbench.identification.mismatch.reporting.improved import improved_system
from slipbench.identification.mismatch.reporting.memo import lines, sentence
from slipbench.identification.mismatch.reporting.memo_page import memo_page
from slipbench.identification.mismatch.reporting.open_questions import read_open_questions
from slipbench.identification.mismatch.reporting.output import write_outputs
from slipbench.identification.mismatch.reporting.verdict import as_json
from slipbench.identification.mismatch.thresholds import FORMULA_WIDTH
from slipbench.plant.effects.backlash import Backlash
from slipbench.plant.effects.driveline_loss import DrivelineLoss
from slipbench.plant.effects.free_curve import FreeCurve
from slipbench.plant.effects.relaxation_length import RelaxationLength
from slipbench.plant.equilibrium import equilibrium
from slipbench.plant.signals import Inputs
from slipbench.plant.simulation import Simulation
from slipbench.plant.vehicle_file import load_vehicle
from tests.identification.mismatch.conditions import erring, system
from tests.identification.motorcycle_recording import Ride, ride

LEARN = (
    Ride("sweep", 2, 1400.0, 0.04, 0.5, 9.0, seconds=6.0, seed=31),
    Ride("square", 2, 1100.0, 0.05, 0.9, seconds=6.0, seed=32),
)
PROVE = (Ride("sweep", 2, 1250.0, 0.04, 0.5, 9.0, seconds=6.0, seed=33),)
KINDS = (Backlash, DrivelineLoss, RelaxationLength)


def started(*effects) -> Analysis:
    true = replace(erring(5), effects=effects)
    learn, prove = ([system().prepare(ride(true, t)) for t in trials] for trials in (LEARN, PROVE))
    return begin(system(), learn, prove)


@cache
def slack() -> Analysis:
    return analyse(started(Backlash(slack=8e-3)), KINDS)


def test_backlash_is_named_with_its_size_and_proven():
    found = verdict(slack())
    assert found.mismatch
    assert found.p_value < 0.05
    assert [e.name for e in found.effects] == ["backlash"]
    size = found.effects[0].parameters[0]
    assert size.low - 2e-4 < 8e-3 < size.high + 2e-4
    headline = next(e for e in found.held_out if e.output == found.headline)
    assert headline.improved < 0.8 * headline.calibrated
    assert sentence(found).startswith("The driveline has backlash")
    schema = json.loads(
        (files("slipbench.identification.mismatch.reporting") / "verdict.schema.json").read_text()
    )
    jsonschema.validate(json.loads(as_json(found)), schema)


def test_no_interval_is_narrower_than_what_two_formulas_of_one_physics_mean():
    for number in verdict(slack()).effects[0].parameters:
        assert 0.5 * (number.high - number.low) >= FORMULA_WIDTH * number.value


def test_where_nothing_is_missing_nothing_is_claimed():
    found = verdict(analyse(started(), KINDS))
    assert not found.mismatch
    assert found.p_value >= 0.05
    assert not found.effects
    assert "no significant mismatch" in sentence(found)


def test_the_improved_file_is_run_by_every_simulation(tmp_path):
    a = slack()
    written = write_outputs(a, verdict(a), tmp_path / "v.toml", None, tmp_path / "report")
    path = next(p for p in written if p.name == "v.improved.toml")
    vehicle = load_vehicle(path)
    assert [e.name for e in vehicle.motorcycle.effects] == ["backlash"]
    assert vehicle.plus_minus["effects.backlash.slack"] > 0.0
    simulation = Simulation(vehicle.motorcycle)
    state, throttle = equilibrium(simulation, 2, 1200.0)
    _, out = simulation.advance(state, Inputs.held(200, gear=2.0, throttle_command=throttle))
    assert np.isfinite(out.table).all()
    assert (tmp_path / "report" / "memo.html").read_text().count("<svg") == 2


def test_a_free_curve_gains_most_of_what_the_physics_gains_and_goes_into_the_file(tmp_path):
    a = slack()
    assert a.base is not None
    assert a.named is not None
    free = fit_curves_in_model(a.base, a.before, a.held_out)
    assert free is not None
    assert free.log_likelihood_gain > 0.7 * a.named.log_likelihood_gain
    assert free.confirmed > 0.0
    path = tmp_path / "improved.toml"
    path.write_text(improved_system(free.fit).text())
    (curve,) = load_vehicle(path).motorcycle.effects
    assert isinstance(curve, FreeCurve)
    assert curve.where == (free.curve.place, free.curve.regressor)
    assert curve.f3 == pytest.approx(free.curve.values[3])


def test_a_curve_that_gains_nothing_inside_on_held_out_recordings_is_withdrawn(monkeypatch):
    a = slack()
    assert a.base is not None
    free = fit_curves_in_model(a.base, a.before, a.held_out)
    assert free is not None
    monkeypatch.setattr(explain, "fit_curves_in_model", lambda *_: replace(free, confirmed=-3.0))
    bare = replace(a.named, fit=a.base, competing={})
    again = replace(a, named=bare, after=[], held_out_runs=[], errors=[], free=None, done=4)
    assert verdict(again).unknown
    found = verdict(analyse(again, KINDS))
    assert found.curve is None
    assert found.location is None or found.location.injection != free.curve.place
    assert all(not c.significant for c in again.before if c.place == free.curve.place)


@pytest.mark.parametrize(("more", "told"), [(1e3, "wheel torque"), (0.0, "located")])
def test_where_it_acts_is_told_by_what_explains_more(more, told):
    """A located curve explains calibration residuals; an in-model curve may explain far more."""
    a = slack()
    free = fit_curves_in_model(a.base, a.before, a.held_out)
    there = replace(free.curve, place="wheel torque", block="driveline")
    other = replace(free, curve=there, log_likelihood_gain=a.before[0].log_likelihood_gain + more)
    bare = replace(a.named, fit=a.base, competing={})
    found = verdict(replace(a, named=bare, after=[], free=other))
    assert found.unknown
    assert found.location.injection == (a.before[0].place if told == "located" else told)
    assert found.location.gain == a.before[0].log_likelihood_gain + more
    page = memo_page(replace(a, named=bare, after=[], free=other), found)
    figures = [part.split("</svg>", 1)[0] for part in page.split("<svg")[1:]]
    assert any("wheel torque" in figure for figure in figures)


@pytest.mark.parametrize(("gain", "stand"), [(6.0, True), (1e6, False)])
def test_names_that_do_not_suffice_go_only_where_a_curve_foretells_better(monkeypatch, gain, stand):
    """gain: held-out nats of the curve."""
    a = slack()
    monkeypatch.setattr(explain, "_confirmed", lambda *_: gain)
    doubted = replace(
        a, remains=Remainder(a.before[0], 0.2, 0.2), held_out_runs=[], errors=[], done=4
    )
    assert verdict(doubted).unknown
    found = verdict(analyse(doubted, KINDS))
    assert found.unknown != stand
    assert [e.name for e in found.effects] == (["backlash"] if stand else [])
    assert (found.remains is not None) == stand


@pytest.mark.parametrize("step", ["Localizing", "Screening", "Validating"])
def test_an_interrupted_analysis_says_what_it_has(step):
    a = started(Backlash(slack=8e-3))
    if step == "Validating":
        a = replace(slack(), held_out_runs=[], errors=[], done=5, complete=False)

    def say(words: str) -> None:
        if words.startswith(step):
            raise KeyboardInterrupt

    assert not run_analysis(a, say)
    found = verdict(a)
    assert not found.complete
    assert lines(found)[0].startswith("Interrupted")
    assert "Interrupted" in memo_page(a, found)


def test_what_is_open_is_written_for_the_design_of_the_next_trial(tmp_path):
    """Effects without excitation, each against no effect; the file is read back unchanged."""
    a = replace(slack(), runs=("runs/sweep", "runs/square@0:60"))
    written = write_outputs(a, verdict(a), tmp_path / "v.toml", None, tmp_path / "report")
    path = next(p for p in written if p.name == "hypotheses.json")
    opened = read_open_questions(path)
    assert [(path.parent / run).resolve() for run in opened.runs] == [
        Path(run).resolve() for run in a.runs
    ]
    assert (path.parent / opened.improved).is_file()
    library = a.system.library
    for question in opened.questions:
        hypotheses = [stated(one, library, str(path)) for one in question]
        assert len({h.name for h in hypotheses}) == len(question) > 1
    assert "hypotheses.json" not in [
        p.name
        for p in write_outputs(
            slack(), verdict(slack()), tmp_path / "w.toml", None, tmp_path / "other"
        )
    ], "an analysis without recordings on disk has none to name"
