"""Laws of degraded modes: each tightens limits by its share, none loosens, and each is on record."""

from dataclasses import replace
from itertools import combinations
from pathlib import Path
from typing import Any

import pytest

from slipbench.bench.trials.degraded import (
    BLIND_SHARE,
    SLIP_SHARE,
    SPEED_SHARE,
    degraded_trial,
    modes,
)
from slipbench.bench.trials.preparation import prepare
from slipbench.protocol.binding.binding import Binding
from slipbench.protocol.configuration import load_toml
from slipbench.protocol.errors import InputError
from slipbench.protocol.quantity import Quantity
from slipbench.protocol.recording.message_rules import Degraded
from tests.bench.conditions import trial_file
from tests.paths import TRIALS
from tests.protocol.binding.test_binding import DBC, changed, read

KMH = 1 / 3.6
MODES: dict[str, tuple[Any, tuple[str, ...], dict[str, float]]] = {
    "speed": ("front_wheel", ("optical_speed",), {"slip": SPEED_SHARE}),
    "echo": (
        "5 ms",
        ("throttle_command",),
        {"throttle_deviation": BLIND_SHARE, "throttle_rate": BLIND_SHARE},
    ),
    "hand_back": ("20 ms", ("authority", "authority_request"), {"throttle_deviation": BLIND_SHARE}),
    "throttle_body": ("follows_ecu", ("throttle_authority",), {}),
    "unmonitored": (["gear"], ("gear",), {"distance": 0.5}),
}
LIMITS = ("slip", "front_slip", "throttle_deviation", "throttle_rate", "distance")


def binding(folder: Path, *names: str, **changes: Any) -> Binding:
    """The superbike's with degraded modes."""
    removed = [f"roles.{role}" for name in names for role in MODES[name][1]]
    entries = {f"degraded__{name}": MODES[name][0] for name in names}
    return read(folder, changed(*removed, **entries, **changes))


def limits(bound: Binding, **changes: Any) -> dict[str, float]:
    trial = degraded_trial(trial_file(**changes), bound, bound.codec())
    return {name: float(getattr(trial.limits, name)) for name in LIMITS}


def of_wheels(given: dict[str, float]) -> dict[str, float]:
    """Limits that sampled wheel speeds tighten: by their share and the error of their quanta."""
    error = 2 * 0.01 * KMH / float(trial_file().limits.speed[0])
    slip = given["slip"] * SLIP_SHARE - error
    return given | {"slip": slip, "front_slip": given["front_slip"] * SLIP_SHARE}


@pytest.mark.parametrize("number", range(4))
def test_each_mode_tightens_by_its_share_and_none_loosens(number, tmp_path):
    before = {name: float(getattr(trial_file().limits, name)) for name in LIMITS}
    for names in list(combinations(MODES, number))[:6]:
        expected = dict(before)
        for name in names:
            for limit, share in MODES[name][2].items():
                expected[limit] *= share
        found = limits(binding(tmp_path, *names))
        assert found == pytest.approx(of_wheels(expected))
        assert all(found[name] <= before[name] for name in LIMITS)


def test_a_bus_that_lacks_nothing_changes_nothing(tmp_path):
    trial = trial_file()
    bound = binding(tmp_path)
    whole = Binding(bound.database, bound.placement)
    assert degraded_trial(trial, whole, whole.codec()) is trial
    assert list(modes(whole, whole.codec(), trial)) == []


def test_a_limit_keeps_the_unit_in_which_it_was_written(tmp_path):
    bound = binding(tmp_path)
    slip = degraded_trial(trial_file(), bound, bound.codec()).limits.slip
    assert isinstance(slip, Quantity)
    assert "%" in str(slip)
    before = trial_file().limits.slip
    assert slip.unit == before.unit
    assert slip.like(0.5) == before.like(0.5)


def test_each_mode_is_a_sentence(tmp_path):
    bound = binding(tmp_path, *MODES)
    texts = [mode.text for mode in modes(bound, bound.codec(), trial_file())]
    assert len(texts) == 6
    for words in (
        "wheel speeds",
        "front wheel",
        "after 5 ms",
        "throttle back 20 ms after the",
        "throttle body",
        "gear",
    ):
        assert any(words in text for text in texts), words
    least = float(trial_file().limits.speed[0])
    error = 2 * 0.01 * KMH / least
    assert f"up to 5 ms old, quantum 0.00556 m/s (slip error {error:.2%})" in texts[0]


def test_a_gnss_speed_tightens_the_slip_limit(tmp_path):
    bound = binding(tmp_path)
    degraded = Degraded(speed="gnss")
    gnss = Binding(bound.database, bound.placement, degraded=degraded)
    (mode,) = modes(gnss, gnss.codec(), trial_file())
    assert "slip against the GNSS speed" in mode.text
    before = trial_file().limits
    after = degraded_trial(trial_file(), gnss, gnss.codec()).limits
    assert float(after.slip) == pytest.approx(SPEED_SHARE * float(before.slip))
    assert after.front_slip == before.front_slip


@pytest.mark.parametrize("scale", ["0.01", "1"])
def test_wheel_speeds_that_are_too_coarse_are_refused(scale, tmp_path):
    dbc = DBC
    for name, start in (("V_Fr", 7), ("V_Rr", 23)):
        dbc = dbc.replace(f"{name} : {start}|16@0+ (0.01,0)", f"{name} : {start}|16@0+ ({scale},0)")
    bound = read(tmp_path, changed(), dbc)
    if scale == "0.01":
        limits(bound, limits__slip="2 %")
        return
    limits(bound, limits__slip="8 %")
    with pytest.raises(InputError, match="too coarse for the slip limit") as refused:
        limits(bound, limits__slip="2 %")
    text = str(refused.value)
    assert "limits.slip = 2 %" in text
    assert "raise limits.slip" in text


def test_a_hand_back_that_is_later_than_the_trial_allows_is_refused(tmp_path):
    bound = binding(tmp_path, "hand_back")
    limits(bound)
    with pytest.raises(InputError, match="gives the throttle back later") as refused:
        limits(bound, command__silence="10 ms")
    text = str(refused.value)
    for words in ("degraded.hand_back", "10 ms", "20 ms", "command.silence", "mine.toml"):
        assert words in text


@pytest.mark.parametrize(
    ("rule", "stale", "refused"),
    [
        ({}, "20 ms", False),
        ({}, "10 ms", True),
        ({"timeout": "9 ms"}, "20 ms", True),
        ({"timeout": "10 ms"}, "20 ms", True),
        ({"timeout": "12 ms"}, "20 ms", False),
        ({"timeout": "12 ms"}, "10 ms", True),
        ({"cycle_time": "30 ms"}, "20 ms", True),
        ({"cycle_time": "5 ms", "timeout": "6 ms"}, "20 ms", False),
    ],
)
def test_a_message_must_come_more_often_than_its_timeout(rule, stale, refused, tmp_path):
    """SWB_State comes every 10 ms."""
    bound = read(tmp_path, changed(messages__SWB_State=rule))
    try:
        limits(bound, limits__stale=stale)
    except InputError as fault:
        found = str(fault)
        assert refused, found
        assert "comes less often than its timeout allows" in found
        assert "ms" in found
    else:
        assert not refused


def test_a_message_that_comes_by_event_has_no_cycle_time_to_keep(tmp_path):
    bound = read(tmp_path, changed(messages__SWB_State={"cycle_time": "30 ms"}))
    with pytest.raises(InputError, match="SWB_State comes less often than its timeout allows"):
        limits(bound)
    messages = tuple(
        replace(each, attributes={"GenMsgSendType": 1}) if each.name == "SWB_State" else each
        for each in bound.database.messages
    )
    limits(replace(bound, database=replace(bound.database, messages=messages)))


def test_a_wheel_speed_without_a_cycle_time_is_refused(tmp_path):
    """Neither its age nor a second sender could be known."""
    read(tmp_path, changed(), DBC.replace('BA_ "GenMsgCycleTime" BO_ 208 5;\n', ""))
    with pytest.raises(InputError, match="ABS_Wheels has no cycle time"):
        prepare(TRIALS / "throttle_sweep.toml", None, tmp_path / "mine.toml")


@pytest.mark.parametrize(
    ("role", "values", "says"),
    [
        ("authority_request", {"0": "none", "1": "spark"}, "cannot show the authority throttle"),
        ("authority", {"0": "none", "1": "spark"}, "cannot show the authority throttle"),
        ("authority", {"1": "throttle", "2": "both"}, "cannot show the authority none"),
    ],
)
def test_an_authority_that_cannot_be_shown_is_refused(role, values, says, tmp_path):
    read(tmp_path, changed(**{f"roles__{role}__values": values}))
    with pytest.raises(InputError, match=says) as refused:
        prepare(TRIALS / "throttle_sweep.toml", None, tmp_path / "mine.toml")
    assert "values" in str(refused.value)
    assert str(refused.value).startswith(str(TRIALS / "throttle_sweep.toml"))


@pytest.mark.parametrize(
    ("trial", "spark"),
    [
        ("throttle_sweep", False),
        ("spark_sweep", True),
        ("slip_steps_throttle", False),
        ("slip_steps_spark", True),
        ("slip_steps_mixed", True),
    ],
)
def test_a_bus_without_a_request_for_the_spark_carries_no_trial_that_moves_it(
    trial, spark, tmp_path
):
    """Whether the waveform moves it or the controller."""
    read(tmp_path, changed("roles.spark_request", "roles.spark_command"), trial=False)
    try:
        prepare(TRIALS / f"{trial}.toml", None, tmp_path / "mine.toml")
    except InputError as fault:
        found = str(fault)
    else:
        found = ""
    assert ("spark_request: without it" in found) is spark, found


def test_the_database_is_that_of_the_binding_or_the_one_that_is_given_instead(tmp_path):
    read(tmp_path, changed())
    other = tmp_path / "other.dbc"
    other.write_text(DBC, encoding="utf-8")
    for given, found in ((None, tmp_path / "superbike.dbc"), (other, other)):
        prepared = prepare(TRIALS / "throttle_sweep.toml", given, tmp_path / "mine.toml")
        assert prepared.database_path == found
        assert prepared.database.origin == str(found)


def test_degraded_modes_reach_the_prepared_trial_and_its_plan(tmp_path):
    binding(tmp_path, "speed", "hand_back")
    prepared = prepare(TRIALS / "throttle_sweep.toml", None, tmp_path / "mine.toml")
    assert len(prepared.degraded) == 3
    written = load_toml(TRIALS / "throttle_sweep.toml")["limits"]["throttle_deviation"]
    assert str(written).startswith("6")
    assert float(prepared.plan.trial.limits.throttle_deviation) == pytest.approx(0.03)
