"""Laws of a binding: what it places, what it refuses, and with which words."""

import re
import tomllib
from copy import deepcopy
from pathlib import Path
from typing import Any

import cantools.database
import pytest
import tomli_w

from slipbench.dbc import MOTORBIKE_ROLES
from slipbench.protocol.binding.binding import Binding, read_binding
from slipbench.protocol.codec.codec import Codec
from slipbench.protocol.codec.placement import OWN, SignalAt
from slipbench.protocol.database.database import load_database
from slipbench.protocol.errors import InputError
from tests.paths import TRIALS
from tests.protocol.binding.foreign import foreign
from tests.protocol.database.arxml import arxml_of
from tests.protocol.database.test_formats import described

FOLDER = TRIALS.parent / "bindings"
SUPERBIKE: dict[str, Any] = tomllib.loads((FOLDER / "superbike.toml").read_text(encoding="utf-8"))
DBC = (FOLDER / "superbike.dbc").read_text(encoding="utf-8")


def changed(*removed: str, **changes: Any) -> dict[str, Any]:
    """The superbike's binding; `roles__gear__unit="rpm"` changes one key, "roles.gear" removes one."""
    data = deepcopy(SUPERBIKE)
    for path in removed:
        *tables, key = path.split(".")
        at(data, tables).pop(key)
    for path, value in changes.items():
        *tables, key = path.split("__")
        at(data, tables)[key] = value
    return data


def at(data: dict[str, Any], tables: list[str]) -> dict[str, Any]:
    for name in tables:
        data = data.setdefault(name, {})
    return data


def read(folder: Path, data: dict[str, Any], dbc: str = DBC, *, trial: bool = True) -> Binding:
    """Binding of this content, its codec made and the roles of a spark trial required."""
    (folder / "superbike.dbc").write_text(dbc, encoding="utf-8")
    path = folder / "mine.toml"
    path.write_text(tomli_w.dumps(data), encoding="utf-8")
    binding = read_binding(path)
    binding.codec()
    if trial:
        binding.require_trial(spark=True)
    return binding


def refused(folder: Path, data: dict[str, Any], dbc: str = DBC) -> str:
    with pytest.raises(InputError) as error:
        read(folder, data, dbc)
    text = str(error.value)
    assert "Traceback" not in text
    assert len(text) < 1500
    assert not re.search(r"0x[0-9a-f]{6,}|<\w+ |None\b|SignalAt", text), text
    return text


def test_the_shipped_binding_is_whole(tmp_path):
    binding = read(tmp_path, changed())
    assert binding.can_request
    assert {name for name, at in binding.placement.items() if at} == {
        "ActuatorCommand",
        "EcuStatus",
        "ThrottleStatus",
        "EngineStatus",
        "RiderControls",
        "OpticalSpeed",
        "RearWheelSpeed",
        "FrontWheelSpeed",
    }


CASES: dict[str, tuple[dict[str, Any], tuple[str, ...]]] = {
    "a message that is not there": (
        changed(roles__gear__signals=["ECM_Engin.GearPos"]),
        ("no message 'ECM_Engin'", "'ECM_Engine'", "did you mean"),
    ),
    "a signal that is not there": (
        changed(roles__gear__signals=["ECM_Engine.GearPs"]),
        ("'ECM_Engine.GearPs'", "ECM_Engine.GearPos", "did you mean"),
    ),
    "rules of a message that is not there": (
        changed(messages__ECM_Engin={"timeout": "10 ms"}),
        ("messages.ECM_Engin", "did you mean 'ECM_Engine'"),
    ),
    "a name without its message": (
        changed(roles__gear__signals=["GearPos"]),
        ("GearPos", "superbike.dbc"),
    ),
    "a role that is not there": (
        changed(roles__gearr={"signals": ["ECM_Engine.GearPos"]}),
        ("unknown role 'gearr'", "'gear'"),
    ),
    "one signal for two roles": (
        changed(roles__rider_grip__signals=["ECM_Engine.Tps"]),
        ("ECM_Engine.Tps", "two roles", "rider_grip", "throttle_position"),
    ),
    "a unit that does not convert": (
        changed(roles__engine_speed__unit="km/h"),
        ("ECM_Engine.Nmot", "km/h", "rad/s", "unit ="),
    ),
    "a unit that is unknown": (
        changed(roles__engine_speed__unit="furlongs"),
        ("ECM_Engine.Nmot", "furlongs"),
    ),
    "a request in a received message": (
        changed(
            "messages.LOG_Demand", roles__throttle_request__signals=["ECM_Intervention.Thr_Set"]
        ),
        ("ECM_Intervention",),
    ),
    "scale zero": (changed(roles__engine_speed__scale=0.0), ("roles.engine_speed.scale", "0")),
    "a sign that is none": (changed(roles__gear__sign=2), ("roles.gear.sign",)),
    "a counter that is not there": (
        changed(messages__ECM_Engine__protection__counter="Nobody"),
        ("messages.ECM_Engine", "'Nobody'", "Eng_Cnt"),
    ),
    "a checksum that is not there": (
        changed(messages__ECM_Engine__protection__checksum__signal="Nobody"),
        ("messages.ECM_Engine", "'Nobody'", "Eng_Sum"),
    ),
    "a checksum of 16 bits": (
        changed(messages__ECM_Engine__protection__checksum__signal="Nmot"),
        ("ECM_Engine.Nmot cannot be a checksum", "one whole byte", "16 bits"),
    ),
    "a counter that counts too far": (
        changed(messages__ECM_Engine__protection__period=17),
        ("ECM_Engine.Eng_Cnt cannot count 17", "16"),
    ),
    "a profile on a message that is too short": (
        changed(messages__SWB_State__protection={"profile": "E2E5", "data_id": 1}),
        ("SWB_State", "2 bytes"),
    ),
    "a profile where a role lies": (
        changed(messages__ABS_Wheels__protection={"profile": "E2E1", "data_id": 1}),
        ("ABS_Wheels.V_Fr", "protection"),
    ),
    "profile 2 without its 16 ids": (
        changed(messages__ABS_Brake__protection={"profile": "E2E2", "data_ids": [1, 2]}),
        ("messages.ABS_Brake.protection", "16 numbers"),
    ),
    "profile 1 without its id": (
        changed(messages__ABS_Brake__protection={"profile": "E2E1"}),
        ("messages.ABS_Brake.protection", "needs data_id"),
    ),
    "a plain protection of nothing": (
        changed(messages__ABS_Brake__protection={"profile": "plain"}),
        ("messages.ABS_Brake.protection", "counter, checksum, or both"),
    ),
    "a role at the counter": (
        changed(roles__gear__signals=["ECM_Engine.Eng_Cnt"]),
        ("ECM_Engine.Eng_Cnt is bound to a role", "protection"),
    ),
    "values for a quantity": (
        changed(roles__engine_speed__values={"0": 1}),
        ("roles.engine_speed", "values", "unit, scale or offset"),
    ),
    "a value without a meaning": (
        changed(roles__throttle_authority__values={"0": "none", "1": "gas"}),
        ("'gas'", "roles.throttle_authority.values", "throttle"),
    ),
    "a value that the signal cannot hold": (
        changed(roles__throttle_authority__values={"0": "none", "2": "throttle"}),
        ("ECM_Intervention.Etb_Mode", "raw value 2"),
    ),
    "no values where they are needed": (
        changed("roles.throttle_authority.values"),
        ("ECM_Intervention.Etb_Mode", "0 to 3", "values"),
    ),
    "requests that cannot be withdrawn": (
        changed(roles__authority_request__values={"1": "throttle", "2": "both"}),
        ("LOG_Demand.Dmd_Mode cannot show none",),
    ),
    "phases that a dashboard could not show": (
        changed(
            roles__trial_phase={
                "signals": ["LOG_Demand.Dmd_Mode"],
                "values": {"0": "idle", "1": "armed"},
            }
        ),
        ("LOG_Demand.Dmd_Mode",),
    ),
    "an inverted button": (
        changed(roles__rider_button__sign=-1, roles__rider_button__offset=1.0),
        ("SWB_State.Launch_Btn", "values"),
    ),
    "two signals for one role": (
        changed(roles__rear_wheel_speed__signals=["ABS_Wheels.V_Rr", "ABS_Wheels.V_Fr"]),
        ("roles.rear_wheel_speed", "one signal"),
    ),
    "a role of two messages": (
        changed(roles__gear__signals=["ECM_Engine.GearPos", "ABS_Wheels.V_Fr"]),
        ("role gear", "one message"),
    ),
    "a flag of another message": (
        changed(roles__clutch__valid="VBOX_Velocity.Vel_Ok"),
        ("VBOX_Velocity.Vel_Ok", "SWB_State"),
    ),
    "no database": (changed("database"), ("names no database", "database =", "--dbc")),
    "a timeout that is too long": (
        changed(messages__ECM_Engine__timeout="1 s"),
        ("messages.ECM_Engine.timeout", "0.05 s"),
    ),
    "a latency of the echo that is too long": (
        changed("roles.throttle_command", degraded__echo="1 s"),
        ("degraded.echo", "0.1 s"),
    ),
    "an entry of [degraded] that is none": (changed(degraded__ecco="5 ms"), ("ecco", "echo")),
}


@pytest.mark.parametrize("case", CASES)
def test_bad_input_is_refused_in_one_sentence(case, tmp_path):
    data, says = CASES[case]
    text = refused(tmp_path, data)
    for word in says:
        assert word in text, text
    assert len(text.splitlines()) <= 4, text


def test_requests_in_a_message_that_is_received_have_two_senders(tmp_path):
    """As the file says it, and as the carrier: whichever role comes first."""
    dbc = DBC.replace(
        ' SG_ Iv_Cnt : 43|4@0+ (1,0) [0|15] "" LOGGER',
        ' SG_ Iv_Cnt : 43|4@0+ (1,0) [0|15] "" LOGGER\n'
        ' SG_ Free : 47|4@0+ (10,0) [0|100] "%" LOGGER',
    )
    text = refused(
        tmp_path, changed(roles__throttle_request__signals=["ECM_Intervention.Free"]), dbc
    )
    assert "ECM_Intervention is bound to roles that the bench sends and to roles" in text


# Role, and what the trial cannot do without it.
NEEDED = {
    "rider_button": "begin and end",
    "rider_grip": "closing grip",
    "engine_speed": "operating point",
    "gear": "change of gear",
    "clutch": "pulled clutch",
    "throttle_position": "throttle body",
    "throttle_request": "only listen",
    "spark_request": "spark advance",
    "authority_request": "request or release",
    "authority": "grants authority",
    "throttle_command": "what the ECU commands",
    "throttle_authority": "throttle body grants",
    "throttle_fault": "fault of the throttle body",
    "rear_wheel_speed": "slip is unknown",
    "front_wheel_speed": "slip is unknown",
    "optical_speed": "slip is unknown",
}


@pytest.mark.parametrize("role", NEEDED)
def test_a_missing_role_is_named_with_the_nearest_signals_and_what_is_lost(role, tmp_path):
    text = refused(tmp_path, changed(f"roles.{role}"))
    assert "lacks 1 role that" in text
    assert f"{role}: without it" in text
    assert NEEDED[role] in text
    signal = SUPERBIKE["roles"][role]["signals"][0]
    assert signal in text.partition("nearest: ")[2]  # the one that was bound before


def test_brakes_are_needed_one_of_them_or_a_switch(tmp_path):
    pressures = ("roles.front_brake_pressure", "roles.rear_brake_pressure")
    assert "brake: without it braking does not end the trial" in refused(
        tmp_path, changed(*pressures)
    )
    for one in pressures:
        read(tmp_path, changed(one))
    switch = {"signals": ["ABS_Brake.P_Fr"], "unit": ""}
    binding = read(tmp_path, changed(*pressures, roles__brake=switch))
    brake = binding.placement["RiderControls"]["front_brake"]
    assert isinstance(brake, SignalAt)
    part = binding.codec().parts("RiderControls")
    (slot,) = [p.slot("front_brake") for p in part if "front_brake" in p.fields]
    assert slot.value(round(1 / 0.05)) == pytest.approx(1e7)


def test_all_that_is_missing_is_named_at_once(tmp_path):
    text = refused(tmp_path, changed("roles.gear", "roles.rider_grip", "roles.optical_speed"))
    assert "lacks 3 roles" in text
    for role in ("gear", "rider_grip", "optical_speed"):
        assert f"{role}: without it" in text


def test_a_trial_of_the_throttle_needs_no_spark(tmp_path):
    data = changed("roles.spark_request", "roles.spark_command")
    assert "spark_request" in refused(tmp_path, data)
    binding = read_binding(tmp_path / "mine.toml")
    binding.require_trial(spark=False)
    assert binding.placement["ActuatorCommand"]["spark"] == 0.0


# [degraded] entry, the roles whose absence it accepts.
ACCEPTS: dict[str, tuple[Any, tuple[str, ...]]] = {
    "hand_back": ("20 ms", ("authority", "authority_request")),
    "echo": ("5 ms", ("throttle_command",)),
    "throttle_body": ("follows_ecu", ("throttle_authority",)),
    "speed": ("front_wheel", ("optical_speed",)),
    "gear": (["gear"], ("gear",)),
    "clutch": (["clutch"], ("clutch",)),
    "throttle_fault": (["throttle_fault"], ("throttle_fault",)),
    "brake": (["brake"], ("front_brake_pressure", "rear_brake_pressure")),
}


def degraded(name: str) -> dict[str, Any]:
    value, _ = ACCEPTS[name]
    return {"unmonitored" if isinstance(value, list) else name: value}


@pytest.mark.parametrize("entry", ACCEPTS)
def test_an_entry_of_degraded_accepts_exactly_what_it_says(entry, tmp_path):
    accepted = ACCEPTS[entry][1]
    [(key, value)] = degraded(entry).items()
    removed = [f"roles.{role}" for role in accepted]
    without = refused(tmp_path, changed(*removed))
    assert f"{key} = " in without
    read(tmp_path, changed(*removed, **{f"degraded__{key}": value}))
    for other in NEEDED:
        if other in accepted:
            continue
        data = changed(*removed, f"roles.{other}", **{f"degraded__{key}": value})
        assert f"{other}: without it" in refused(tmp_path, data)


@pytest.mark.parametrize("entry", [name for name in ACCEPTS if name != "speed"])
def test_what_is_bound_is_not_replaced(entry, tmp_path):
    """The bench would assume what a signal says."""
    [(key, value)] = degraded(entry).items()
    text = refused(tmp_path, changed(**{f"degraded__{key}": value}))
    assert f"degraded.{key} states that no signal gives {ACCEPTS[entry][1][0]}" in text
    assert "remove" in text


GNSS = {"signals": ["VBOX_Velocity.Vel"], "valid": "VBOX_Velocity.Vel_Ok"}


def test_a_satellite_speed_counts_only_where_it_is_valid(tmp_path):
    data = changed("roles.optical_speed", roles__gnss_speed=GNSS)
    assert 'speed = "gnss"' in refused(tmp_path, data)
    data["degraded"]["speed"] = "gnss"
    placed = read(tmp_path, data).placement["OpticalSpeed"]
    assert placed["valid"] == SignalAt("VBOX_Velocity", "Vel_Ok")


def test_time_and_validity_are_those_of_the_speed_in_use(tmp_path):
    """An optical sensor is bound for the record, the trial uses the satellites."""
    dbc = DBC.replace(
        "BO_ 224 SWB",
        'BO_ 240 GNSS: 4 VBOX\n SG_ G : 7|16@0+ (0.01,0) [0|400] "km/h" LOGGER\n'
        ' SG_ G_T : 23|15@0+ (1,0) [0|0] "ms" LOGGER\n SG_ G_Ok : 24|1@0+ (1,0) [0|1] "" LOGGER\n\n'
        "BO_ 224 SWB",
    )
    gnss = {"signals": ["GNSS.G"], "valid": "GNSS.G_Ok", "clock": "g", "time_signal": "GNSS.G_T"}
    data = changed(roles__gnss_speed=gnss, degraded__speed="gnss")
    placed = read(tmp_path, data, dbc).placement["OpticalSpeed"]
    assert {at.message for at in placed.values()} == {"GNSS"}
    del data["degraded"]["speed"]
    placed = read(tmp_path, data, dbc).placement["OpticalSpeed"]
    assert {at.message for at in placed.values() if isinstance(at, SignalAt)} == {"VBOX_Velocity"}


def test_a_binding_without_requests_only_listens(tmp_path):
    requests = [
        f"roles.{role}" for role in ("authority_request", "throttle_request", "spark_request")
    ]
    assert "only listen" in refused(tmp_path, changed(*requests, "messages.LOG_Demand"))
    binding = read_binding(tmp_path / "mine.toml")
    assert not binding.can_request
    assert binding.carriers("ActuatorCommand") == set()
    binding.codec()


def test_the_bench_s_own_names_are_placed_as_they_are():
    binding = read_binding(MOTORBIKE_ROLES)
    codec, own = binding.codec(), Codec(binding.database, OWN)
    assert codec.plans.keys() == own.plans.keys()
    for name in OWN:
        assert codec.carriers(name) == own.carriers(name) == [name]
        for mine, theirs in zip(codec.parts(name), own.parts(name), strict=True):
            assert sorted(mine.fields) == sorted(theirs.fields)


# The test's own writer of ARXML writes neither pages nor limits, that of SYM no pages.
@pytest.mark.parametrize(
    ("form", "source"),
    [(form, "superbike") for form in ("kcd", "sym", "arxml")]
    + [("kcd", "drawn"), ("sym", "drawn")],
)
def test_a_bus_has_one_placement_in_every_format(form, source, tmp_path):
    data, text = changed(), DBC
    if source == "drawn":
        made = foreign(5)
        data, text = made.binding | {"database": "superbike.dbc"}, made.dbc
        if form != "kcd":
            data, text = without_teeth(data, text)
    for name in database(text, tmp_path).by_name:  # some formats do not carry cycle times
        cycle = database(text, tmp_path).message(name).cycle_time
        if cycle:
            at(data, ["messages", name])["cycle_time"] = f"{cycle * 1e3:g} ms"
    plain = read(tmp_path, data, text, trial=False)
    other = read(tmp_path, data, in_format(form, text), trial=False)
    assert other.placement == plain.placement
    for name, plan in plain.codec().plans.items():
        found = other.codec().plan_of(name)
        assert (found.guard, found.message.cycle_time) == (plan.guard, plan.message.cycle_time)
        for mine, theirs in zip(found.parts, plan.parts, strict=True):
            assert mine.fields == theirs.fields
            for field in mine.fields:
                assert layout_of(mine.slot(field)) == layout_of(theirs.slot(field))


def without_teeth(data: dict[str, Any], text: str) -> tuple[dict[str, Any], str]:
    names = {data["roles"].pop(f"{wheel}_teeth")["teeth"] for wheel in ("rear", "front")}
    blocks = [block for block in text.split("\n\n") if block.split(":")[0].split()[-1] not in names]
    kept = "\n\n".join(blocks)
    lines = [line for line in kept.splitlines() if not line.startswith("BA_ ")]
    rules = {name: rule for name, rule in data["messages"].items() if name not in names}
    return data | {"messages": rules}, "\n".join([*lines, ""])


def layout_of(slot):
    return slot.shift, slot.mask, slot.sign, slot.big, slot.scale, slot.offset, slot.values


def database(text: str, folder: Path):
    path = folder / "source.dbc"
    path.write_text(text, encoding="utf-8")
    return load_database(path)


def in_format(form: str, text: str) -> str:
    if form == "arxml":
        return arxml_of(described(text))
    parsed = cantools.database.load_string(text, "dbc")
    return parsed.as_kcd_string() if form == "kcd" else parsed.as_sym_string()
