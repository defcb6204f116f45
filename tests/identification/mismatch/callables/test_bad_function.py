"""An unusable function is rejected with a message; a failing call does not stop the analysis."""

import os
import signal
import time
from dataclasses import replace

import numpy as np
import pytest

from slipbench import InputError, Parameter
from slipbench.identification.mismatch.analysis import begin
from slipbench.identification.mismatch.callables.call import Call, CallFailedError, in_process
from slipbench.identification.mismatch.callables.description import Ports
from slipbench.identification.mismatch.callables.worker import (
    CAN_ISOLATE,
    MOST_LOST,
    IsolatedCaller,
)
from slipbench.identification.mismatch.curves.injection import places, simulated_impulse_responses
from slipbench.identification.mismatch.fit.calibrate import start_fit
from slipbench.identification.mismatch.simulation.coordinates import Coordinate
from tests.identification.mismatch.callables import springs
from tests.identification.mismatch.laws.explained import explained, names, reported
from tests.identification.mismatch.laws.spring import swung

isolated = pytest.mark.skipif(not CAN_ISOLATE, reason="processes are forked on Linux only")


@pytest.fixture(scope="module")
def recording():
    return swung(5, seconds=2.0)


def changed(change):
    """Return the spring function with its response changed."""
    return lambda *arguments: change(springs.spring(*arguments))


def raises(*arguments):
    raise ZeroDivisionError("no damping")


@pytest.mark.parametrize(
    ("simulate", "sentence"),
    [
        (raises, "it raised ZeroDivisionError: no damping at gain = 100"),
        (changed(lambda out: out["place"]), "returned ndarray, not a mapping"),
        (
            changed(lambda out: {"position": out["place"]}),
            "did not return place; it returned position",
        ),
        (changed(lambda out: {}), "it returned nothing"),
        (changed(lambda out: {"place": out["place"][:-1]}), r"shape \(199,\); expected \(200,\)"),
        (changed(lambda out: {"place": out["place"][:, None]}), r"shape \(200, 1\)"),
        (changed(lambda out: {"place": 0.0}), r"shape \(\)"),
        (changed(lambda out: {"place": out["place"] * np.nan}), "nan at sample 0 of 200"),
        (
            changed(lambda out: {"place": out["place"] * 1e9}),
            "grows without bound(.|\\n)*place within",
        ),
        (changed(lambda out: {"place": ["a"] * 200}), "no array of real numbers"),
        (changed(lambda out: {"place": out["place"] + 0j}), "no array of real numbers"),
    ],
)
def test_what_a_function_does_wrong_is_said_before_any_analysis(recording, simulate, sentence):
    with pytest.raises(InputError, match=sentence):
        springs.system([recording], simulate).prepare(recording)


def test_a_function_that_gives_other_results_each_time_is_refused(recording):
    noise = np.random.default_rng(1)
    random = changed(lambda out: {"place": out["place"] + 1e-6 * noise.standard_normal(200)})
    with pytest.raises(InputError, match="two runs with the same parameters"):
        springs.system([recording], random).prepare(recording)


def test_a_function_may_change_its_arguments(recording):
    def careless(parameters, inputs, times):
        found = springs.spring(parameters, inputs, times)
        parameters.clear()
        inputs["force"][:] = 0.0
        times[:] = 0.0
        return found

    both = [
        springs.system([recording], one).prepare(recording) for one in (careless, springs.spring)
    ]
    assert np.array_equal(both[0].inputs, both[1].inputs)


@pytest.mark.parametrize(
    ("parameter", "sentence"),
    [
        (Parameter(0.1), "neither plus_minus nor bounds"),
        (Parameter(np.nan, 1.0), "not a finite number"),
        (Parameter(0.1, -1.0), "no half width"),
        (Parameter(0.1, np.inf), "no half width"),
        (Parameter(0.1, bounds=(0.2, 0.3)), "outside of the bounds"),
        (Parameter(0.1, bounds=(0.3, 0.2)), "the bounds are no range"),
        (Parameter(0.1, bounds=(0.0, np.inf)), "the bounds are no range"),
        (Parameter(0.1, 0.1, unit="furlong per jiffy cubed"), "cannot be used"),
    ],
)
def test_a_parameter_that_says_too_little_is_named(recording, parameter, sentence):
    parameters = {**springs.PARAMETERS, "damping": parameter}
    with pytest.raises(InputError, match=f"'damping'.*{sentence}"):
        springs.system([recording], parameters=parameters)


@pytest.mark.parametrize(
    ("ports", "sentence"),
    [
        (Ports(("force",), ()), "the outputs are not named"),
        (Ports(("forse",), ("place",)), "did you mean 'force'"),
        (Ports(("force",), ("place",), ("palce",)), "linear names 'palce'"),
        (Ports(("force",), ("force",)), "is an input and an output"),
    ],
)
def test_roles_that_do_not_fit_are_named(recording, ports, sentence):
    with pytest.raises(InputError, match=sentence):
        springs.system([recording], ports=ports)


def test_an_input_that_never_changes_is_said(recording):
    still = replace(recording.channels["force"], role="tilt", value=np.full(200, 0.2))
    more = replace(recording, channels={**recording.channels, "tilt": still})
    record = springs.system([more], ports=Ports(("force", "tilt"), ("place",))).prepare(more)
    assert any("tilt" in note and "constant" in note for note in record.notes)


def test_a_parameter_stays_within_its_bounds(recording):
    bounded = {**springs.PARAMETERS, "damping": Parameter(0.1, 0.05, bounds=(0.09, 0.12))}
    system = springs.system([recording], parameters=bounded)
    damping = Coordinate("parameters", "damping", 0.1, 0.25)
    for place in (-3.0, 0.0, 3.0):
        value = system.at([damping], np.array([place]), ()).values[2]
        assert value == pytest.approx(np.clip(damping.at(place), 0.09, 0.12))


def test_bounds_alone_say_how_far_a_parameter_may_be():
    assert Parameter(2.0, bounds=(1.0, 4.0), unit="mm").number("here").plus_minus == 1.5


@pytest.mark.parametrize("below", [0.9, 1.0])
def test_a_function_that_fails_at_some_parameters_is_still_explained(below):
    """It fails below, near which the gain of the recordings lies; the steps there are shorter."""

    def fails(parameters, inputs, times):
        if parameters["gain"] < below * 97.0:
            raise ValueError("too small")
        return springs.spring(parameters, inputs, times)

    def felt(force):
        return force - np.clip(force, -0.3, 0.3)

    training, held_out = [swung(1, felt=felt)], [swung(2, felt=felt)]
    found = explained(springs.system(training, fails), training, held_out, ["dead_zone", "lag"])
    assert names(found) == ["dead_zone.force"], reported(found)


def test_an_input_at_its_bound_is_pushed_the_other_way(recording):
    """The response of a linear system is the same."""
    recorded = float(recording.channels["force"].value.sum())

    def bounded(slack):
        def simulate(parameters, inputs, times):
            if inputs["force"].sum() > recorded + slack:
                raise ValueError("the force is too large")
            return springs.spring(parameters, inputs, times)

        return simulate

    def response(simulate):
        system = springs.system([recording], simulate)
        model = begin(system, [system.prepare(recording)], []).training.coarse
        fit = start_fit(model, model.origin())
        return simulated_impulse_responses(fit, places(fit)[0], {})[0][0]

    expected = response(springs.spring)
    assert np.ptp(expected) > 0.0
    assert np.allclose(response(bounded(1.0)), expected, atol=1e-9 * np.ptp(expected))


@isolated
def test_a_process_gives_what_a_function_gives(recording):
    alone, other = (springs.system([recording], time_limit=limit) for limit in (None, 20.0))
    prepared = [system.prepare(recording) for system in (alone, other)]
    runs = [s.simulator.kept.runs for s in (alone, other)]
    assert list(runs[0]) == list(runs[1])
    assert all(np.array_equal(runs[0][key], runs[1][key]) for key in runs[0])
    assert prepared[0].notes == prepared[1].notes


@isolated
def test_a_crash_and_a_hang_are_said_and_the_next_call_is_served(recording):
    def treacherous(parameters, inputs, times):
        if parameters["gain"] > 110.0:
            os.kill(os.getpid(), signal.SIGKILL)
        if parameters["gain"] < 90.0:
            time.sleep(60.0)
        return springs.spring(parameters, inputs, times)

    call = nominal_call(recording)
    caller = IsolatedCaller(in_process(treacherous), 1.0)
    expected = in_process(springs.spring)(call)["place"]
    for gain, sentence in ((120.0, "SIGKILL"), (80.0, "did not return within 1 s")):
        with pytest.raises(CallFailedError, match=sentence):
            caller(replace(call, parameters={**call.parameters, "gain": gain}))
        assert np.array_equal(caller(call)["place"], expected)
    caller.close()


@isolated
def test_a_function_that_always_crashes_is_given_up(recording):
    caller = IsolatedCaller(in_process(lambda *arguments: os._exit(3)), 20.0)
    sentences = []
    for _ in range(MOST_LOST + 1):
        with pytest.raises(CallFailedError) as fault:
            caller(nominal_call(recording))
        sentences.append((str(fault.value), fault.value.lost))
    assert sentences[0] == ("its process ended: exit status 3", False)
    assert sentences[-1] == (f"it hung or crashed {MOST_LOST} times: given up", True)


def nominal_call(recording):
    """A call of the nominal spring."""
    calls = []

    def keep(parameters, inputs, times):
        calls.append((parameters, inputs, times))
        return springs.spring(parameters, inputs, times)

    springs.system([recording], keep).prepare(recording)
    return Call(*calls[0], ("place",))
