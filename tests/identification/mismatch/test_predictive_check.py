"""A verdict is checked by recordings simulated from it: laws of the rates."""

import json
from dataclasses import replace
from importlib.resources import files
from itertools import count

import jsonschema
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from typer.testing import CliRunner

from slipbench.command import app
from slipbench.identification.mismatch.analysis import accepted, begin
from slipbench.identification.mismatch.explain import analyse
from slipbench.identification.mismatch.fit.stack import whiteners
from slipbench.identification.mismatch.predictive_check.check import analyses_of, check
from slipbench.identification.mismatch.predictive_check.noise import coloured, noise_like
from slipbench.identification.mismatch.predictive_check.order import Order
from slipbench.identification.mismatch.predictive_check.outcome import (
    compare,
    indistinguishable,
    result_of,
)
from slipbench.identification.mismatch.predictive_check.replica import simulated
from slipbench.identification.mismatch.reporting.check_in_words import check_lines
from slipbench.identification.mismatch.reporting.check_result import (
    COMPLETE,
    INTERRUPTED,
    OUT_OF_TIME,
    Check,
    Rate,
)
from slipbench.identification.mismatch.reporting.conclude import verdict
from slipbench.identification.mismatch.reporting.verdict import Verdict, as_json
from slipbench.identification.mismatch.simulation.model import predict
from slipbench.identification.mismatch.simulation.quantization import QuantizationGrid
from slipbench.identification.mismatch.simulation.replicate import replicated
from slipbench.identification.mismatch.systems.system import ModelSystem
from slipbench.protocol.recording.channel import Channel
from slipbench.protocol.recording.recording import Recording
from tests.identification.mismatch.callables import springs
from tests.identification.mismatch.laws.spring import cubic, spring, swung

SCHEMA = json.loads(
    (files("slipbench.identification.mismatch.reporting") / "verdict.schema.json").read_text()
)
CLEAR, WEAK = (0.15, 2e-3), (0.01, 0.2)
"""Cubic term of the spring, 1/m^2, and noise, m."""


def kinds(system: ModelSystem) -> list:
    """The only effect in the library, to keep these tests short."""
    return [k for k in system.library if k.name == "cubic" and k.place.name == "deflection"]


def analysed(folder, cube, noise, steps=0.0):
    """A finished analysis; steps: in which the place is recorded, m."""
    system = spring(folder)
    runs = (recorded_in_steps(swung(s, cubic(cube), noise=noise), steps) for s in (1, 2))
    learnt, proof = ([system.prepare(r)] for r in runs)
    return analyse(begin(system, learnt, proof), kinds(system))


def recorded_in_steps(recording: Recording, steps: float) -> Recording:
    if not steps:
        return recording
    place = recording.channels["place"]
    value = steps * np.round(place.value / steps)
    new = Channel("place", place.time, value, place.unit, place.clock, place.origin)
    return replace(recording, channels={**recording.channels, "place": new})


def ordered(a, count=3, **how):
    """A check with a constant clock, so that results can be compared."""
    order = Order(count, library=kinds(a.system), **{"clock": lambda: 0.0, **how})
    return check(a, verdict(a), order)


@pytest.fixture(scope="module")
def clear(tmp_path_factory):
    return analysed(tmp_path_factory.mktemp("clear"), *CLEAR)


def test_a_clear_effect_is_named_again_at_its_size_and_nothing_without_it(clear):
    found = ordered(clear, 4)
    assert (found.ended, found.failures) == (COMPLETE, ())
    assert found.same == found.place == Rate(4, 4)
    assert found.effects == {"cubic.deflection": Rate(4, 4)}
    assert found.inside.of == 4
    assert found.inside.count >= 3
    assert found.false_alarms == Rate(0, 4)


def test_an_effect_near_the_threshold_is_named_again_less_often(tmp_path):
    weak = analysed(tmp_path, *WEAK)
    assert verdict(weak).effects
    found = ordered(weak, 8)
    assert 0 < found.same.count < 8
    assert found.place.count == found.same.count
    assert found.answers[0].names == ()


def test_a_check_is_the_same_for_the_same_seed_only(clear):
    def sizes(seed):
        _, truth = simulated(clear, np.random.default_rng(seed), True)
        return [effect.cube for effect in truth.values()]

    assert ordered(clear, 2, seed=4) == ordered(clear, 2, seed=4)
    assert sizes(4) == sizes(4) != sizes(5)


def test_where_nothing_was_identified_only_false_alarms_are_counted(tmp_path):
    silent = analysed(tmp_path, 0.0, 2e-3)
    assert analyses_of(silent, 3) == 3
    found = ordered(silent, 3)
    assert (found.same.of, found.false_alarms.of) == (0, 3)
    lines = " ".join(check_lines(replace(verdict(silent), check=found)))
    assert "On 3 sets of recordings simulated without effects" in lines
    assert "accepted model the same" not in lines


def test_a_free_curve_in_the_simulation_is_simulated_as_well(tmp_path):
    """No lag explains a hardening spring: the verdict is an unknown effect."""
    system = spring(tmp_path)
    learnt, proof = ([system.prepare(swung(s, cubic(0.15)))] for s in (1, 2))
    few = [k for k in system.library if k.name == "lag" and k.place.name == "force"]
    a = analyse(begin(system, learnt, proof), few)
    assert a.free is not None
    with_curve, _ = simulated(a, np.random.default_rng(1), True)
    without, _ = simulated(a, np.random.default_rng(1), False)
    for made, plain in (
        (with_curve.training, without.training),
        (with_curve.held_out, without.held_out),
    ):
        apart = made.measured[0][0] - plain.measured[0][0]
        assert np.std(apart) > 10 * CLEAR[1]
    found = check(a, verdict(a), Order(1, library=few))
    assert (found.same.of, found.false_alarms.of) == (1, 1)
    assert list(found.effects) == ["unknown effect"]


def test_a_function_is_simulated_as_a_model_file_is():
    """The simulated recordings of a function differ from the recorded ones by noise only."""
    recordings = [swung(s, cubic(0.15), seconds=4.0) for s in (1, 2)]
    system = springs.system(recordings)
    learnt, proof = ([system.prepare(r)] for r in recordings)
    few = [k for k in system.library if k.name == "offset" and k.place.name == "place"]
    a = analyse(begin(system, learnt, proof), few)
    replica, _ = simulated(a, np.random.default_rng(1), True)
    residual = accepted(a).residuals[0][0]
    apart = replica.training.measured[0][0] - a.training.measured[0][0]
    assert np.std(apart) == pytest.approx(np.sqrt(2.0) * np.std(residual), rel=0.5)


@pytest.mark.parametrize("ended", [INTERRUPTED, OUT_OF_TIME])
def test_an_early_end_keeps_what_was_done(clear, ended):
    """Progress messages precede each analysis and occur within it; the third is stopped."""
    begun, ticks = list[str](), count()

    def say(words):
        begun.append(words.partition(":")[0])
        if ended == INTERRUPTED and len(set(begun)) > 2:
            raise KeyboardInterrupt

    def clock():
        next(ticks)
        return 100.0 if ended == OUT_OF_TIME and len(set(begun)) > 2 else 0.0

    order = Order(5, limit=10.0, library=kinds(clear.system), clock=clock)
    found = check(clear, verdict(clear), order, say)
    assert found.ended == ended
    assert (found.same.of, found.false_alarms.of) == (1, 1)
    same = ordered(clear, 1)
    assert (found.same, found.false_alarms) == (same.same, same.false_alarms)
    assert ended in " ".join(check_lines(replace(verdict(clear), check=found)))


def test_an_analysis_that_fails_counts_as_another_answer(clear, monkeypatch):
    from slipbench.identification.mismatch.predictive_check import check as checking

    def broken(*_, **__):
        raise ValueError("no")

    monkeypatch.setattr(checking, "analyse", broken)
    found = ordered(clear, 2)
    assert found.same == Rate(0, 2)
    assert len(found.failures) == 4
    assert "failed: 4" in " ".join(check_lines(replace(verdict(clear), check=found)))


def test_without_noise_sensors_record_what_the_simulation_shows(clear):
    fit = clear.named.fit
    silent = [[np.zeros_like(m) for m in ms] for ms in fit.model.measured]
    [record] = replicated(fit.model, fit.point, silent, clear.training.records)
    shown = predict(fit.model, fit.point)[0][0][:, 0]
    np.testing.assert_allclose(record.sensors["place"].value, shown, rtol=1e-12, atol=1e-12)
    assert record.inputs is clear.training.records[0].inputs


def test_noise_that_is_whitened_and_coloured_is_the_same(clear):
    fit = clear.named.fit
    [white], [[residual]] = whiteners(fit.model, fit.residuals), fit.residuals
    lead = np.zeros((white.order, 1))
    series = np.concatenate((lead, residual))
    np.testing.assert_allclose(coloured(white, white.innovations(series)), residual, atol=1e-9)


def test_noise_is_as_large_and_as_coloured_as_the_residuals(clear):
    fit = clear.named.fit
    residual = fit.residuals[0][0][:, 0]
    drawn = [noise_like(fit, np.random.default_rng(s))[0][0][:, 0] for s in range(40)]
    assert np.mean(np.square(drawn)) == pytest.approx(np.mean(residual**2), rel=0.1)
    for lag in (1, 5):
        own = np.mean(residual[lag:] * residual[:-lag]) / np.mean(residual**2)
        made = np.mean([np.mean(e[lag:] * e[:-lag]) for e in drawn]) / np.mean(np.square(drawn))
        assert made == pytest.approx(own, abs=0.08)


def test_an_unstable_autoregression_does_not_grow(clear):
    [white] = clear.named.fit.noise
    wild = replace(white, lags=np.full((2, 1, 1), 0.9))
    assert np.abs(coloured(wild, np.ones((5000, 1)) * 1e-3)).max() < 1.0


def test_simulated_samples_lie_on_the_steps_of_the_channel(tmp_path):
    a = analysed(tmp_path, 0.15, 2e-3, steps=0.05)
    replica, _ = simulated(a, np.random.default_rng(3), True)
    readings = replica.training.records[0].sensors["place"].samples_read
    np.testing.assert_allclose(readings / 0.05, np.round(readings / 0.05), atol=1e-3)
    own = a.training.records[0].sensors["place"]
    assert np.std(readings) == pytest.approx(np.std(own.samples_read), rel=0.1)


@given(st.floats(1e-3, 10.0), st.floats(-5.0, 5.0), st.floats(-100.0, 100.0))
def test_rounding_moves_by_half_a_step_at_most_and_only_once(step, phase, value):
    quantization = QuantizationGrid(step, phase)
    once = quantization.rounded(np.array([value]))
    assert abs(once[0] - value) <= 0.5 * step + 1e-9
    np.testing.assert_allclose(quantization.rounded(once), once, atol=1e-9)


@given(st.integers(0, 50).flatmap(lambda n: st.tuples(st.integers(0, n), st.just(n))))
def test_the_interval_of_a_rate_contains_it_and_mirrors_the_opposite(numbers):
    count, of = numbers
    low, high = Rate(count, of).interval
    assert 0.0 <= low <= high <= 1.0
    if of:
        assert low <= count / of <= high
    other = Rate(of - count, of).interval
    assert (1.0 - high, 1.0 - low) == pytest.approx(other, abs=1e-9)


def test_names_of_a_class_are_alike_whichever_analysis_has_the_class():
    classes = [("a + b", "c")]
    assert indistinguishable("a", "a", ())
    assert indistinguishable("b", "c", classes)
    assert indistinguishable("c", "b", classes)
    assert not indistinguishable("a", "c", classes)


def test_another_effect_is_not_the_same_answer(clear):
    found = verdict(clear)
    [effect] = found.effects
    other = replace(found, effects=(replace(effect, name="quadratic"),))
    both = replace(found, effects=(effect, replace(effect, name="quadratic")))
    tied = replace(other, equivalents=(("quadratic.deflection", "cubic.deflection"),))
    first, *results = (result_of(clear, v) for v in (found, found, other, both, tied))
    assert [compare(first, a, {}).same for a in results] == [True, False, False, True]
    assert first.places == {"deflection"}
    other_place = replace(first, places=frozenset(["force"]))
    assert compare(first, first, {}).place
    assert not compare(first, other_place, {}).place


def test_an_effect_that_cannot_be_told_apart_is_the_same_answer_at_the_same_place(clear):
    """As offsets of a force and of its spring: the injection points are indistinguishable."""
    found = verdict(clear)
    [effect] = found.effects
    twin = replace(effect, name="offset", subject="force")
    tied = replace(found, effects=(twin,), equivalents=(("cubic.deflection", "offset.force"),))
    first = result_of(clear, found)
    again = replace(result_of(clear, tied), places=frozenset(["force"]))
    both = compare(first, again, {})
    assert (both.same, both.place) == (True, True)
    other = compare(first, replace(again, verdict=replace(tied, equivalents=())), {})
    assert (other.same, other.place) == (False, False)


def test_the_command_reports_the_check_and_keeps_to_the_schema(clear, tmp_path, monkeypatch):
    from slipbench.identification.mismatch import runs

    monkeypatch.setattr(runs, "open_analysis", lambda *_: clear)
    few = tuple(kinds(clear.system))
    monkeypatch.setattr(ModelSystem, "library", property(lambda _: few))
    out, report = tmp_path / "verdict.json", tmp_path / "report"
    command = ["explain", "--vehicle", str(tmp_path / "spring.toml"), "run", "--json", str(out)]
    command += ["--report", str(report), "--check", "--check-count", "1", "--check-minutes", "5"]
    done = CliRunner().invoke(app, command)
    assert done.exit_code == 0, done.output
    assert "Check: 2 analyses of simulated recordings, seed 1; expected time" in done.output
    assert "On 1 set of recordings simulated from the accepted model" in done.output
    tree = json.loads(out.read_text("utf-8"))
    jsonschema.validate(tree, SCHEMA)
    assert tree["check"]["same"]["of"] == 1
    assert "Check by simulation" in (report / "memo.html").read_text("utf-8")


@pytest.mark.parametrize("option", ["--check-count", "--check-minutes", "--check-seed"])
def test_an_option_of_a_check_is_refused_without_it(option, tmp_path):
    command = ["explain", "--vehicle", str(tmp_path / "spring.toml"), "run", option, "3"]
    done = CliRunner().invoke(app, command)
    assert done.exit_code != 0
    assert f"{option} has no effect without --check" in str(done.exception or done.output)


def test_every_check_keeps_to_the_schema():
    nothing = Rate(0, 0)
    empty = Check(1, 10, 0.0, None, INTERRUPTED, nothing, nothing, nothing, nothing)
    found = Verdict(False, 1.0, check=empty)
    jsonschema.validate(json.loads(as_json(found)), SCHEMA)
    assert list(check_lines(found))
