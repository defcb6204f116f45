"""The script that is exported gives the commands of the designed controller."""

import numpy as np
import pytest

from slipbench.identification.ecu.exported_law import exported_law
from slipbench.identification.ecu.lua_machine import LuaMachine
from slipbench.identification.ecu.lua_script import GIVEN_BACK, script
from slipbench.identification.ecu.replay import AGREES, WheelSamples, replay, wheel_samples
from slipbench.identification.ecu.summary import lines
from slipbench.protocol.errors import InputError
from slipbench.protocol.recording.import_log import Capture, import_capture
from slipbench.protocol.recording.run_folder import read
from tests.identification.ecu.conftest import SHIPPED, TARGET, drawn, scheduled, shipped
from tests.paths import ROOT
from tests.recordings import recording

pytest.importorskip("lupa", reason="pip install 'slipbench[ecu]'")
LAWS = [*SHIPPED, "scheduled"]


def law_of(name, tick=200.0):
    return exported_law(scheduled() if name == "scheduled" else shipped(name), TARGET, tick)


@pytest.mark.parametrize("name", LAWS)
@pytest.mark.parametrize("seed", [1, 2])
def test_script_and_controller_give_the_same_commands(name, seed):
    done = replay(law_of(name), drawn(seed))
    moved = np.ptp(done.designed.throttle) + np.ptp(done.designed.spark)
    assert moved > 0.02, "the samples must move the controller"
    assert done.difference < AGREES
    assert done.agrees


@pytest.mark.parametrize("tick", [50.0, 100.0])
def test_at_slower_ticks_as_well(tick):
    assert replay(law_of("throttle", tick), drawn(3)).agrees


def test_a_script_with_another_gain_does_not_agree(monkeypatch):
    other = exported_law(shipped("spark"), TARGET * 1.1, 200.0)
    monkeypatch.setattr("slipbench.identification.ecu.replay.script", lambda _: script(other))
    assert not replay(law_of("spark"), drawn(1)).agrees


@pytest.mark.parametrize("name", LAWS)
def test_commands_only_reduce_and_keep_the_limits_and_the_rate(name):
    law = law_of(name)
    run = replay(law, drawn(4, gaps=False)).script
    tree = law.tree
    throttle = tree["mixed"]["throttle"] if tree["mixed"] else tree["limits"]
    for moved, limits in ((run.throttle, throttle), (run.spark, tree["limits"])):
        assert moved.max() <= 0.0
        assert moved.min() >= limits["low"] * (1 + 1e-6)
        assert np.abs(np.diff(moved)).max() <= limits["rate"] * law.tick * (1 + 1e-4)


@pytest.mark.parametrize("name", LAWS)
def test_slip_below_the_target_moves_nothing(name):
    n = 200
    run = replay(law_of(name), WheelSamples(np.full(n, 1.01), np.full(n, 150.0))).script
    assert not run.throttle.any()
    assert not run.spark.any()


@pytest.mark.parametrize("name", LAWS)
@pytest.mark.parametrize("fault", ["ratio", "speed", "standing", "negative"])
def test_unknown_slip_holds_the_offsets_and_then_gives_them_back(name, fault):
    law = law_of(name)
    n, lost = 100, 40
    held = round(GIVEN_BACK / law.tick)
    ratio, speed = np.full(n, 1.0 + 2 * TARGET), np.full(n, 150.0)
    array, value = {
        "ratio": (ratio, np.nan),
        "speed": (speed, np.nan),
        "standing": (speed, 5.0),
        "negative": (ratio, 0.9),
    }[fault]
    array[lost:] = value
    run = replay(law, WheelSamples(ratio, speed)).script
    moved = run.throttle + run.spark
    assert moved[lost - 1] < 0.0
    assert (moved[lost : lost + held] == moved[lost - 1]).all()
    assert not moved[lost + held :].any()


def test_the_script_asks_for_its_tick():
    assert LuaMachine(script(law_of("spark", 100.0))).tick_rate == 100.0


@pytest.mark.parametrize("call", ["print(1)", "local x=pcall", "string.format('a')", "x=x+1"])
def test_what_rusefi_does_not_have_is_a_fault(call):
    with pytest.raises(InputError, match="fault"):
        LuaMachine(f"function onTick() end {call if call != 'local x=pcall' else 'pcall(onTick)'}")


def test_numbers_are_single_precision():
    machine = LuaMachine(
        'function onTick() setEtbAdd((getSensor("WheelSlipRatio")+16777216.0)-16777216.0) end'
    )
    assert machine.ticks([1.25], [100.0]).throttle[0] == pytest.approx(
        0.02, abs=1e-9
    )  # 2 %, not 1.25 %


def test_a_real_recording(tmp_path):
    folder = recording("subaru_wrx")
    capture = Capture(
        folder / "can_sample.log",
        ROOT / "examples/roles/subaru_wrx.toml",
        folder / "sample_can_spec.dbc",
        {},
    )
    import_capture(capture, tmp_path / "wrx")
    law = exported_law(shipped("throttle_h_infinity"), TARGET, 200.0)
    done = replay(law, wheel_samples(read(tmp_path / "wrx"), law.tick))
    assert done.agrees
    assert (done.script.throttle < -0.005).any()
    assert "same commands" in lines(done)[-1]
