"""Laws of the vehicle file: units are checked, slips of the pen are named, nothing is lost."""

import math
from dataclasses import replace
from pathlib import Path

import pytest

from slipbench.plant.channels import DEFAULT_CHANNELS
from slipbench.plant.effects.backlash import Backlash
from slipbench.plant.effects.library import LIBRARY
from slipbench.plant.effects.quantiser import Quantiser
from slipbench.plant.effects.rate_limit import RateLimit
from slipbench.plant.errors import VehicleFileError
from slipbench.plant.motorcycle import Motorcycle
from slipbench.plant.vehicle_file import Vehicle, load_vehicle
from slipbench.plant.vehicle_writer import save_vehicle
from slipbench.plant.vehicles import builtin_vehicle


def written(folder: Path, text: str) -> Path:
    path = folder / "mine.toml"
    path.write_text('name = "mine"\n' + text)
    return path


@pytest.mark.parametrize("name", ["nominal", "demonstration"])
def test_what_is_saved_reads_back_the_same(name, tmp_path):
    vehicle = load_vehicle(builtin_vehicle(name))
    save_vehicle(vehicle, tmp_path / "copy.toml")
    assert load_vehicle(tmp_path / "copy.toml") == vehicle


def test_every_effect_and_channel_survives_the_file(tmp_path):
    timing = replace(DEFAULT_CHANNELS["engine_speed"], latency=7e-3, clock="dash", noise=2.0)
    vehicle = Vehicle(
        name="all",
        motorcycle=Motorcycle(effects=tuple(e.absent() for e in LIBRARY)),
        plus_minus={"body.mass": 5.0, "gears.2": 0.1, "effects.backlash.slack": 1e-3},
        channels={**DEFAULT_CHANNELS, "engine_speed": timing},
        description="everything at once",
    )
    save_vehicle(vehicle, tmp_path / "all.toml")
    assert load_vehicle(tmp_path / "all.toml") == vehicle


def test_the_default_motorcycle_is_the_nominal_vehicle():
    nominal = load_vehicle(builtin_vehicle("nominal")).motorcycle
    for (name, told), (_, default) in zip(nominal.blocks(), Motorcycle().blocks(), strict=True):
        assert list(told.values()) == pytest.approx(list(default.values())), name
    assert nominal.gears == Motorcycle().gears


def test_the_demonstration_lies_within_what_is_believed_of_the_nominal():
    nominal = load_vehicle(builtin_vehicle("nominal"))
    demonstration = load_vehicle(builtin_vehicle("demonstration")).motorcycle
    for key, half_width in nominal.plus_minus.items():
        block, _, parameter = key.partition(".")
        if block != "gears":
            believed = getattr(getattr(nominal.motorcycle, block), parameter)
            actual = getattr(getattr(demonstration, block), parameter)
            assert abs(actual - believed) <= half_width, key


def test_units_become_si(tmp_path):
    path = written(
        tmp_path,
        """
        [throttle_servo]
        natural_frequency = { value = 10, unit = "turn/s" }
        [engine]
        peak_speed = { value = 12000, unit = "rpm", plus_minus = 60 }
        spark_gain = { value = 1.2, unit = "%/deg" }
        [body]
        mass = { value = 540, unit = "lb" }
        [[effects]]
        name = "backlash"
        slack = { value = 0.5, unit = "deg", plus_minus = 0.1 }
        [channels.spark_applied]
        quantum = { value = 0.5, unit = "deg" }
        """,
    )
    vehicle = load_vehicle(path)
    bike = vehicle.motorcycle
    assert bike.throttle_servo.natural_frequency == pytest.approx(20 * math.pi)
    assert bike.engine.peak_speed == pytest.approx(400 * math.pi)
    assert bike.engine.spark_gain == pytest.approx(0.012 * 180 / math.pi)
    assert bike.body.mass == pytest.approx(244.94, abs=0.01)
    assert bike.effects == (Backlash(slack=math.radians(0.5)),)
    assert vehicle.plus_minus["engine.peak_speed"] == pytest.approx(2 * math.pi)
    assert vehicle.plus_minus["effects.backlash.slack"] == pytest.approx(math.radians(0.1))
    assert vehicle.channels["spark_applied"].quantum == pytest.approx(math.radians(0.5))
    assert vehicle.channels["gear"] == DEFAULT_CHANNELS["gear"]


def test_an_effect_on_a_channel_has_the_channels_unit_and_may_come_once_a_channel(tmp_path):
    path = written(
        tmp_path,
        """
        [[effects]]
        name = "quantiser"
        channel = "spark_applied"
        quantum = { value = 0.5, unit = "deg", plus_minus = 0.1 }
        [[effects]]
        name = "quantiser"
        quantum = { value = 60, unit = "rpm" }
        [[effects]]
        name = "grip_wear"
        wear = { value = 2, unit = "%/km" }
        """,
    )
    vehicle = load_vehicle(path)
    spark, engine, worn = vehicle.motorcycle.effects
    assert spark == Quantiser("spark_applied", math.radians(0.5))
    assert engine.channel == "engine_speed"
    assert engine.quantum == pytest.approx(2 * math.pi)
    assert worn.wear == pytest.approx(2e-5)
    assert list(vehicle.plus_minus) == ["effects.quantiser.spark_applied.quantum"]
    save_vehicle(vehicle, tmp_path / "again.toml")
    assert load_vehicle(tmp_path / "again.toml") == vehicle


def test_an_infinite_limit_is_an_absent_one(tmp_path):
    text = '[[effects]]\nname = "rate_limit"\nlimit = { value = inf, unit = "%/s" }'
    assert load_vehicle(written(tmp_path, text)).motorcycle.effects == (RateLimit.absent(),)


SLIPS = {
    "[drivline]": r"mine\.toml: drivline: unknown key.*did you mean 'driveline'\?",
    "[body]\nmas = { value = 1, unit = 'kg' }": r"mine\.toml: body\.mas: .*did you mean 'mass'\?",
    "[body]\nmass = { value = 245, unit = 'kg', plusminus = 5 }": r"mass\.plusminus.*plus_minus",
    "[body]\nmass = 245": r"body\.mass: a quantity needs value and unit.*unit = \"kg\"",
    "[body]\nmass = { value = 245, unit = 'm' }": r"body\.mass\.unit: wrong unit.*become kg",
    "[body]\nmass = { value = 245, unit = 'kgg' }": r"'kgg' \(unknown\)",
    "[body]\nmass = { value = '245', unit = 'kg' }": r"body\.mass\.value.*not a number",
    "[body]\nmass = { value = 245, unit = 'g' }": r"mine\.toml: body\.mass: .*80 to 500 kg.*0\.245",
    "[throttle_servo]\nnatural_frequency = { value = 12, unit = 'Hz' }": r"turn/s, rpm or rad/s",
    "[gears]\n1 = { value = 12, unit = '1' }\n3 = { value = 8, unit = '1' }": r"gears\.3",
    "[gears]\n1 = { value = 99, unit = '1' }": r"gear 1: overall gear ratio.*1 to 40",
    "[[effects]]\nname = 'backlsh'": r"effects\[0\]\.name.*did you mean 'backlash'\?",
    "[[effects]]\nslack = 1": r"effects are malformed",
    "[[effects]]\nname = 'backlash'\nslak = 1": r"effects\[0\]\.slak.*did you mean 'slack'\?",
    "[[effects]]\nname = 'channel_lag'\nchannel = 'engine_sped'": r"did you mean 'engine_speed'\?",
    "[[effects]]\nname = 'channel_lag'\nchannel = 'rear_teeth'": r"effects\[0\]\.channel",
    "[[effects]]\nname = 'clock_drift'\nclock = 'optic'": r"did you mean 'optical'\?",
    "[[effects]]\nname = 'eccentricity'\nencoder = 'rear'": r"did you mean 'rear_encoder'\?",
    "[channels.engine_sped]": r"channels\.engine_sped.*did you mean 'engine_speed'\?",
    "[channels.gear]\nperiod = { value = -1, unit = 's' }": r"channels\.gear\.period.*0 to 10 s",
    "body = 3": r"body: not a table",
    "= 3": r"cannot be read",
}


@pytest.mark.parametrize("text", SLIPS)
def test_a_slip_is_told_with_place_and_remedy(text, tmp_path):
    with pytest.raises(VehicleFileError, match=SLIPS[text]) as caught:
        load_vehicle(written(tmp_path, text))
    assert isinstance(caught.value, ValueError)
    assert all((caught.value.what, caught.value.where, caught.value.expected, caught.value.remedy))


def test_a_missing_file_or_name_is_told(tmp_path):
    with pytest.raises(VehicleFileError, match="cannot be read"):
        load_vehicle(tmp_path / "none.toml")
    (tmp_path / "nameless.toml").write_text("[body]\n")
    with pytest.raises(VehicleFileError, match=r"nameless\.toml: name"):
        load_vehicle(tmp_path / "nameless.toml")
