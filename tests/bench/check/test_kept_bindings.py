"""Laws of the bindings kept in the project: on the captures that they are for, every role is live."""

import struct
from pathlib import Path

import numpy as np
import pytest

from slipbench import examples
from slipbench.bench.check.observed_roles import values_of
from slipbench.bench.check.report import check_report
from slipbench.bench.check.traffic import BusTraffic, capture_traffic
from slipbench.protocol.binding.binding import Binding, read_binding
from slipbench.protocol.errors import InputError
from slipbench.protocol.logs.frame_log import FrameLog
from tests.recordings import recording

FOLDER = Path(examples.__path__[0]) / "bindings"
CAPTURES = {
    "subaru_wrx": ("subaru_wrx/sample_can_spec.dbc", "subaru_wrx/can_sample.log"),
    "yamaha_r1": ("yamaha_r1/session.dbc", "yamaha_r1/session.log"),
    "gt86": ("subaru_wrx/sample_can_spec.dbc", "gt86_gt350/gt86_vsslog.log"),
    "gt350": ("gt86_gt350/ford_lincoln_base_pt.dbc", "gt86_gt350/gt350_vsslog.trc"),
}
KMH, RPM = 1 / 3.6, 2 * np.pi / 60


@pytest.fixture(scope="module")
def captures() -> dict[str, tuple[Binding, BusTraffic]]:
    return {}


def capture(name: str, captures) -> tuple[Binding, BusTraffic]:
    if name not in captures:
        database, log = (recording(each) for each in CAPTURES[name])
        binding = read_binding(FOLDER / f"{name}.toml", database)
        captures[name] = binding, capture_traffic(log, binding.database)
    return captures[name]


@pytest.mark.parametrize("name", CAPTURES)
def test_every_role_is_live_and_nothing_contradicts(name: str, captures) -> None:
    binding, traffic = capture(name, captures)
    report = check_report(binding, traffic)
    assert [each.role for each in report.roles if not each.is_live] == []
    assert [str(each) for each in report.findings] == []
    assert report.status == 0
    assert "throttle_request" in {need.role for need in report.missing}  # they only listen


@pytest.mark.parametrize("name", CAPTURES)
def test_a_trial_is_refused_with_the_roles_that_are_missing(name: str, captures) -> None:
    binding, _ = capture(name, captures)
    assert not binding.can_request
    with pytest.raises(InputError, match="throttle_request"):
        binding.require_trial(spark=False)


@pytest.mark.parametrize(
    ("name", "role", "low", "high"),
    [
        ("subaru_wrx", "rear_wheel_speed", 30, 40),
        ("yamaha_r1", "rear_wheel_speed", 70, 80),
        ("yamaha_r1", "engine_speed", 14000 * RPM, 14700 * RPM),
        ("gt86", "rear_wheel_speed", 20, 35),
        ("gt86", "front_wheel_speed", 0, 0),
        ("gt350", "rear_wheel_speed", 10, 20),
    ],
)
def test_the_largest_values_are_those_of_the_recordings(name, role, low, high, captures) -> None:
    binding, traffic = capture(name, captures)
    _, values = values_of(binding, traffic, role)
    assert low <= values.max() <= high


def test_the_scale_of_a_speed_that_is_wrong_is_found_on_a_real_capture(captures) -> None:
    """A rear wheel that is read in km/h in place of m/s, 3.6 times too slow."""
    binding, traffic = capture("subaru_wrx", captures)
    assert binding.roles is not None
    roles = dict(binding.roles.roles)
    roles["rear_wheel_speed"] = roles["rear_wheel_speed"].model_copy(update={"unit": "km/h"})
    file = binding.roles.model_copy(update={"roles": roles})
    from slipbench.protocol.binding.binding import bind

    wrong = bind(file, binding.database, FOLDER / "subaru_wrx.toml")
    found = check_report(wrong, traffic).findings
    assert [each.role for each in found] == ["rear_wheel_speed"]
    assert "0.277 times" in found[0].found


def rusefi_frames() -> list[tuple[int, bytes]]:
    """One broadcast, packed as the structs of rusEFI's can_verbose.cpp, little-endian."""
    return [
        (0x200, struct.pack("<HHBBBB", 0, 0, 0, 3, 0, 0)),
        (0x201, struct.pack("<HhBBBB", 6200, round(28.5 * 50), 60, 80, 143, 10)),
        (0x202, struct.pack("<hhhH", 4550, 4312, 4310, 0)),
        (0x203, struct.pack("<HBBBBBB", 98 * 30, 85 + 40, 31 + 40, 0, 0, 0, 0)),
    ]


def test_rusefi_is_read_as_its_source_packs_it() -> None:
    binding = read_binding(FOLDER / "rusefi.toml")
    rows = [(number, *frame) for number in range(40) for frame in rusefi_frames()]
    count = len(rows)
    log = FrameLog(
        time_ns=np.array([number * 50_000_000 for number, *_ in rows], np.int64),
        bus=np.zeros(count, np.uint8),
        identifier=np.array([identifier for _, identifier, _ in rows], np.uint32),
        extended=np.zeros(count, np.bool_),
        fd=np.zeros(count, np.bool_),
        sent=np.zeros(count, np.bool_),
        length=np.full(count, 8, np.uint8),
        data=np.array([list(data) for *_, data in rows], np.uint8),
        buses=("can0",),
    )
    traffic = BusTraffic(log, binding.database)
    report = check_report(binding, traffic)
    assert report.status == 0, [str(each) for each in report.findings]
    expected = {
        "engine_speed": 6200 * RPM,
        "gear": 3,
        "spark_advance": np.deg2rad(28.5),
        "vehicle_speed": 143 * KMH,
        "rider_grip": 0.455,
        "throttle_position": 0.4312,
        "manifold_pressure": 98e3,
        "coolant_temperature": 85 + 273.15,
        "intake_temperature": 31 + 273.15,
    }
    for role, value in expected.items():
        assert values_of(binding, traffic, role)[1][-1] == pytest.approx(value, rel=1e-4), role
