"""Laws of slip control inside the tick: what it targets, what it learns, and which step it runs.

`Recorder` stands in place of a controller; it keeps what it is asked and moves nothing by itself.
"""

import math
from dataclasses import replace

import pytest

from slipbench import dbc
from slipbench.bench.gateway.slip_control import (
    MEAN_TIME,
    NEVER,
    REPORT,
    SlipControl,
    slip_control,
    tooth_modulo,
)
from slipbench.bench.safety.trial import NO_OFFSETS, Offsets
from slipbench.bench.safety.vehicle_monitor import Wheels
from slipbench.bench.trials.preparation import prepare
from slipbench.controllers.slip_controller import from_tree
from slipbench.protocol.codec.codec import Codec
from slipbench.protocol.codec.messages import Intervals, OpticalSpeed, ToothIntervals
from slipbench.protocol.codec.placement import OWN
from slipbench.protocol.configuration import load_toml, parse
from slipbench.protocol.controller_file import ControllerFile
from slipbench.protocol.database.database import load_database
from tests.bench.conditions import plan
from tests.paths import CONTROLLERS, TRIALS

DATABASE = load_database(dbc.MOTORBIKE)
WHEELS = Wheels(0.32, 0.30, 16)
SPEED = 50.0
PITCH = 2 * math.pi / 16


class Recorder:
    """A controller that keeps what it is asked."""

    def __init__(self) -> None:
        self.starts: list[tuple[float, ...]] = []
        self.updates: list[tuple[float, ...]] = []

    def start(self, *arguments):
        self.starts.append(arguments)
        return len(self.starts)

    def update(self, state, *arguments):
        self.updates.append(arguments)
        return 0.01 * len(self.updates), -0.02 * len(self.updates), state + 100


def made(target=None):
    recorder = Recorder()
    control = SlipControl(recorder, WHEELS, 256, target)
    recorder.starts.clear()
    recorder.updates.clear()
    return control, recorder


def ride(control, seconds=1.0, slip=0.01, start=0.0, first=0, optical=True):
    """Feed a steady ride at SPEED; the time of its last rear tooth and the next tooth's number."""
    interval = PITCH * 0.32 / (SPEED * (1 + slip))
    front = PITCH * 0.30 / SPEED
    events = [
        (start + k * interval, "RearTeeth", first + k) for k in range(1, int(seconds / interval))
    ]
    events += [(start + k * front, "FrontTeeth", first + k) for k in range(1, int(seconds / front))]
    readings = range(int(seconds / 0.004)) if optical else ()
    events += [(start + k * 0.004, "OpticalSpeed", 0) for k in readings]
    for time, name, count in sorted(events):
        if name == "OpticalSpeed":
            control.observe(name, OpticalSpeed(SPEED, True, 0.0), time)
        else:
            step = interval if name == "RearTeeth" else front
            control.observe(name, ToothIntervals(Intervals.SHORT, count % 256, (step,)), time)
    return max(time for time, name, _ in events if name == "RearTeeth")


def test_the_target_is_the_slip_that_stood_before_and_the_waveform_is_added():
    control, recorder = made()
    now = ride(control, slip=0.013)
    for tick, wave in enumerate((0.0, 0.002, -0.001)):
        control.update(wave, now + tick * 0.001)
        assert recorder.updates[-1][0] == pytest.approx(0.013 + wave, abs=1e-6)
    ride(control, 0.5, slip=0.03, start=now)  # the target stays what it was at the start
    control.update(0.0, now + 0.5)
    assert recorder.updates[-1][0] == pytest.approx(0.013, abs=1e-6)


def test_a_target_of_the_trials_own_stands_in_place_of_the_slip_that_was_found():
    control, recorder = made(0.02)
    now = ride(control)
    control.update(0.001, now)
    assert recorder.updates[-1][0] == pytest.approx(0.021)


def test_the_slip_that_stood_is_a_mean_over_a_while():
    """First order: a jump of the slip counts as one minus exp(-t / MEAN_TIME), a tooth at a time."""
    control, recorder = made()
    now = ride(control, 2.0, slip=0.0)
    late = ride(control, 0.1, slip=0.02, start=now)
    control.update(0.0, late)
    share = 1 - math.exp(-(late - now) / MEAN_TIME)
    assert recorder.updates[-1][0] == pytest.approx(0.02 * share, rel=0.1)


def test_after_a_pause_the_slip_of_now_is_the_mean():
    control, recorder = made()
    now = ride(control, slip=0.0)
    late = ride(control, 0.02, slip=0.02, start=now + 2 * MEAN_TIME)
    control.update(0.0, late)
    assert recorder.updates[-1][0] == pytest.approx(0.02, abs=1e-4)


def test_a_slip_that_was_not_known_is_the_target_as_soon_as_it_is():
    control, recorder = made()
    control.update(0.0, 0.5)
    assert math.isnan(recorder.updates[-1][0])
    now = ride(control, start=1.0, slip=0.015)
    control.update(0.0, now)
    assert recorder.updates[-1][0] == pytest.approx(0.015, abs=1e-6)


def test_the_first_step_is_a_millisecond_and_the_others_are_as_long_as_they_were():
    control, recorder = made()
    now = ride(control)
    for at in (now, now + 0.001, now + 0.004):
        control.update(0.0, at)
    assert [step for *_, step in recorder.updates] == pytest.approx([0.001, 0.001, 0.003])


def test_a_controller_starts_once_from_rest_at_the_slip_and_speed_that_are_known():
    control, recorder = made()
    now = ride(control, slip=0.012)
    assert recorder.starts == []
    assert control.requested == NO_OFFSETS
    for tick in range(3):
        found = control.update(0.0, now + tick * 0.001)
        assert found == control.requested == Offsets(0.01 * (tick + 1), -0.02 * (tick + 1))
    assert recorder.starts == [(0.0, 0.0, pytest.approx(0.012, abs=1e-6), pytest.approx(SPEED))]
    assert recorder.updates[0][1:3] == (pytest.approx(0.012, abs=1e-6), pytest.approx(SPEED))


def test_what_a_first_call_costs_is_paid_before_the_ticks():
    recorder = Recorder()
    SlipControl(recorder, WHEELS, 256, None)
    assert recorder.starts == [(0.0, 0.0, 0.0, 50.0)]  # at rest, without slip
    assert recorder.updates == [(0.0, 0.0, 50.0, 0.001)]


@pytest.mark.parametrize("name", ["RearTeeth", "FrontTeeth"])
def test_teeth_are_learnt_until_the_controller_starts_and_not_after(name):
    wheel = "rear" if name == "RearTeeth" else "front"
    control, _ = made()
    now = ride(control)
    before = getattr(control._estimate, wheel).learner.weight
    later = ride(control, 0.2, start=now)
    learnt = getattr(control._estimate, wheel).learner.weight
    assert learnt != before
    control.update(0.0, later)
    ride(control, 0.2, start=later)
    assert getattr(control._estimate, wheel).learner.weight == learnt
    assert getattr(control._estimate, wheel).time > later


def test_each_wheel_has_its_own_teeth_and_the_optical_speed_is_the_optical_speed():
    control, _ = made()
    now = ride(control, slip=0.02)
    found = control.slip(now)
    assert (found.value, found.speed) == (pytest.approx(0.02, abs=1e-6), pytest.approx(SPEED))
    assert found.source == "optical"
    alone, _ = made()
    now = ride(alone, slip=0.02, optical=False)
    found = alone.slip(now)
    assert found.source == "front wheel"
    assert found.value == pytest.approx(0.02, abs=1e-6)


@pytest.mark.parametrize(
    ("message", "believed"),
    [(OpticalSpeed(40.0, True, 0.0), True), (OpticalSpeed(40.0, False, 0.0), False)],
)
def test_an_optical_speed_counts_where_it_is_valid(message, believed):
    control, _ = made()
    now = ride(control)
    before = control._estimate
    control.observe("OpticalSpeed", message, now)
    assert (control._estimate != before) == believed
    control.observe("Anything", object(), now)


def test_a_tooth_may_be_as_late_as_its_frame_waits():
    control, _ = made()
    now = ride(control)
    interval = PITCH * 0.32 / (SPEED * 1.01)
    assert control.slip(now + REPORT + 1.45 * interval).age > 0
    for wait, known in ((1.45, True), (1.55, False)):
        at = now + REPORT + wait * interval
        control.observe("OpticalSpeed", OpticalSpeed(SPEED, True, 0.0), at)
        assert math.isfinite(control.slip(at).value) == known


def test_a_plan_without_a_controller_has_no_slip_control():
    assert slip_control(plan(), WHEELS, Codec(DATABASE)) is None
    prepared = prepare(TRIALS / "slip_steps_throttle.toml", dbc.MOTORBIKE).plan
    assert slip_control(replace(prepared, controller=None), WHEELS, Codec(DATABASE)) is None
    open_loop = prepared.trial.model_copy(update={"controller": None})
    assert slip_control(replace(prepared, trial=open_loop), WHEELS, Codec(DATABASE)) is None


@pytest.mark.parametrize("target", [None, 0.02])
def test_slip_control_of_a_plan_runs_its_controller_at_its_target(target):
    prepared = prepare(TRIALS / "slip_steps_throttle.toml", dbc.MOTORBIKE).plan
    setting = prepared.trial.controller.model_copy(update={"target": target})
    trial = prepared.trial.model_copy(update={"controller": setting})
    found = slip_control(replace(prepared, trial=trial), WHEELS, Codec(DATABASE))
    file = load_toml(CONTROLLERS / "throttle.toml")
    expected = SlipControl(
        from_tree(parse(file, ControllerFile, "").model_dump()), WHEELS, 256, target
    )
    for control in (found, expected):
        now = ride(control, slip=0.012)
        for tick in range(50):
            control.update(0.001, now + tick * 0.001)
    assert found.requested.throttle != 0.0
    assert found.requested == expected.requested


def test_the_count_of_teeth_wraps_at_its_signals_width():
    length = DATABASE.message("RearTeeth").signal("tooth_count").length
    assert tooth_modulo(Codec(DATABASE)) == 2**length
    teeth = DATABASE.message("RearTeeth")
    signals = tuple(replace(s, length=6) if s.name == "tooth_count" else s for s in teeth.signals)
    messages = tuple(replace(m, signals=signals) if m is teeth else m for m in DATABASE.messages)
    assert tooth_modulo(Codec(replace(DATABASE, messages=messages))) == 64


def test_teeth_of_a_wheel_speed_are_counted_without_end():
    codec = Codec(DATABASE, {name: at for name, at in OWN.items() if name != "RearTeeth"})
    assert tooth_modulo(codec) == NEVER
