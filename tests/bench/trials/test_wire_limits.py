"""A trial whose values the database cannot carry is rejected, by key and with the range."""

import shutil
from dataclasses import replace
from operator import attrgetter

import pytest

from slipbench import dbc
from slipbench.bench.trials.excitation import plan_excitation
from slipbench.bench.trials.preparation import prepare
from slipbench.bench.trials.wire_limits import CARRIED, check_authority, check_wire
from slipbench.protocol.codec.codec import Codec
from slipbench.protocol.codec.messages import Authority
from slipbench.protocol.codec.placement import OWN, SignalAt
from slipbench.protocol.database.database import load_database
from slipbench.protocol.errors import InputError
from slipbench.protocol.units import linear
from tests.bench.conditions import trial_file
from tests.paths import DEMONSTRATION, TRIALS

DATABASE = load_database(dbc.MOTORBIKE)


def check(**changes):
    trial = trial_file(**changes)
    check_wire(trial, plan_excitation(trial), Codec(DATABASE), "trial.toml")


def narrowed(key: str, share: float):
    """The database whose signal for `key` ends at `share` of the trial's highest value there."""
    name, signal_name = CARRIED[key]
    message = DATABASE.message(name)
    signal = message.signal(signal_name)
    stated = attrgetter(key)(trial_file())
    value = stated[-1] if isinstance(stated, tuple) else stated
    slope, offset = (1.0, 0.0) if key.endswith("gear") else linear(signal.unit, value.si)
    top = share * (value - offset) / slope
    narrow = replace(signal, maximum=top)
    signals = tuple(narrow if each is signal else each for each in message.signals)
    messages = (
        replace(each, signals=signals) if each is message else each for each in DATABASE.messages
    )
    return replace(DATABASE, messages=tuple(messages))


def with_command(name: str, **changes) -> Codec:
    """Codec of the database, one signal of the command changed."""
    message = DATABASE.message("ActuatorCommand")
    signals = tuple(replace(s, **changes) if s.name == name else s for s in message.signals)
    new = replace(message, signals=signals)
    messages = tuple(new if each is message else each for each in DATABASE.messages)
    return Codec(replace(DATABASE, messages=messages))


@pytest.mark.parametrize(
    ("changes", "released"),
    [
        ({"offset": -50.0, "minimum": -10.0}, True),  # 0 is the raw value 5000
        ({"minimum": 0.0, "maximum": 0.0}, True),
        ({"minimum": 0.02}, False),
        ({"offset": -50.0, "minimum": None, "maximum": -0.01}, False),
        ({"offset": 1.0, "minimum": None}, False),
    ],
)
def test_a_command_must_be_able_to_carry_the_release(changes, released):
    """Whatever else of the trial the changed signal cannot carry."""
    trial = trial_file()
    try:
        check_wire(trial, plan_excitation(trial), with_command("throttle", **changes), "trial.toml")
        told = ""
    except InputError as fault:
        told = str(fault)
    assert ("ActuatorCommand.throttle cannot carry 0, which releases" in told) != released
    assert "ActuatorCommand.spark cannot" not in told


@pytest.mark.parametrize(
    ("bounds", "fits"),
    [((-1e-9, 1.0 + 1e-9), True), ((-1.5e-9, 1.0), False), ((0.0, 1.0 + 1.5e-9), False)],
)
def test_a_command_may_be_beyond_its_range_by_what_rounding_adds(bounds, fits):
    trial = trial_file()
    limits = trial.limits.model_copy(update={"throttle": bounds})
    arguments = (
        trial.model_copy(update={"limits": limits}),
        plan_excitation(trial),
        Codec(DATABASE),
        "trial.toml",
    )
    if fits:
        check_wire(*arguments)
    else:
        with pytest.raises(InputError, match=r"limits\.throttle = .* is not in 0 \.\. 1 "):
            check_wire(*arguments)


@pytest.mark.parametrize(("share", "fits"), [(1.5e-9, True), (0.5e-9, False)])
def test_a_limit_must_be_below_the_end_of_its_range_by_what_rounding_adds(share, fits):
    trial = trial_file()
    highest = 150.0 - share * 160.0  # m/s; the signal carries -10 to 150
    limits = trial.limits.model_copy(update={"speed": (30.0, highest)})
    trial = trial.model_copy(update={"limits": limits})
    if fits:
        check_wire(trial, plan_excitation(trial), Codec(DATABASE), "trial.toml")
    else:
        with pytest.raises(InputError, match=r"limits\.speed = .* is not within"):
            check_wire(trial, plan_excitation(trial), Codec(DATABASE), "trial.toml")


@pytest.mark.parametrize("key", CARRIED)
def test_a_value_that_the_wire_cannot_carry_is_refused_by_name_and_range(key):
    trial = trial_file()
    excitation = plan_excitation(trial)
    check_wire(trial, excitation, Codec(narrowed(key, 1.5)), "trial.toml")
    with pytest.raises(InputError, match=rf"{key} = .* is not (with)?in .*\.") as refused:
        check_wire(trial, excitation, Codec(narrowed(key, 0.7)), "trial.toml")
    assert CARRIED[key][1] in str(refused.value)
    assert DATABASE.origin in str(refused.value)
    stated = attrgetter(key)(trial)
    assert str(stated[-1] if isinstance(stated, tuple) else stated) in str(refused.value)


@pytest.mark.parametrize(
    ("key", "words"),
    [
        ("limits.throttle", "0.5 % .. 30 % is not in 0 % .. 21 % (ActuatorCommand.throttle)"),
        (
            "limits.engine_speed",
            "11000 rpm .. 15500 rpm is not within 0 rpm .. 10850 rpm (EngineStatus.engine_speed)",
        ),
        ("limits.clutch", "10 % is not within 0 % .. 7 % (RiderControls.clutch)"),
    ],
)
def test_a_range_is_named_in_the_unit_of_the_trial(key, words):
    trial = trial_file()
    with pytest.raises(InputError) as refused:
        check_wire(trial, plan_excitation(trial), Codec(narrowed(key, 0.7)), "trial.toml")
    assert f"{key} = {words}" in str(refused.value)


@pytest.mark.parametrize("key", [key for key in CARRIED if key != "operating_point.engine_speed"])
def test_a_command_may_be_at_the_end_of_its_range_and_a_limit_may_not(key):
    """A measured value is never beyond the end of its range: a limit there could never trip."""
    trial = trial_file()
    ends = narrowed(key, 1.0)
    if key.startswith("operating_point") or CARRIED[key][0] == "ActuatorCommand":
        check_wire(trial, plan_excitation(trial), Codec(ends), "trial.toml")
    else:
        with pytest.raises(InputError, match=f"{key} = "):
            check_wire(trial, plan_excitation(trial), Codec(ends), "trial.toml")


@pytest.mark.parametrize(
    ("actuator", "amplitude"), [("throttle", "0.009 %"), ("spark", "0.01 deg")]
)
def test_an_excitation_that_the_command_rounds_to_nothing_is_refused(actuator, amplitude):
    words = f"less than one step of ActuatorCommand.{actuator}"
    with pytest.raises(InputError, match=words) as refused:
        check(excitation__actuator=actuator, excitation__amplitude=amplitude)
    step = {"throttle": "0.01 %", "spark": "0.02 deg"}[actuator]
    assert f"excitation.amplitude = {amplitude} is {words} ({step})" in str(refused.value)
    assert str(refused.value).startswith("trial.toml")


def test_a_trial_is_refused_before_anything_is_opened(tmp_path):
    text = (TRIALS / "throttle_sweep.toml").read_text()
    text = text.replace('["-12 deg", "4 deg"]', '["-60 deg", "4 deg"]')
    text = text.replace("../../plant/vehicles/", "")
    shutil.copy(DEMONSTRATION, tmp_path)
    (tmp_path / "trial.toml").write_text(text)
    with pytest.raises(InputError, match=r"limits\.spark") as refused:
        prepare(tmp_path / "trial.toml", dbc.MOTORBIKE)
    assert "trial.toml" in str(refused.value)


@pytest.mark.parametrize("path", sorted(TRIALS.glob("*.toml")), ids=lambda path: path.stem)
def test_our_own_trials_are_carried(path):
    prepare(path, dbc.MOTORBIKE)


@pytest.mark.parametrize(
    ("attribute", "words"),
    [
        ("GenMsgCycleTime", "message EcuStatus has no cycle time"),
        ("E2EProfile", "has crc and counter, but no end-to-end protection"),
    ],
)
def test_a_database_that_would_weaken_the_protection_is_refused_before_the_start(
    tmp_path, attribute, words
):
    """Without a cycle time no second sender is found, without a profile no CRC is checked."""
    lines = dbc.MOTORBIKE.read_text(encoding="utf-8").splitlines()
    kept = [line for line in lines if attribute not in line]
    (tmp_path / "other.dbc").write_text("\n".join(kept) + "\n", encoding="utf-8")
    with pytest.raises(InputError, match=words):
        prepare(TRIALS / "throttle_sweep.toml", tmp_path / "other.dbc")


def test_a_database_without_signal_wraps_is_understood(tmp_path):
    lines = dbc.MOTORBIKE.read_text(encoding="utf-8").splitlines()
    kept = [line for line in lines if "SignalWraps" not in line]
    (tmp_path / "other.dbc").write_text("\n".join(kept) + "\n", encoding="utf-8")
    prepare(TRIALS / "throttle_sweep.toml", tmp_path / "other.dbc")


def placed(database=DATABASE, without: tuple[str, ...] = (), **constants: float) -> Codec:
    """Codec without some messages, in which fields of the command are constant."""
    command = {**OWN["ActuatorCommand"], **constants}
    placement = {name: at for name, at in OWN.items() if name not in without}
    return Codec(database, {**placement, "ActuatorCommand": command})


def refusal(trial, codec: Codec) -> str:
    try:
        check_wire(trial, plan_excitation(trial), codec, "trial.toml")
    except InputError as fault:
        return str(fault)
    return ""


def test_a_spark_that_cannot_carry_0_is_refused_also_where_no_signal_holds_the_throttle():
    codec = with_command("spark", minimum=0.02, maximum=40.0)
    wanted = "ActuatorCommand.spark cannot carry 0, which releases"
    assert wanted in refusal(trial_file(), codec)
    message = DATABASE.message("ActuatorCommand")
    signals = tuple(
        replace(s, minimum=0.02, maximum=40.0) if s.name == "spark" else s for s in message.signals
    )
    messages = tuple(
        replace(message, signals=signals) if each is message else each for each in DATABASE.messages
    )
    database = replace(DATABASE, messages=messages)
    assert wanted in refusal(trial_file(), placed(database, throttle=0.0))


def test_what_no_signal_holds_is_not_checked_and_the_rest_is():
    trial = trial_file()
    assert refusal(trial, placed(without=("OpticalSpeed",))) == ""
    assert refusal(trial, placed(throttle=0.0)) == ""
    codec = placed(narrowed("limits.clutch", 0.7), throttle=0.0)
    assert "limits.clutch = " in refusal(trial, codec)


def test_a_floating_point_command_has_no_smallest_step():
    limits = {"minimum": None, "maximum": None}
    fine = trial_file(excitation__amplitude="0.001 %")
    assert "less than one step" in refusal(fine, Codec(DATABASE))
    wide = replace(DATABASE.message("ActuatorCommand").signal("throttle"), start=64, length=32)
    wide = replace(wide, is_float=True, **limits)
    message = DATABASE.message("ActuatorCommand")
    signals = tuple(wide if s.name == "throttle" else s for s in message.signals)
    longer = replace(message, signals=signals, length=12, fd=True)
    messages = tuple(longer if each is message else each for each in DATABASE.messages)
    assert refusal(fine, Codec(replace(DATABASE, messages=messages))) == ""


def test_an_authority_that_no_signal_holds_is_not_checked():
    check_authority(Authority.BOTH, placed(authority=Authority.THROTTLE), "trial.toml")
    check_authority(Authority.BOTH, placed(without=("EcuStatus",)), "trial.toml")


def test_the_status_must_show_the_authority_also_where_no_signal_requests_it():
    shown = SignalAt("EcuStatus", "authority", values={0: 0, 1: 1})
    placement = {
        **OWN,
        "ActuatorCommand": {**OWN["ActuatorCommand"], "authority": Authority.THROTTLE},
        "EcuStatus": {**OWN["EcuStatus"], "authority": shown},
    }
    codec = Codec(DATABASE, placement)
    check_authority(Authority.THROTTLE, codec, "trial.toml")
    with pytest.raises(InputError, match=r"EcuStatus\.authority cannot show the authority both"):
        check_authority(Authority.BOTH, codec, "trial.toml")
