"""Laws of a trial file: no limit can be switched off, and no unit can be mistaken for another."""

import math
import re
from typing import Any, get_args

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import BaseModel

from slipbench.protocol.configuration import load_toml, parse
from slipbench.protocol.errors import InputError
from slipbench.protocol.quantity import UNITS, Between, Quantity, read_quantity
from slipbench.protocol.trial_file import (
    AMPLITUDES,
    Command,
    Limits,
    Multisine,
    OperatingPoint,
    Square,
    Stretch,
    Sweep,
    Timing,
    TrialFile,
    VirtualRider,
)
from slipbench.protocol.units import linear
from tests.bench.conditions import trial_file
from tests.paths import TRIALS

SWEEP = load_toml(TRIALS / "throttle_sweep.toml")
SECTIONS = {"limits": Limits, "command": Command}


def bounds_of(field: Any) -> list[Between]:
    """The bounds of a field: one, two for a pair, none for a whole number."""
    found = [item for item in field.metadata if isinstance(item, Between)]
    for argument in get_args(field.annotation):
        found += [item for item in getattr(argument, "__metadata__", ()) if type(item) is Between]
    return found


def keys(table: str) -> list[str]:
    return list(SECTIONS[table].model_fields)


BOUNDED = [
    (table, key, place, bound)
    for table in SECTIONS
    for key in keys(table)
    for place, bound in enumerate(bounds_of(SECTIONS[table].model_fields[key]))
]


def refused(table: str, key: str, value: Any) -> str:
    with pytest.raises(InputError) as fault:
        trial_file(**{f"{table}__{key}": value})
    return str(fault.value)


def stated(table: str, key: str, place: int, text: Any) -> Any:
    """The value of a key with `text` at a place of a pair, the rest as in the example."""
    pair = bounds_of(SECTIONS[table].model_fields[key])[1:]
    if not pair:
        return text
    whole = list(SWEEP[table].get(key, ["1 %", "30 %"]))
    whole[place] = text
    return whole


def test_every_key_of_limits_and_command_has_a_hard_bound_with_a_reason():
    for table, section in SECTIONS.items():
        for key, field in section.model_fields.items():
            assert bounds_of(field) or key == "faults", f"{table}.{key}"
    assert all(len(bound.reason.split()) > 4 for *_, bound in BOUNDED)


@pytest.mark.parametrize("beyond", [-1e6, 1e6], ids=["far below", "far above"])
@pytest.mark.parametrize(("table", "key", "place", "bound"), BOUNDED)
def test_an_absurd_value_is_refused_with_file_key_bound_and_reason(
    table, key, place, bound, beyond
):
    unit = bound.high.partition(" ")[2]
    told = refused(table, key, stated(table, key, place, f"{beyond:g} {unit}"))
    assert "trial.toml" in told
    assert f"{table}.{key}" in told
    assert f"{beyond:g} {unit}" in told  # as it was written
    assert bound.high in told
    assert bound.low in told
    assert bound.reason in told


@pytest.mark.parametrize("value", [0, 11, 10**9, -3, 2.5, True, "3", math.inf])
def test_a_number_of_faults_that_could_never_trip_is_refused(value):
    told = refused("limits", "faults", value)
    assert "trial.toml: limits.faults" in told
    assert "1 to 10, because" in told


def test_faults_that_come_after_stale_could_never_trip():
    trial_file(limits__faults=5, limits__stale="6 ms")
    with pytest.raises(InputError, match=r"faults = 6 could never trip.*stale = 6 ms"):
        trial_file(limits__faults=6, limits__stale="6 ms")


@pytest.mark.parametrize("name", ["throttle_rate", "spark_rate"])
def test_a_rate_that_one_command_cannot_exceed_could_never_trip(name):
    changes = {
        "command__period": "10 ms",
        "limits__spark": ["-1 deg", "1 deg"],
        "limits__spark_rate": "100 deg/s",
        "limits__throttle_deviation": "6 %",
        "limits__throttle_rate": "1000 %/s",
    }
    trial_file(**changes)
    sharp = {"throttle_rate": "1200 %/s", "spark_rate": "200 deg/s"}[name]
    with pytest.raises(InputError, match=rf"limits.{name} = {sharp} could never trip"):
        trial_file(**(changes | {f"limits__{name}": sharp}))


@pytest.mark.parametrize(("table", "key", "place", "bound"), BOUNDED)
def test_a_bare_number_is_refused_and_the_unit_named(table, key, place, bound):
    for value in (15, 0.1, 0, math.inf, math.nan, "0.1", "15", True, None, []):
        told = refused(table, key, stated(table, key, place, value))
        assert f"{table}.{key}" in told
        if type(value) in (int, float):
            assert "the unit is missing" in told
            assert bound.high in told


def units_of(kind: str) -> st.SearchStrategy[str]:
    return st.sampled_from(UNITS[kind])


@pytest.mark.parametrize(("table", "key", "place", "bound"), BOUNDED)
@given(data=st.data())
def test_what_is_accepted_lies_within_the_bounds(table, key, place, bound, data):
    """Any number in any unit of its kind: accepted values lie within, others name the key."""
    unit = data.draw(units_of(bound.kind))
    low, high = bound.bounds()
    span = high - low
    slope, _ = linear(unit, low.si)
    number = data.draw(
        st.floats(allow_nan=True, allow_infinity=True)
        | st.floats((low - span) / slope, (high + span) / slope)
        | st.sampled_from([low / slope, high / slope])
    )
    text = f"{number!r} {unit}"
    try:
        trial = trial_file(**{f"{table}__{key}": stated(table, key, place, text)})
    except InputError as fault:
        if not re.search(rf"{table}|{key}", str(fault)):
            raise
        return
    value = getattr(getattr(trial, table), key)
    value = value[place] if isinstance(value, tuple) else value
    assert low - 1e-9 * abs(low) <= value <= high + 1e-9 * abs(high)
    assert str(value) == text


OTHER = {
    "throttle": ["2 deg", "0.03 rad", "2 rpm", "2 % %", "2 %/s", "2 m", "2 s", "2 bar", "2 %%"],
    "slip": ["2 deg", "0.03 rad", "2 % %", "2 Hz", "2 ppm", "2 dB"],
    "spark": ["2 %", "2 deg/s", "2 Hz", "2 1", "2 deg deg", "2 % deg", "2 turn", "2 rpm s"],
}


@pytest.mark.parametrize(
    ("actuator", "amplitude"), [(name, text) for name, texts in OTHER.items() for text in texts]
)
def test_an_amplitude_in_another_quantity_s_unit_is_refused(actuator, amplitude):
    changes: dict[str, Any] = {"excitation__actuator": actuator, "excitation__amplitude": amplitude}
    if actuator == "slip":
        changes["controller"] = {"file": "controller.toml"}
    with pytest.raises(InputError, match=r"trial\.toml: excitation\.amplitude = ") as fault:
        trial_file(**changes)
    assert amplitude in str(fault.value)


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("limits__throttle_rate", "600 rpm"),
        ("limits__throttle_rate", "600 deg/s"),
        ("limits__throttle_rate", "6 Hz"),
        ("limits__spark_rate", "600 %/s"),
        ("limits__spark_rate", "100 rpm"),
        ("limits__slip", "4 deg"),
        ("limits__slip", "8 % %"),
        ("limits__speed", ["30 Hz", "70 m/s"]),
        ("limits__engine_speed", ["11000 Hz", "15500 rpm"]),
        ("limits__engine_speed", ["11000 1/s", "15500 rpm"]),
        ("limits__clutch", "10 deg"),
        ("operating_point__engine_speed", "230 Hz"),
        ("excitation__stop", "300 rpm"),
        ("excitation__stop", "5 rad/s"),
        ("excitation__stop", "500 %/s"),
    ],
)
def test_a_unit_that_converts_but_means_something_else_is_refused(key, value):
    with pytest.raises(InputError, match=r"trial\.toml: ") as fault:
        trial_file(**{key: value})
    assert key.replace("__", ".") in str(fault.value)
    assert "the unit '" in str(fault.value)


@given(number=st.floats(-1e6, 1e6), kind=st.sampled_from(list(UNITS)), data=st.data())
def test_a_quantity_keeps_its_text_and_says_other_values_in_its_unit(number, kind, data):
    unit = data.draw(st.sampled_from(UNITS[kind]))
    quantity = read_quantity(f"{number!r} {unit}", kind)
    assert str(quantity) == f"{number!r} {unit}"
    said, _, same = quantity.like(quantity).partition(" ")
    assert same == unit
    assert float(said) == pytest.approx(number, rel=1e-5, abs=1e-9)


def test_every_quantity_of_a_trial_file_is_bounded():
    """A field that is a number and has no bounds is a way past them."""
    models: list[type[BaseModel]] = [OperatingPoint, Sweep, Square, Multisine, Timing, Stretch]
    for model in [*models, VirtualRider, TrialFile, Limits, Command]:
        for key, field in model.model_fields.items():
            if "float" in str(field.annotation) and key not in ("amplitude", "factor"):
                assert bounds_of(field), f"{model.__name__}.{key}"
    assert set(AMPLITUDES) == {"throttle", "spark", "slip"}


@pytest.mark.parametrize(
    "changes",
    [
        {"seed": -1},
        {"seed": 2**64},
        {"excitation__duration": "1 us"},
        {"road": [{"of": "grip", "from": "0 m", "to": "9 m", "factor": 1e300}]},
        {"road": [{"of": "load", "from": "0 m", "to": "9 m", "factor": 100}]},
        {"road": [{"of": "load", "from": "0 m", "to": "9 m", "factor": 0.0}]},
        {"name": "x" * 300},
        {"name": "a\0b"},
    ],
)
def test_a_value_that_would_fail_later_is_refused_when_the_file_is_read(changes):
    with pytest.raises(InputError, match=r"trial\.toml"):
        trial_file(**changes)


def test_a_recording_of_before_these_bounds_is_still_read():
    data = {**SWEEP, "limits": SWEEP["limits"] | {"stale": 15, "slip": 8.0, "faults": 99}}
    with pytest.raises(InputError):
        parse(data, TrialFile, "trial.toml")
    limits = parse(data, TrialFile, "trial.toml", recorded=True).limits
    assert (limits.stale, limits.slip, limits.faults) == (15.0, 8.0, 99)
    assert isinstance(limits.stale, Quantity)
