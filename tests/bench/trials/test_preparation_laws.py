"""Laws of a trial before it begins: what its excitation is, and what is refused with which words."""

import math
import re
import shutil
from dataclasses import replace
from pathlib import Path
from unittest.mock import patch

import numpy as np
import pytest

from slipbench import dbc
from slipbench.bench.loop.loop import LAST_TICK, MOST_TICKS
from slipbench.bench.trials import excitation as excitation_module
from slipbench.bench.trials.excitation import Excitation, plan_excitation
from slipbench.bench.trials.preparation import (
    _check_length,
    check_amplitude,
    check_controller,
    prepare,
)
from slipbench.bench.trials.wire_limits import check_wire
from slipbench.bench.vehicle.virtual_motorcycle import read_vehicle
from slipbench.protocol.codec.codec import Codec
from slipbench.protocol.configuration import load_toml, parse, read_toml
from slipbench.protocol.controller_file import ControllerFile
from slipbench.protocol.database.database import load_database
from slipbench.protocol.errors import InputError
from slipbench.protocol.quantity import read_quantity
from slipbench.protocol.trial_file import TrialFile
from slipbench.protocol.waveforms import waveform
from tests.bench.conditions import trial_file
from tests.paths import CONTROLLERS, DEMONSTRATION, TRIALS

DATABASE = load_database(dbc.MOTORBIKE)


def refused(words, call, *arguments):
    """What an InputError says."""
    with pytest.raises(InputError, match=words) as caught:
        call(*arguments)
    return str(caught.value)


def excited(**changes):
    return {f"excitation__{key}": value for key, value in changes.items()}


def slip_trial(**changes) -> TrialFile:
    """A trial under slip control."""
    tree = load_toml(TRIALS / "slip_steps_throttle.toml")
    tree["excitation"] |= changes
    return parse(tree, TrialFile, "trial.toml")


def test_a_value_is_that_of_the_command_period_it_lies_in_and_zero_outside():
    made = Excitation("throttle", np.array([1.0, 2.0, 3.0]), 0.25)
    assert made.duration == 0.75
    for time, value in (
        (0.0, 1.0),
        (0.2, 1.0),
        (0.25, 2.0),
        (0.25 - 1e-5, 2.0),  # a sum of periods may fall a hair short
        (0.5, 3.0),
        (0.74, 3.0),
        (0.75, 0.0),
        (9.0, 0.0),
        (-0.01, 0.0),
        (math.nan, 0.0),
        (math.inf, 0.0),
        (-math.inf, 0.0),
    ):
        assert made.value(time) == value, time
    assert made.value(0.25 - 0.001) == 1.0


@pytest.mark.parametrize("actuator", ["throttle", "spark"])
def test_a_sweep_is_its_waveform_times_its_amplitude_at_the_command_period(actuator):
    amplitude = {"throttle": "4 %", "spark": "2 deg"}[actuator]
    trial = trial_file(**excited(actuator=actuator, amplitude=amplitude, duration="1.9 s"))
    made = plan_excitation(trial)
    size = {"throttle": 0.04, "spark": math.radians(2.0)}[actuator]
    time = np.arange(round(1.9 / trial.command.period)) * trial.command.period
    assert (made.actuator, made.period) == (actuator, trial.command.period)
    expected = size * waveform(trial.excitation)(time)
    moving = np.flatnonzero(made.table)[-1] + 1
    np.testing.assert_allclose(made.table[:moving], expected[:moving], atol=1e-15)
    assert made.table.size == time.size
    rest = expected[moving:]
    assert np.all(np.sign(rest[1:]) == np.sign(rest[-1]))  # nothing but the last half wave is left


def test_a_target_of_slip_keeps_its_waveform_to_the_end():
    trial = slip_trial()
    made = plan_excitation(trial)
    time = np.arange(made.table.size) * trial.command.period
    assert (made.actuator, made.period) == ("slip", trial.command.period)
    np.testing.assert_array_equal(made.table, 0.001 * waveform(trial.excitation)(time))
    assert np.all(plan_excitation(slip_trial(amplitude="0 %")).table == 0.0)


def test_a_square_wave_ramps_at_the_rate_limit_and_is_home_with_the_last_command():
    trial = trial_file(
        excitation={
            "actuator": "throttle",
            "waveform": "square",
            "frequency": "1 Hz",
            "amplitude": "4 %",
            "duration": "2.25 s",
        },
        limits__throttle_rate="100 %/s",
    )
    table = plan_excitation(trial).table
    steps = np.diff(table, prepend=0.0, append=0.0)
    step = 1.0 * trial.command.period
    assert np.max(np.abs(steps)) <= step * (1 + 1e-9)
    assert table[0] == pytest.approx(step)
    assert table[39] == table[499] == 0.04  # 40 ms up, and there until half a period has passed
    assert table[500 + 79] == pytest.approx(-0.04)
    assert table[-1] == pytest.approx(0.0, abs=1e-12)
    assert table[-2] == pytest.approx(step, abs=1e-12)
    assert table[-41] == pytest.approx(0.04, abs=1e-9)


@pytest.mark.parametrize("period", [0.001, 0.002])
@pytest.mark.parametrize(
    ("shape", "key"),
    [
        ({"waveform": "linear_sweep", "start": "1 Hz"}, "stop"),
        ({"waveform": "linear_sweep", "stop": "1 Hz"}, "start"),
        ({"waveform": "square"}, "frequency"),
        ({"waveform": "multisine", "lowest": "1 Hz", "period": "2 s"}, "highest"),
    ],
)
def test_a_frequency_of_20_commands_a_cycle_is_carried_and_a_higher_one_is_not(period, shape, key):
    carried = 1 / (20 * period)
    base = {"actuator": "throttle", "amplitude": "0.1 %", "duration": "4 s", **shape}
    for factor, fits in ((1.0, True), (1.001, False)):
        trial = trial_file(
            excitation={**base, key: f"{carried * factor} Hz"},
            command__period=f"{period * 1e3:g} ms",
            limits__throttle_rate="600 %/s",
        )
        if fits:
            plan_excitation(trial)
            continue
        words = refused("more than the command rate carries", plan_excitation, trial)
        assert f"excitation.{key} = " in words
        for part in (f"at most {carried:g} Hz", f"every {period * 1e3:g} ms", trial.name):
            assert part in words


def multisine(**changes):
    shape = {"lowest": "1 Hz", "highest": "5 Hz", "period": "2 s", "duration": "4 s", **changes}
    base = {"actuator": "throttle", "amplitude": "1 %", "waveform": "multisine"}
    return trial_file(excitation={**base, **shape})


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"lowest": "0.6 Hz", "highest": "1.4 Hz", "period": "1 s"}, None),  # harmonic 1
        ({"lowest": "1 Hz", "highest": "1 Hz", "period": "1 s"}, None),
        ({"lowest": "3 Hz", "highest": "3 Hz", "period": "1 s"}, None),
        ({"lowest": "1.1 Hz", "highest": "2.9 Hz", "period": "1 s"}, "no odd harmonic"),
        ({"lowest": "2 Hz", "highest": "2 Hz", "period": "1 s"}, "no odd harmonic"),
        ({"lowest": "0.3 Hz", "highest": "0.9 Hz", "period": "1 s"}, "no odd harmonic"),
        ({"lowest": "2 Hz", "highest": "2.4 Hz", "period": "2 s"}, "no odd harmonic"),  # 4 .. 4.8
        ({"duration": "2 s"}, None),
        ({"duration": "1.999 s"}, "shorter than one period"),
    ],
)
def test_a_multisine_needs_an_odd_harmonic_and_a_whole_period(changes, words):
    if words is None:
        plan_excitation(multisine(**changes))
        return
    refused(words, plan_excitation, multisine(**changes))


@pytest.mark.parametrize(
    ("trial", "words"),
    [
        (trial_file(**excited(amplitude="9 %")), "excitation.amplitude"),
        (trial_file(**excited(stop="60 Hz")), "more than the command rate carries"),
        (trial_file(limits__throttle_rate="50 %/s"), "faster than the trial's rate limit"),
        (multisine(lowest="2 Hz", highest="2 Hz", period="1 s"), "no odd harmonic"),
        (multisine(duration="1.9 s"), "shorter than one period"),
    ],
)
def test_every_refusal_of_an_excitation_names_the_trial(trial, words):
    assert "mine.toml" in refused(words, plan_excitation, trial, "mine.toml")
    assert trial.name in refused(words, plan_excitation, trial)


def test_what_rounding_adds_to_a_frequency_at_its_bound_is_allowed():
    trial = trial_file(**excited(amplitude="0.1 %"), limits__throttle_rate="600 %/s")
    highest = 1 / (20 * trial.command.period) * (1 + 1e-9)
    spec = trial.excitation.model_copy(update={"stop": highest})
    plan_excitation(trial.model_copy(update={"excitation": spec}))
    trial = multisine(period="1 s")
    lowest = 1.0 + 1e-9
    assert lowest - 1e-9 == 1.0
    spec = trial.excitation.model_copy(update={"lowest": lowest, "highest": 1.5})
    plan_excitation(trial.model_copy(update={"excitation": spec}))


@pytest.mark.parametrize(
    ("actuator", "limit", "most"),
    [
        ("throttle", {"limits__throttle_deviation": "5 %"}, "5 %"),
        ("spark", {"limits__spark": ["-4 deg", "9 deg"]}, "4 deg"),
        ("spark", {"limits__spark": ["-9 deg", "4 deg"]}, "4 deg"),
    ],
)
def test_an_amplitude_may_be_as_large_as_the_limit_and_no_larger(actuator, limit, most):
    number, unit = most.split()
    slow = {"limits__throttle_rate": "600 %/s", "limits__spark_rate": "200 deg/s"}
    for factor, fits in ((1.0, True), (1.001, False), (0.0, False)):
        amplitude = f"{float(number) * factor} {unit}"
        trial = trial_file(**limit, **slow, **excited(actuator=actuator, amplitude=amplitude))
        if fits:
            plan_excitation(trial)
        else:
            words = refused("excitation.amplitude", plan_excitation, trial)
            assert f"limits.{'throttle_deviation' if actuator == 'throttle' else 'spark'}" in words


@pytest.mark.parametrize("share", [0.999, 1.001])
def test_a_rate_may_be_as_high_as_the_limit_and_no_higher(share):
    trial = trial_file(limits__throttle_rate="600 %/s")
    table = plan_excitation(trial).table
    fastest = np.max(np.abs(np.diff(table, prepend=0.0, append=0.0))) / trial.command.period
    other = trial_file(limits__throttle_rate=f"{share * fastest * 100} %/s")
    if share > 1:
        plan_excitation(other)
    else:
        words = refused("faster than the trial's rate limit", plan_excitation, other)
        assert "limits.throttle_rate" in words


def test_a_rate_may_be_above_its_limit_by_what_rounding_adds():
    trial = trial_file(limits__throttle_rate="600 %/s")
    table = plan_excitation(trial).table
    fastest = float(np.max(np.abs(np.diff(table, append=0.0)))) / trial.command.period
    near = fastest / (1 + 1e-9)
    bounds = [near, math.nextafter(near, 0.0), math.nextafter(near, 1e9)]
    exact = next(rate for rate in bounds if rate * (1 + 1e-9) == fastest)
    for rate, fits in ((exact, True), (fastest / (1 + 2e-9), False)):
        limits = trial.limits.model_copy(update={"throttle_rate": rate})
        other = trial.model_copy(update={"limits": limits})
        if fits:
            plan_excitation(other)
        else:
            refused("faster than the trial's rate limit", plan_excitation, other)


@pytest.mark.parametrize("end", [1, -1])
def test_a_jump_from_rest_or_back_to_it_is_a_rate_as_well(end):
    def wave(time):
        return np.linspace(1.0, 0.0, time.size)[::end]

    with patch.object(excitation_module, "waveform", lambda _: wave):
        refused("faster than the trial's rate limit", plan_excitation, trial_file())


@pytest.mark.parametrize(
    ("wave", "played"),
    [
        ([1.0], [1.0]),  # it never crosses zero
        ([1.0, 3.0], [1.0, 3.0]),
        ([-1.0, 0.5], [-1.0, 0.5]),  # the next step would be zero: a whole period
        ([2.0, 4.0, -2.0, -1.0], [2.0, 4.0, -2.0, -1.0]),
        ([2.0, 4.0, -1.01, -0.01 - 1.0], [2.0, 4.0, 0.0, 0.0]),
        ([1.0, -0.01, -1.01], [1.0, -0.01, -1.01]),  # one step and a hundredth, as much as may be
        ([1.0, 2.0, -2.5, -1.5], [1.0, 2.0, 0.0, 0.0]),
        ([1.0, -1.0, -3.0, -2.0, -1.5], [1.0, 0.0, 0.0, 0.0, 0.0]),
        ([1.0, -1.0, 2.0, 5.0], [1.0, -1.0, 0.0, 0.0]),
    ],
)
def test_an_excitation_ends_with_the_last_zero_crossing_or_with_a_whole_period(wave, played):
    trial = trial_file()
    spec = trial.excitation.model_copy(
        update={"amplitude": 1.0, "duration": len(wave) * trial.command.period}
    )
    limits = trial.limits.model_copy(update={"throttle_deviation": 1.0, "throttle_rate": 1e9})
    trial = trial.model_copy(update={"excitation": spec, "limits": limits})
    with patch.object(excitation_module, "waveform", lambda _: lambda _time: np.array(wave)):
        assert plan_excitation(trial).table.tolist() == played


def test_a_trial_may_take_as_many_ticks_as_the_loop_can_count_and_no_more():
    trial = trial_file()
    least = trial.operating_point.steady_for + trial.settling + trial.hand_back
    longest = LAST_TICK * trial.command.period
    for extra, fits in ((-1e-3, True), (1e-3, False)):
        spec = trial.excitation.model_copy(update={"duration": longest - least + extra})
        long = trial.model_copy(update={"excitation": spec})
        if fits:
            _check_length(long, "trial.toml")
        else:
            words = refused("ticks", _check_length, long, "trial.toml")
            for part in (str(MOST_TICKS), f"{longest:g}", "trial.toml"):
                assert part in words
    period = 2**-10  # s; every sum is exact in binary
    spec = trial.excitation.model_copy(update={"duration": LAST_TICK * period - 1.75})
    half = {"settling": 0.5, "hand_back": 0.25, "excitation": spec}
    point = trial.operating_point.model_copy(update={"steady_for": 1.0})
    command = trial.command.model_copy(update={"period": period})
    exact = trial.model_copy(update={**half, "operating_point": point, "command": command})
    _check_length(exact, "trial.toml")
    spec = spec.model_copy(update={"duration": LAST_TICK * period - 1.75 + period})
    refused("ticks", _check_length, exact.model_copy(update={"excitation": spec}), "trial.toml")


@pytest.mark.parametrize(("number", "fits"), [(0.09, True), (0.045, True), (0.039, False)])
def test_an_excitation_must_stay_within_the_throttles_range_around_the_opening(number, fits):
    prepared = prepare(TRIALS / "throttle_sweep.toml", dbc.MOTORBIKE)
    swing = float(np.max(np.abs(prepared.plan.excitation.table)))
    low, high = prepared.trial.limits.throttle
    for opening in (low + swing * number / 0.04, high - swing * number / 0.04):
        if fits and low + swing <= opening <= high - swing:
            check_amplitude(prepared, opening)
        elif not fits:
            words = refused("leave the throttle's range", check_amplitude, prepared, opening)
            for part in (f"{low:.1%}", f"{high:.1%}", f"{swing:.1%}", "throttle_sweep.toml"):
                assert part in words
    made = Excitation("throttle", np.array([0.0, 0.0625, -0.0625]), 0.001)  # exact in binary
    limits = prepared.trial.limits.model_copy(update={"throttle": (0.125, 0.875)})
    trial = prepared.trial.model_copy(update={"limits": limits})
    exact = replace(prepared, plan=replace(prepared.plan, trial=trial, excitation=made))
    for opening in (0.1875, 0.8125):
        check_amplitude(exact, opening)
    spark = replace(prepared.plan, excitation=replace(prepared.plan.excitation, actuator="spark"))
    check_amplitude(replace(prepared, plan=spark), 0.0)


def test_a_trial_is_prepared_from_its_own_files():
    path = TRIALS / "slip_steps_mixed.toml"
    prepared = prepare(path, dbc.MOTORBIKE)
    assert prepared.trial == prepared.plan.trial == read_toml(path, TrialFile)
    assert (prepared.trial_path, prepared.database_path) == (path, dbc.MOTORBIKE)
    assert prepared.controller_path == (CONTROLLERS / "mixed.toml").resolve()
    assert prepared.plan.controller == read_toml(CONTROLLERS / "mixed.toml", ControllerFile)
    assert prepared.vehicle_path.is_absolute()
    assert prepared.vehicle_path.name == prepared.trial.vehicle.rpartition("/")[2]
    assert prepared.scenario.trial == prepared.trial
    assert prepared.scenario.vehicle == read_vehicle(prepared.vehicle_path)
    assert prepared.database.origin == load_database(dbc.MOTORBIKE).origin
    open_loop = prepare(TRIALS / "throttle_sweep.toml", dbc.MOTORBIKE)
    assert open_loop.controller_path is None
    assert open_loop.plan.controller is None
    made, expected = open_loop.plan.excitation, plan_excitation(open_loop.trial)
    np.testing.assert_array_equal(made.table, expected.table)


def own_trial(folder, **changes):
    """A user's slip trial in `folder`; changes: what stands in place of a text of the file."""
    text = (TRIALS / "slip_steps_throttle.toml").read_text(encoding="utf-8")
    for key, value in {"vehicle": "demonstration", "file": "throttle", **changes}.items():
        text, count = re.subn(rf'(?m)^{key} = "[^"]*"', f'{key} = "{value}"', text)
        assert count == 1, key
    (folder / "mine.toml").write_text(text, encoding="utf-8")
    return folder / "mine.toml"


def test_vehicle_and_controller_are_found_beside_the_trial_or_by_the_name_of_a_shipped_file(
    tmp_path, monkeypatch
):
    by_name = prepare(own_trial(tmp_path), dbc.MOTORBIKE)
    assert by_name.vehicle_path == DEMONSTRATION.resolve()
    assert by_name.controller_path == (CONTROLLERS / "throttle.toml").resolve()
    shutil.copy(DEMONSTRATION, tmp_path / "bike.toml")
    shutil.copy(CONTROLLERS / "throttle.toml", tmp_path / "law.toml")
    path = own_trial(tmp_path, vehicle="bike.toml", file="law.toml")
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    for folder, trial_path in ((elsewhere, path), (tmp_path, Path("mine.toml"))):
        monkeypatch.chdir(folder)
        beside = prepare(trial_path, dbc.MOTORBIKE)
        assert beside.vehicle_path == (tmp_path / "bike.toml").resolve()
        assert beside.controller_path == (tmp_path / "law.toml").resolve()
    for key in ("vehicle", "file"):  # a shipped file of another kind is not one of this
        with pytest.raises(InputError, match="slipbench ships no"):
            prepare(own_trial(tmp_path, **{key: "throttle_sweep"}), dbc.MOTORBIKE)


@pytest.mark.parametrize(
    ("changes", "words", "file"),
    [
        ({"throttle_rate": "20 %/s"}, "further or faster", "throttle.toml"),
        ({"duration": "60 min"}, "ticks that the loop can count", "mine.toml"),
        ({"amplitude": "9 %"}, "excitation.amplitude", "mine.toml"),
    ],
)
def test_a_refusal_names_the_file_that_holds_the_fault(tmp_path, changes, words, file):
    path = own_trial(tmp_path, **changes)
    place = path if file == "mine.toml" else (CONTROLLERS / file).resolve()
    assert str(place) in refused(words, prepare, path, dbc.MOTORBIKE)


def test_a_refusal_of_what_the_database_cannot_carry_names_trial_and_database(tmp_path):
    lines = dbc.MOTORBIKE.read_text(encoding="utf-8").splitlines()
    kept = [line for line in lines if "GenMsgCycleTime" not in line]
    (tmp_path / "other.dbc").write_text("\n".join(kept) + "\n", encoding="utf-8")
    path = own_trial(tmp_path)
    told = refused("no cycle time", prepare, path, tmp_path / "other.dbc")
    assert str(path) in told
    assert "other.dbc" in told


@pytest.mark.parametrize(
    ("actuator", "place"), [("mixed", "throttle"), ("mixed", "spark"), ("spark", "spark")]
)
@pytest.mark.parametrize("key", ["low", "high", "rate"])
def test_a_controller_stays_within_the_trials_limits_of_each_actuator_that_it_moves(
    actuator, place, key
):
    """At the limit it is accepted, a hair beyond it is not."""
    trial = read_toml(TRIALS / f"slip_steps_{actuator}.toml", TrialFile)
    trial = trial.model_copy(update={"hand_back": 10.0})
    tree = load_toml(CONTROLLERS / f"{actuator}.toml")
    bounds = tree["mixed"]["throttle"] if place == "throttle" else tree["limits"]
    limits, most = trial.limits, trial.limits.throttle_deviation
    allowed = {
        "throttle": {"low": -most, "high": most, "rate": limits.throttle_rate},
        "spark": {"low": limits.spark[0], "high": limits.spark[1], "rate": limits.spark_rate},
    }[place]
    for factor, fits in ((1.0, True), (1.001, False)):
        bounds[key] = allowed[key] * factor
        file = parse(tree, ControllerFile, "controller.toml")
        if fits:
            check_controller(file, trial, "controller.toml")
        else:
            words = refused("further or faster", check_controller, file, trial, "controller.toml")
            assert f"move the {place}" in words
            assert "controller.toml" in words


def test_a_controller_of_the_throttle_may_go_further_than_the_trial_permits_the_spark():
    trial = read_toml(TRIALS / "slip_steps_throttle.toml", TrialFile)
    limits = trial.limits.model_copy(update={"spark": (-1e-3, 1e-3), "spark_rate": 1e-3})
    file = read_toml(CONTROLLERS / "throttle.toml", ControllerFile)
    check_controller(file, trial.model_copy(update={"limits": limits}), "controller.toml")


@pytest.mark.parametrize("actuator", ["throttle", "spark", "mixed"])
def test_a_refusal_of_a_controller_names_its_file(actuator):
    trial = read_toml(TRIALS / f"slip_steps_{actuator}.toml", TrialFile)
    file = read_toml(CONTROLLERS / f"{actuator}.toml", ControllerFile)
    quick = trial.model_copy(update={"hand_back": 1e-3})
    assert "my.toml" in refused(
        "the hand-back could move", check_controller, file, quick, "my.toml"
    )
    other = file.model_copy(update={"period": 0.002})
    assert "my.toml" in refused("another command period", check_controller, other, trial, "my.toml")


def test_a_hand_back_may_be_as_quick_as_the_rate_permits_and_the_remedy_names_the_least():
    trial = read_toml(TRIALS / "slip_steps_throttle.toml", TrialFile)
    file = read_toml(CONTROLLERS / "throttle.toml", ControllerFile)
    distance = max(-file.limits.low, file.limits.high) + trial.limits.throttle_deviation
    rate = float(trial.limits.throttle_rate)
    limits = trial.limits.model_copy(update={"throttle_rate": 8.0})
    exact = trial.model_copy(update={"limits": limits, "hand_back": distance / 8.0})
    check_controller(file, exact, "controller.toml")
    quick = trial.model_copy(update={"hand_back": read_quantity("10 ms", "s")})
    words = refused("the hand-back could move", check_controller, file, quick, "controller.toml")
    assert f"lengthen hand_back to {distance / rate * 1e3:.6g} ms" in words


def test_a_controllers_period_is_the_trials_to_a_nanosecond():
    trial = read_toml(TRIALS / "slip_steps_throttle.toml", TrialFile)
    tree = load_toml(CONTROLLERS / "throttle.toml")
    for off, fits in ((0.5e-9, True), (-0.5e-9, True), (2e-9, False), (-2e-9, False)):
        file = parse(tree | {"period": 0.001 + off}, ControllerFile, "controller.toml")
        if fits:
            check_controller(file, trial, "controller.toml")
        else:
            refused("another command period", check_controller, file, trial, "controller.toml")
    at_once = trial.command.model_copy(update={"period": 0.0})
    file = file.model_copy(update={"period": 1e-9})  # the difference is exact
    check_controller(file, trial.model_copy(update={"command": at_once}), "controller.toml")


@pytest.mark.parametrize(("actuator", "step"), [("throttle", "0.0001"), ("spark", "0.02")])
def test_an_excitation_of_one_step_of_the_command_is_carried_and_a_smaller_one_is_not(
    actuator, step
):
    signal = DATABASE.message("ActuatorCommand").signal(actuator)
    trial = trial_file(
        **excited(actuator=actuator, amplitude="1 %" if actuator == "throttle" else "1 deg")
    )
    size = signal.scale * (0.01 if signal.unit == "%" else math.radians(1.0))
    for factor, fits in ((1.0, True), (0.999, False)):
        made = Excitation(actuator, np.array([0.0, -size * factor, 0.0]), 0.001)
        if fits:
            check_wire(trial, made, Codec(DATABASE), "trial.toml")
        else:
            words = refused(
                "less than one step", check_wire, trial, made, Codec(DATABASE), "trial.toml"
            )
            assert f"ActuatorCommand.{actuator}" in words
    check_wire(trial, Excitation("slip", np.zeros(3), 0.001), Codec(DATABASE), "trial.toml")
