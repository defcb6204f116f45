"""Laws of what the gateway sends and believes: refused commands, the status, an invalid speed."""

import math
from dataclasses import replace
from unittest.mock import patch

import can
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from slipbench import dbc
from slipbench.bench.bus.simulated_bus import SimulatedNode
from slipbench.bench.gateway import gateway as module
from slipbench.bench.gateway.slip_control import SlipControl, slip_control
from slipbench.bench.safety.vehicle_monitor import Wheels
from slipbench.bench.trials.preparation import prepare
from slipbench.bench.trials.simulated_trial import run_simulated
from slipbench.protocol.codec.codec import Codec
from slipbench.protocol.codec.messages import (
    ActuatorCommand,
    Authority,
    Intervals,
    OpticalSpeed,
    Phase,
    ToothIntervals,
    TrialStatus,
    TripReason,
)
from slipbench.protocol.database.database import load_database
from tests.bench.trials.test_whole_trial import prepared
from tests.paths import TRIALS

DATABASE = load_database(dbc.MOTORBIKE)
CODEC = Codec(DATABASE)
COMMAND, STATUS = CODEC.identifier("ActuatorCommand"), CODEC.identifier("TrialStatus")
AUTHORITY = 320  # frames after which the bench has had authority for a while
SHORT = prepared(
    excitation__duration="300 ms",
    excitation__start="2 Hz",
    operating_point__steady_for="100 ms",
    settling="100 ms",
    hand_back="100 ms",
)


class Watched:
    """A short trial whose bus refuses some of the gateway's frames; what was sent and judged."""

    def __init__(self, folder, refuse) -> None:
        self.taken: list[object] = []  # messages that the bus took
        self.judged: list[tuple[ActuatorCommand, ActuatorCommand | None]] = []
        self.offered = 0
        send, permit = SimulatedNode.send, module.permit

        def sending(node, message, timeout=None):
            if message.arbitration_id in (COMMAND, STATUS):
                self.offered += 1
                if refuse(self.offered, message.arbitration_id):
                    raise can.CanOperationError("Transmit buffer full")
                decoded = CODEC.decode(message.arbitration_id, bytes(message.data))
                self.taken.append(decoded)
            send(node, message, timeout)

        def judging(command, held, *rest):
            sent = [one for one in self.taken if isinstance(one, ActuatorCommand)]
            self.judged.append((held.last, sent[-1] if sent else None))
            return permit(command, held, *rest)

        folder.mkdir()
        with patch.object(SimulatedNode, "send", sending), patch.object(module, "permit", judging):
            self.outcome = run_simulated(SHORT, folder)


@settings(max_examples=3, deadline=None)
@given(numbers=st.sets(st.integers(AUTHORITY, AUTHORITY + 250), min_size=5, max_size=30))
def test_a_refused_command_does_not_count_as_the_last_one_sent(tmp_path_factory, numbers):
    """Rates are judged from the command that the devices have, not from one that was refused."""
    lone = {n for n in numbers if n - 1 not in numbers}  # never two in a row
    folder = tmp_path_factory.mktemp("refused") / "run"
    watched = Watched(folder, lambda n, identifier: n in lone and identifier == COMMAND)
    assert watched.judged
    assert int(watched.outcome.lateness.refused.sum()) > 0
    for last, taken in watched.judged:
        assert last.throttle == pytest.approx(taken.throttle, abs=1e-4)  # the wire's resolution
        assert last.authority == taken.authority
        wrap = CODEC.period("ActuatorCommand", "time")
        assert (last.time - taken.time + 1e-3) % wrap == pytest.approx(1e-3, abs=2e-6)


@pytest.mark.parametrize(("in_a_row", "trips"), [(1, False), (2, False), (3, True), (4, True)])
def test_three_frames_that_are_refused_in_a_row_are_a_controller_off_the_bus(
    tmp_path, in_a_row, trips
):
    refused = range(AUTHORITY, AUTHORITY + in_a_row)
    watched = Watched(tmp_path / "run", lambda n, _: n in refused)
    if not trips:
        assert watched.outcome.done
        return
    assert watched.outcome.state.trip.reason == TripReason.BUS_OFF


@pytest.mark.parametrize("tripped", [False, True])
def test_the_status_claims_authority_while_the_bench_has_it_and_at_no_other_time(tmp_path, tripped):
    refused = range(AUTHORITY, AUTHORITY + 3) if tripped else ()
    watched = Watched(tmp_path / "run", lambda n, _: n in refused)
    statuses = [one for one in watched.taken if isinstance(one, TrialStatus)]
    holding = {Phase.EXCITING, Phase.SETTLING, Phase.HANDING_BACK}
    for status in statuses:
        expected = Authority.THROTTLE if status.phase in holding else Authority.NONE
        assert status.authority == expected, status
    end = Phase.TRIPPED if tripped else Phase.DONE
    assert {Phase.IDLE, Phase.EXCITING, end} <= {status.phase for status in statuses}


def controlled() -> SlipControl:
    """A slip control that has heard both wheels and the optical speed for a second."""
    plan = prepare(TRIALS / "slip_steps_throttle.toml", dbc.MOTORBIKE).plan
    control = slip_control(plan, Wheels(0.32, 0.30, 16), CODEC)
    assert control is not None
    for tick in range(1000):
        now = tick * 1e-3
        if tick % 3 == 0:
            teeth = ToothIntervals(Intervals.SHORT, tick // 3 % 256, (0.0025,))
            control.observe("RearTeeth", teeth, now)
            control.observe("FrontTeeth", teeth, now)
        if tick % 4 == 0:
            control.observe("OpticalSpeed", OpticalSpeed(50.0, True, now), now)
    return control


@pytest.mark.parametrize("speed", [0.0, 10.0, 49.0, 100.0, math.nan])
def test_slip_control_does_not_believe_an_invalid_optical_speed(speed):
    control, undisturbed = controlled(), controlled()
    for tick in range(1000, 1040):
        now = tick * 1e-3
        for each in (control, undisturbed):
            if tick % 4 == 0:
                each.observe("OpticalSpeed", OpticalSpeed(50.0, True, now), now)
        control.observe("OpticalSpeed", OpticalSpeed(speed, False, now), now)
        assert repr(control.slip(now)) == repr(undisturbed.slip(now))
    valid = replace(OpticalSpeed(40.0, False, 1.04), valid=True)
    control.observe("OpticalSpeed", valid, 1.04)  # the estimator does hear a valid one
    assert repr(control.slip(1.04)) != repr(undisturbed.slip(1.04))
