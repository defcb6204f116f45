"""What real captures allow is analysed; what they do not allow is said with the missing roles."""

import os
from pathlib import Path

import numpy as np
import pytest

from slipbench.identification.response.identify import identify, slip_range
from slipbench.identification.signals.motion import Motion
from slipbench.identification.signals.tooth_counter import teeth_per_second
from slipbench.identification.signals.trial_window import NoExcitation
from slipbench.protocol.recording.import_log import Capture, import_capture

HOME = Path(__file__).parents[2]
RECORDINGS = Path(os.environ.get("SLIPBENCH_RECORDINGS", HOME.parent / "shared" / "recordings"))
pytestmark = pytest.mark.skipif(
    not RECORDINGS.is_dir(),
    reason=f"no real recordings in {RECORDINGS}; set SLIPBENCH_RECORDINGS to their folder",
)

CAPTURES = {
    "subaru_wrx": ("subaru_wrx/can_sample.log", "subaru_wrx/sample_can_spec.dbc", {}),
    "gt86": ("gt86_gt350/gt86_vsslog.log", "subaru_wrx/sample_can_spec.dbc", {}),
    "gt350": ("gt86_gt350/gt350_vsslog.trc", "gt86_gt350/ford_lincoln_base_pt.dbc", {}),
    "comma2k19": (
        "comma2k19/segment.log",
        "comma2k19/segment.dbc",
        {"pose": "comma2k19/pose_speed.csv"},
    ),
    "yamaha_r1": (
        "yamaha_r1/session.log",
        "yamaha_r1/session.dbc",
        {"gps": "yamaha_r1/gps.csv", "lean": "yamaha_r1/lean.csv"},
    ),
}


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    """Identify a capture by name, once each."""
    done = {}

    def of(name):
        if name not in done:
            log, database, tables = CAPTURES[name]
            capture = Capture(
                RECORDINGS / log,
                HOME / "examples" / "roles" / f"{name}.toml",
                RECORDINGS / database,
                {k: RECORDINGS / v for k, v in tables.items()},
            )
            out = tmp_path_factory.mktemp(name) / "run"
            done[name] = identify(import_capture(capture, out))
        return done[name]

    return of


@pytest.mark.parametrize("name", CAPTURES)
def test_without_excitation_a_response_is_refused_in_words(found, name):
    result = found(name)
    assert result.main is None
    assert isinstance(result.window, NoExcitation)
    refused = next(x for x in result.left_out if x.analysis.startswith("frequency response"))
    assert "no trial phase and so no excitation" in refused.reason
    assert "trial_phase" in refused.roles


@pytest.mark.parametrize("name", CAPTURES)
def test_speeds_are_those_of_the_vehicle(found, name):
    moved = found(name).motion
    assert isinstance(moved, Motion)
    top = np.nanmax(moved.driven) * 3.6
    low, high = {
        "subaru_wrx": (125, 135),
        "gt86": (105, 112),
        "gt350": (45, 55),
        "comma2k19": (65, 75),
        "yamaha_r1": (265, 290),
    }[name]
    assert low < top < high


@pytest.mark.parametrize(
    ("name", "most"), [("subaru_wrx", 0.02), ("comma2k19", 0.04), ("yamaha_r1", 0.2)]
)
def test_slip_of_a_real_drive_is_small_and_centred(found, name, most):
    low, high = slip_range(found(name))
    assert -most < low < high < most
    assert abs(np.nanmedian(found(name).motion.slip.ratio)) < most / 4


def test_all_wheel_drive_says_that_slip_is_between_axles(found):
    assert "driven too" in found("subaru_wrx").motion.reference_name


@pytest.mark.parametrize("name", ["gt86", "gt350"])
def test_spinning_rears_beside_standing_fronts_give_a_slip_speed(found, name):
    result = found(name)
    assert result.motion.slip.kind == "slip speed"
    assert any(item.analysis == "slip as a ratio" for item in result.left_out)
    assert np.nanmax(result.motion.slip.speed) > 12


def test_the_counter_of_a_gt350_agrees_with_its_own_wheel_speed(found):
    result = found("gt350")
    counter = result.recording.channels["rear_tooth_counter"]
    wheel = result.data.samples("rear_left_wheel_speed")
    rate = teeth_per_second(counter.time, counter.value, 256)
    fast = np.interp(rate.time, wheel.time, wheel.value)
    moving = fast > 5
    turns = fast[moving] / (2 * np.pi * 0.337)
    assert np.median(rate.value[moving] / turns) == pytest.approx(126, rel=0.01)


def test_every_channel_of_a_capture_is_on_the_bus_clock(found):
    assert found("subaru_wrx").data.clocks == {}
