"""Slip controllers on drawn motorcycles: does the slip stay within the limit, and when does it settle.

Two rides each, as on the controllers' page: a wet patch, and rolling on where the road is wet. The
controller may only reduce torque. Without control the same motorcycle is ridden for comparison.
"""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from slipbench.identification.closed_loop_simulation.compare import CAUGHT, HARD, WET
from slipbench.identification.closed_loop_simulation.drawn_motorcycles import (
    DrawnMotorcycle,
    drawn_motorcycle,
)
from slipbench.identification.closed_loop_simulation.reducing import reducing_only
from slipbench.identification.closed_loop_simulation.ride import Ridden, ride
from slipbench.identification.closed_loop_simulation.scenario import Scenario, wet_patch, wet_road
from slipbench.plant.errors import PlantError
from slipbench.plant.vehicle_file import Vehicle
from slipbench.protocol.controller_file import ControllerFile

SCENARIOS = (wet_patch(CAUGHT, HARD), wet_road(CAUGHT, WET))
BAND = 0.01  # slip above the setpoint that counts as settled
WARM_UP = 2.5  # s
OPEN_LOOP = "open loop"


@dataclass(frozen=True)
class Outcome:
    """One ride. peak: slip; settling: s from the first excess of the band to the last one, 0 without
    any, inf where it lasts to the end; peak and settling are NaN where the ride is not possible."""

    controller: str
    scenario: str
    number: int
    effects: tuple[str, ...]
    peak: float
    settling: float

    @property
    def possible(self) -> bool:
        """Whether this motorcycle can hold the speed of the scenario."""
        return math.isfinite(self.peak)


def outcomes(
    vehicle: Vehicle,
    files: Mapping[str, ControllerFile],
    numbers: Sequence[int],
    seed: int,
    report: Callable[[str], None] = lambda _: None,
) -> Iterator[list[Outcome]]:
    """Outcomes of one motorcycle after the other: every controller and open loop."""
    for number in numbers:
        report(f"motorcycle {number} of {numbers[-1]}")
        drawn = drawn_motorcycle(vehicle, seed, number)
        yield [
            outcome(drawn, name, files.get(name), scenario, seed)
            for scenario in SCENARIOS
            for name in (OPEN_LOOP, *files)
        ]


def outcome(
    drawn: DrawnMotorcycle, name: str, file: ControllerFile | None, scenario: Scenario, seed: int
) -> Outcome:
    """Ride one motorcycle once; without a file in open loop."""
    controller = reducing_only(file) if file is not None else None
    try:
        ridden = ride(drawn.motorcycle, scenario, controller, seed, WARM_UP)
    except (PlantError, ValueError):  # no equilibrium at the speed of the scenario
        return Outcome(name, scenario.name, drawn.number, drawn.effects, math.nan, math.nan)
    peak = float(np.max(np.nan_to_num(ridden.slip, nan=math.inf)))
    return Outcome(name, scenario.name, drawn.number, drawn.effects, peak, settling(ridden))


def settling(ridden: Ridden) -> float:
    """Time for which the slip exceeds the setpoint by more than the band, s; inf: to the end."""
    above = np.flatnonzero(~(ridden.slip <= ridden.target + BAND))
    if not above.size:
        return 0.0
    if above[-1] == ridden.slip.size - 1:
        return math.inf
    return float(ridden.time[above[-1] + 1] - ridden.time[above[0]])
