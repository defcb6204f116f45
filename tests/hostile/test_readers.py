"""No file, however damaged, makes a reader fail in any way but by saying what is to be mended."""

from time import process_time

import can
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from slipbench import dbc
from slipbench.bench.trials.excitation import plan_excitation
from slipbench.protocol.configuration import load_toml, read_toml
from slipbench.protocol.database.database import load_database
from slipbench.protocol.errors import InputError
from slipbench.protocol.logs import read_log
from slipbench.protocol.recording.role_map import RoleMap
from slipbench.protocol.tables import read_table
from slipbench.protocol.trial_file import TrialFile
from slipbench.protocol.units import linear, parse_quantity
from tests.hostile.damage import NASTY, damaged, fuzz, survives
from tests.paths import ROOT

TRIAL = (ROOT / "examples" / "trials" / "throttle_sweep.toml").read_bytes()
ROLES = (ROOT / "dbc" / "motorbike_roles.toml").read_bytes()
DATABASE = dbc.MOTORBIKE.read_bytes()
LOGS = (".log", ".asc", ".trc", ".blf", ".csv")
TABLE = b"time (s),speed (km/h),gear\n0.0,12.5,1\n0.1,12.75,1\n0.2,13.0,2\n0.3,,2\n" * 3


def trial(path):
    plan_excitation(read_toml(path, TrialFile))


def roles(path):
    read_toml(path, RoleMap)


@pytest.fixture(scope="module")
def logs(tmp_path_factory):
    """A small log in every format that python-can writes."""
    folder = tmp_path_factory.mktemp("logs")
    for ending in LOGS:
        with can.Logger(folder / f"good{ending}") as logger:
            for number in range(30):
                logger.on_message_received(
                    can.Message(
                        timestamp=1.7e9 + 0.01 * number,
                        arbitration_id=0x100 + number % 3,
                        data=bytes([number] * (number % 9)),
                        is_extended_id=number % 2 == 0,
                        channel=0,
                    )
                )
    return {ending: (folder / f"good{ending}").read_bytes() for ending in LOGS}


@pytest.mark.parametrize("ending", LOGS)
def test_a_damaged_log(ending, logs, tmp_path):
    assert len(read_log(write(tmp_path / f"good{ending}", logs[ending])).frames)

    @settings(fuzz, max_examples=80)
    @given(damaged(logs[ending]))
    def attempt(data):
        survives(read_log, tmp_path / f"bad{ending}", data)

    attempt()


@pytest.mark.parametrize(
    ("name", "good", "read"),
    [
        ("trial.toml", TRIAL, trial),
        ("roles.toml", ROLES, roles),
        ("car.dbc", DATABASE, load_database),
        ("table.csv", TABLE, read_table),
    ],
)
def test_a_damaged_description_or_table(name, good, read, tmp_path):
    read(write(tmp_path / f"good_{name}", good))

    @settings(fuzz, max_examples=60 if name == "car.dbc" else 120)
    @given(damaged(good))
    def attempt(data):
        survives(read, tmp_path / name, data)

    attempt()


@pytest.mark.parametrize("read", [read_log, read_table, load_toml, trial, roles, load_database])
def test_no_file_at_all(read, tmp_path):
    @settings(fuzz, max_examples=80)
    @given(st.binary(max_size=300) | st.sampled_from(NASTY))
    def attempt(data):
        survives(read, tmp_path / "anything", data)

    attempt()


@pytest.mark.parametrize(
    "text",
    [
        "a = " + "[" * 100_000,
        "a = " + "{b=" * 100_000,
        "[" + "a." * 5_000 + "b]",
        "a" * 1_000_000,
        "a = " + "9" * 10_000,
        "a = 1" + "0" * 400 + ".0",
        "a = inf",
        "a = nan",
        "a." * 50_000 + "b = 1",
        "c = {" + "a . " * 50_000 + "b = 1}",
        "'a'." * 50_000 + "b = 1",
        "\"'." * 50_000,
        ("a." * 98 + "b = 1\n") * 1000,
    ],
)
@pytest.mark.parametrize("read", [load_toml, trial, roles])
def test_toml_made_to_exhaust(read, text, tmp_path):
    began = process_time()
    survives(read, tmp_path / "deep.toml", text.encode())
    assert process_time() - began < 2.0, "s: 50 000 dotted parts took tomllib half a minute"


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("duration", "1e12"),
        ("duration", "inf"),
        ("duration", '"1e15 s"'),
        ("stop", "inf"),
        ("amplitude", "inf"),
        ("amplitude", "nan"),
        ("start", '"1e-300 Hz"'),
    ],
)
def test_a_waveform_that_no_memory_holds_is_refused(key, value, tmp_path):
    lines = [
        f"{key} = {value}" if line.startswith(f"{key} =") else line
        for line in TRIAL.decode().splitlines()
    ]
    survives(trial, tmp_path / "trial.toml", "\n".join(lines).encode())


@pytest.mark.parametrize(
    "unit",
    [
        "9**9**9",
        "9^9^9 m",
        "(9^9)^9",
        "m^(9^9)",
        "m**99999999",
        "((((m" * 20,
        "m/0",
        "m)",
        "'",
        "m^9^9",
        "__class__",
        "m.__class__",
        "lambda: 0",
        "m\n\n(",
        "1e999 m",
        "m" * 100_000,
        "-" * 50,
        "(" * 50,
        "m ^ 2 ^ 9",
        "9 ** 9 ** 9",
        "9e9**9e9",
        "0x9**9",
    ],
)
def test_a_unit_made_to_exhaust_is_no_unit(unit):
    with pytest.raises(InputError, match="not a quantity"):
        parse_quantity(f"1 {unit}", "m")
    with pytest.raises(ValueError, match=r"(?i)unit"):
        linear(unit, "m")


@pytest.mark.parametrize(
    ("unit", "to"),
    [
        ("m/s^2", "m/s**2"),
        ("m/s**2", "m/s^2"),
        ("kg*m^2/s^2", "J"),
        ("1/s", "Hz"),
        ("°C", "K"),
        ("km/h", "m/s"),
        ("deg/s", "rad/s"),
        ("%", "1"),
        ("s^-1", "Hz"),
    ],
)
def test_a_real_unit_is_still_one(unit, to):
    assert linear(unit, to)[0] > 0


def test_a_limit_that_limits_nothing_is_refused(tmp_path):
    for value in ("inf", "nan"):
        text = TRIAL.decode().replace('slip = "8 %"', f'slip = "{value} %"\nstale = "{value} ms"')
        with pytest.raises(InputError, match="finite"):
            trial(write(tmp_path / "trial.toml", text.encode()))


def write(path, data):
    path.write_bytes(data)
    return path
