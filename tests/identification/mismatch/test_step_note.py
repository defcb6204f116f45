"""An integration step too large for precise recordings is reported with its cost."""

from dataclasses import replace

import numpy as np
import pytest

from slipbench.identification.mismatch.analysis import begin
from slipbench.identification.mismatch.explain import analyse
from slipbench.identification.mismatch.fit.fitting import Fit
from slipbench.identification.mismatch.fit.whitening import Whitener
from slipbench.identification.mismatch.reporting.conclude import verdict
from slipbench.identification.mismatch.reporting.step_note import nats_of_half_a_step, step_note
from slipbench.identification.mismatch.simulation.model import predict
from tests.identification.mismatch.laws.spring import MODEL, spring, swung


def fit(folder, step, noise, frequency=40.0):
    """A spring with a high natural frequency, and a recording with white noise, m."""
    text = MODEL.replace('step = "5 ms"', f'step = "{step}"')
    system = spring(folder, text.replace("value = 10, unit", f"value = {frequency}, unit"))
    model = begin(system, [system.prepare(swung(3))], []).training
    white = Whitener(np.zeros((0, 1, 1)), np.array([[1.0 / noise]]), np.zeros((0, 0)))
    return Fit(model, model.origin(), predict(model, model.origin()), [white], [])


def test_what_a_step_costs_goes_with_the_precision_of_the_recording(tmp_path):
    """Half of the noise makes four times the nats."""
    one, two = (nats_of_half_a_step(fit(tmp_path, "10 ms", noise)) for noise in (2e-3, 1e-3))
    assert two == pytest.approx(4.0 * one, rel=1e-9)


def test_it_falls_with_the_eighth_power_of_the_step(tmp_path):
    """The rule of integration is of fourth order, and nats are squares."""
    coarse, fine = (nats_of_half_a_step(fit(tmp_path, s, 1e-4)) for s in ("5 ms", "2.5 ms"))
    assert coarse / fine == pytest.approx(2.0**8, rel=0.3)


def test_a_step_that_is_too_large_is_said_and_a_fine_one_is_not(tmp_path):
    large = fit(tmp_path, "10 ms", 1e-4)
    assert f"{nats_of_half_a_step(large):.0f} nats" in step_note(large)
    assert step_note(fit(tmp_path, "1 ms", 1e-4)) == ""


def test_a_simulation_that_has_no_smaller_step_needs_no_word(tmp_path, monkeypatch):
    large = fit(tmp_path, "10 ms", 1e-4)
    monkeypatch.setattr(type(large.model.system), "with_half_a_step", lambda _: None)
    assert nats_of_half_a_step(large) == 0.0
    assert step_note(large) == ""


def test_the_verdict_has_the_note(tmp_path, monkeypatch):
    system = spring(tmp_path)
    found = analyse(begin(system, [system.prepare(swung(3))], []), [])
    assert not [n for n in verdict(found).left_out if n.startswith("step:")]
    white = Whitener(np.zeros((0, 1, 1)), np.array([[1e9]]), np.zeros((0, 0)))
    found.named = replace(found.named, fit=replace(found.named.fit, noise=[white]))
    (note,) = [n for n in verdict(found).left_out if n.startswith("step:")]
    assert "try half of the step" in note
