"""Laws: what is proposed is right or said to be doubtful, in any language and unit; import takes it."""

import tomllib

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from slipbench.protocol.configuration import read_toml
from slipbench.protocol.errors import InputError
from slipbench.protocol.recording.import_log import Capture, import_capture
from slipbench.protocol.recording.role_map import RoleMap
from slipbench.protocol.recording.roles import ROLES
from slipbench.protocol.role_proposal.wizard import RoleRequest, write_role_map
from slipbench.protocol.units import linear
from tests.recordings import recording

TIME = np.arange(0.0, 60.0, 0.1)
SPEED = 30.0 + 20.0 * np.sin(TIME / 7.0) + 5.0 * np.sin(TIME)
GEAR = np.clip(np.floor(SPEED / 12.0) + 1.0, 1, 5)
# What the vehicle did, SI.
TRUTH = {
    "vehicle_speed": SPEED,
    "front_wheel_speed": SPEED * 1.01,
    "rear_wheel_speed": SPEED * 1.04,
    "engine_speed": SPEED * 36.0 / GEAR + 20.0,
    "gear": GEAR,
    "throttle_position": 0.5 + 0.45 * np.cos(TIME / 7.0),
    "front_brake_pressure": 1e6 * np.clip(-np.cos(TIME / 7.0), 0, 1),
    "coolant_temperature": 350.0 + TIME / 10.0,
    "lateral_acceleration": 8.0 * np.sin(TIME / 3.0),
    "longitudinal_acceleration": 4.0 * np.cos(TIME / 3.0),
    "yaw_rate": 0.4 * np.sin(TIME / 3.0),
    "lean_angle": 0.8 * np.sin(TIME / 3.0),
}
NAMES = {
    "english": {
        "vehicle_speed": "Vehicle Speed", "front_wheel_speed": "Wheel Speed Front",
        "rear_wheel_speed": "WheelSpeedRear", "engine_speed": "Engine RPM", "gear": "Gear",
        "throttle_position": "TPS", "front_brake_pressure": "BrakePressFront",
        "coolant_temperature": "ECT", "lateral_acceleration": "Acc Lat",
        "longitudinal_acceleration": "Acc Long", "yaw_rate": "Gyro Yaw", "lean_angle": "Lean",
    },
    "german": {
        "vehicle_speed": "Fahrzeuggeschwindigkeit", "front_wheel_speed": "v_Rad_vorn",
        "rear_wheel_speed": "v_Rad_hinten", "engine_speed": "Motordrehzahl", "gear": "Gang",
        "throttle_position": "Drosselklappe Stellung", "front_brake_pressure": "Bremsdruck vorn",
        "coolant_temperature": "Kühlmitteltemperatur", "lateral_acceleration": "Querbeschl",
        "longitudinal_acceleration": "Längsbeschl", "yaw_rate": "Gierrate",
        "lean_angle": "Schräglage",
    },
    "french": {
        "vehicle_speed": "Vitesse véhicule", "front_wheel_speed": "Vitesse roue avant",
        "rear_wheel_speed": "Vitesse roue arrière", "engine_speed": "Régime moteur",
        "gear": "Rapport", "throttle_position": "Position papillon",
        "front_brake_pressure": "Pression frein avant", "coolant_temperature": "Température eau",
    },
    "italian": {
        "vehicle_speed": "Velocità veicolo", "front_wheel_speed": "Velocità ruota anteriore",
        "rear_wheel_speed": "Velocità ruota posteriore", "engine_speed": "Giri motore",
        "gear": "Marcia", "throttle_position": "Posizione farfalla",
        "front_brake_pressure": "Pressione freno anteriore",
        "coolant_temperature": "Temperatura acqua",
    },
    "spanish": {
        "vehicle_speed": "Velocidad vehículo", "front_wheel_speed": "Velocidad rueda delantera",
        "rear_wheel_speed": "Velocidad rueda trasera", "engine_speed": "RPM motor",
        "gear": "Marcha", "throttle_position": "Posición mariposa",
        "front_brake_pressure": "Presión freno delantera", "coolant_temperature": "Temp agua",
    },
}  # fmt: skip
UNITS = {
    "m/s": ["km/h", "m/s", "mph", "kph"],
    "rad/s": ["rpm", "1/min"],
    "1": ["%"],
    "Pa": ["bar", "kPa", "psi"],
    "K": ["°C", "degF"],
    "m/s^2": ["m/s^2", "g"],
    "rad": ["deg", "rad", "°"],
}
TURNS = {"yaw_rate": ["deg/s", "rad/s", "°/s"]}


def unit_choices(role):
    return ["", "-"] if role == "gear" else TURNS.get(role) or UNITS[ROLES[role].unit]


def written(role, unit):
    slope, zero = linear(unit, ROLES[role].unit)
    return (TRUTH[role] - zero) / slope


def write_csv(path, columns):
    """columns: title -> values."""
    table = np.column_stack([TIME, *columns.values()])
    lines = [";".join(["Time [s]", *columns])]
    lines += [";".join(f"{value:.5f}" for value in row) for row in table]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def proposed(folder, log):
    out = folder / "roles.toml"
    report = write_role_map(RoleRequest(log, out))
    return read_toml(out, RoleMap), report, out


def check_right(role, unit_known, channel):
    """A bound role holds what the vehicle did."""
    assert channel.value == pytest.approx(TRUTH[role], abs=2e-4 * np.abs(TRUTH[role]).max())
    assert channel.time == pytest.approx(TIME), unit_known


@given(st.sampled_from(sorted(NAMES)), st.data())
@settings(max_examples=12, deadline=None)
def test_with_units_every_role_is_found_in_every_language(tmp_path_factory, language, data):
    folder = tmp_path_factory.mktemp("roles")
    names = NAMES[language]
    columns = {}
    for role in data.draw(st.permutations(sorted(names))):
        unit = data.draw(st.sampled_from(unit_choices(role)), label=role)
        columns[f"{names[role]} [{unit}]"] = written(role, unit)
    log = write_csv(folder / "log.csv", columns)
    roles, _, out = proposed(folder, log)
    assert {role: source.column for role, source in roles.roles.items()} == names
    recording_ = import_capture(Capture(log, out), folder / "run")
    for role in names:
        check_right(role, True, recording_.channels[role])


@given(
    st.sampled_from(["english", "german"]), st.sampled_from(["km/h", "m/s", "mph", ""]), st.data()
)
@settings(max_examples=20, deadline=None)
def test_without_units_a_role_is_right_or_unresolved(tmp_path_factory, language, stated, data):
    """No unit stands in the file, but that of the vehicle speed in some cases."""
    folder = tmp_path_factory.mktemp("roles")
    names = NAMES[language]
    columns = {}
    for role in sorted(names):
        unit = data.draw(st.sampled_from(unit_choices(role)), label=role)
        title = names[role]
        if role == "vehicle_speed" and stated:
            unit, title = stated, f"{title} [{stated}]"
        columns[title] = written(role, unit)
    log = write_csv(folder / "log.csv", columns)
    roles, report, out = proposed(folder, log)
    assert "engine_speed" in roles.roles
    recording_ = import_capture(Capture(log, out), folder / "run")
    for role in roles.roles:
        assert roles.roles[role].column == names[role]
        check_right(role, False, recording_.channels[role])
    for role in set(names) - set(roles.roles):
        assert names[role] in report
    if stated:
        assert {"vehicle_speed", "front_wheel_speed", "rear_wheel_speed"} <= set(roles.roles)


def test_what_is_unresolved_needs_only_its_number_signs_removed(tmp_path):
    log = write_csv(tmp_path / "log.csv", {"Coolant Temp": written("coolant_temperature", "degC")})
    _, report, out = proposed(tmp_path, log)
    text = out.read_text()
    assert "UNRESOLVED" in report
    assert "# [roles.coolant_temperature]" in text
    lines = [
        line.removeprefix("# ") if line.startswith(("# [roles.", "# column", "# unit")) else line
        for line in text.splitlines()
        if line != "[roles]"
    ]
    out.write_text("\n".join(lines))
    channel = import_capture(Capture(log, out), tmp_path / "run").channels["coolant_temperature"]
    check_right("coolant_temperature", False, channel)


def test_values_that_a_role_cannot_have_are_not_bound(tmp_path):
    log = write_csv(tmp_path / "log.csv", {"Vehicle Speed [m/s]": SPEED * 100})
    roles, report, _ = proposed(tmp_path, log)
    assert not roles.roles
    assert "is not plausible" in report


@pytest.mark.parametrize("unit", ["V", "%", "bar", "deg", "s"])
def test_a_stated_unit_is_never_replaced_by_another(tmp_path, unit):
    """Values between 5 and 55 would be plausible in km/h; the file says that they are no speed."""
    log = write_csv(tmp_path / "log.csv", {f"Vehicle Speed [{unit}]": SPEED})
    assert not proposed(tmp_path, log)[0].roles


def test_a_wheel_speed_in_rpm_needs_its_radius(tmp_path):
    speed = TRUTH["rear_wheel_speed"] / 0.31 / linear("rpm", "rad/s")[0]
    log = write_csv(tmp_path / "log.csv", {"Wheel Speed Rear [rpm]": speed})
    roles, report, out = proposed(tmp_path, log)
    assert not roles.roles
    assert "needs the rolling radius" in report
    keys = ("# [roles.", "# column", "# unit", "# radius")
    lines = [
        line.removeprefix("# ") if line.startswith(keys) else line
        for line in out.read_text().splitlines()
    ]
    text = "\n".join(line for line in lines if line != "[roles]").replace("0.3 m", "0.31 m")
    out.write_text(text)
    channel = import_capture(Capture(log, out), tmp_path / "run").channels["rear_wheel_speed"]
    check_right("rear_wheel_speed", True, channel)


@pytest.mark.parametrize("name", ["u", "y", "n", "z1", "yVal", "Channel 0", "a", "v"])
def test_a_name_that_says_nothing_gets_no_role(tmp_path, name):
    roles, report, _ = proposed(
        tmp_path, write_csv(tmp_path / "log.csv", {name: TRUTH["yaw_rate"]})
    )
    assert not roles.roles
    assert "UNRESOLVED" not in report
    assert f"without a role: {name}" in report


def test_two_columns_of_one_name_are_said_to_be_close(tmp_path):
    columns = {"Vehicle Speed [km/h]": SPEED, "Speed Vehicle [km/h]": SPEED * 1.1}
    _, report, out = proposed(tmp_path, write_csv(tmp_path / "log.csv", columns))
    assert "another column is close" in report
    assert "CHECK: another column is close" in " ".join(out.read_text().split("\n#   "))


def test_without_times_the_file_says_what_to_state(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text("Vehicle Speed [km/h],RPM\n" + "36,3000\n37,3100\n38,3200\n" * 20)
    roles, report, out = proposed(tmp_path, path)
    assert "sample_period" in out.read_text()
    assert "first: in" in report
    assert "then: slipbench import" in report
    with pytest.raises(InputError, match="sample_period"):
        import_capture(Capture(path, out), tmp_path / "run")
    assert set(roles.roles) == {"vehicle_speed", "engine_speed"}


def test_names_with_quotes_and_control_characters_stay_one_key(tmp_path):
    log = write_csv(tmp_path / "log.csv", {'Vehicle "Speed" \\ \x01 [km/h]': SPEED})
    _, _, out = proposed(tmp_path, log)
    tomllib.loads(out.read_text())


def test_the_next_command_is_the_import(tmp_path):
    log = write_csv(tmp_path / "my log.csv", {"Vehicle Speed [km/h]": SPEED})
    _, report, out = proposed(tmp_path, log)
    assert f"next: slipbench import '{log}' --roles {out} --out 'runs/my log'" in report


def test_an_existing_file_stays(tmp_path):
    log = write_csv(tmp_path / "log.csv", {"Vehicle Speed [km/h]": SPEED})
    proposed(tmp_path, log)
    with pytest.raises(InputError, match="nothing is overwritten"):
        proposed(tmp_path, log)


def test_a_real_logger(tmp_path):
    log = recording("subaru_wrx/accessport_sample.csv")
    roles, _, out = proposed(tmp_path, log)
    assert {role: source.column for role, source in roles.roles.items()} == {
        "engine_speed": "RPM",
        "gear": "Gear Position",
        "throttle_position": "Throttle Pos",
        "throttle_command": "Target Throttle",
        "vehicle_speed": "Vehicle Speed",
        "rider_grip": "Accel Position",
        "coolant_temperature": "Coolant Temp",
        "intake_temperature": "Intake Temp",
        "manifold_pressure": "Man Abs Press",
    }
    assert not import_capture(Capture(log, out), tmp_path / "run").missing
