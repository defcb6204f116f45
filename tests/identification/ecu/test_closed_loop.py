"""What is exported works in closed loop on the simulated motorcycle, at the tick of the control unit."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from slipbench.controllers.pid import Pid
from slipbench.controllers.slip_controller import SlipController
from slipbench.identification.closed_loop_simulation.compare import CAUGHT, HARD, WET
from slipbench.identification.closed_loop_simulation.ride import TICK, ride
from slipbench.identification.closed_loop_simulation.scenario import wet_patch, wet_road
from slipbench.identification.ecu.exported_law import exported_law
from slipbench.identification.ecu.static_gain import static_gain
from slipbench.plant.vehicle_file import load_vehicle
from slipbench.plant.vehicles import DEMONSTRATION
from tests.identification.ecu.conftest import SHIPPED, shipped

BIKE = load_vehicle(DEMONSTRATION).motorcycle
SHORT = 2.5  # s of warm-up


@dataclass(frozen=True)
class AtTick:
    """A controller that is called once in `periods` ticks of the ride, and held between."""

    controller: SlipController
    periods: int

    def start(self, *known):
        return 0, self.controller.start(*known)

    def update(self, state, target, slip, speed, dt):
        count, inner = state
        throttle, spark = inner.throttle, inner.spark
        if count % self.periods == 0:
            throttle, spark, inner = self.controller.update(
                inner, target, slip, speed, self.periods * dt
            )
        return throttle, spark, (count + 1, inner)


def peak(scenario, controller):
    return float(ride(BIKE, scenario, controller, warm_up=SHORT).slip.max())


@pytest.mark.parametrize("name", SHIPPED)
def test_at_5_ms_the_law_holds_the_slip_as_well_as_at_1_ms(name):
    law = exported_law(shipped(name), CAUGHT, 200.0)
    fast, slow = (
        ride(BIKE, wet_road(CAUGHT, WET), AtTick(law.controller, n), warm_up=SHORT).slip
        for n in (1, law.periods)
    )
    assert slow.max() < 0.08  # 20 % without control
    assert slow.max() == pytest.approx(fast.max(), abs=0.002)
    half = slow.size // 2
    assert np.ptp(slow[half:]) < 1.3 * np.ptp(fast[half:]) + 0.001


@pytest.mark.parametrize("name", ["spark", "throttle"])
def test_the_static_part_alone_reduces_the_peak_and_does_not_oscillate(name):
    law = exported_law(shipped(name), CAUGHT, 200.0)
    part = Pid(static_gain(law.tree["law"]), 0.0, 0.0, law.controller.law.limits)
    static = AtTick(replace(law.controller, law=part, schedule=None), law.periods)
    scenario = wet_patch(CAUGHT, HARD)
    ridden = ride(BIKE, scenario, static, warm_up=SHORT)
    assert ridden.slip.max() < 0.95 * peak(scenario, None)
    last = ridden.time > ridden.time[-1] - 0.5
    assert np.ptp(ridden.slip[last]) < 0.01


def test_the_tick_is_that_of_the_control_unit():
    assert exported_law(shipped("throttle"), CAUGHT, 200.0).periods * TICK == pytest.approx(0.005)
