"""The motorcycle of a vehicle file as a system of the mismatch engine."""

import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Self

import numpy as np
import tomli_w

from slipbench.identification.mismatch.motorcycle import causal_cut, places
from slipbench.identification.mismatch.motorcycle.check import check_same_vehicle
from slipbench.identification.mismatch.motorcycle.coordinates import coordinates, motorcycle_at
from slipbench.identification.mismatch.motorcycle.menu import Choice, menu, rehearse, trial_tree
from slipbench.identification.mismatch.motorcycle.record import prepare
from slipbench.identification.mismatch.motorcycle.regressors import (
    UNITS,
    motion_regressors,
    servo_regressors,
)
from slipbench.identification.mismatch.motorcycle.simulate import FINER, observed, simulate
from slipbench.identification.mismatch.motorcycle.tangents import derivatives
from slipbench.identification.mismatch.motorcycle.turns import crank_turns
from slipbench.identification.mismatch.simulation.causal_partition import CausalPartition
from slipbench.identification.mismatch.simulation.coordinates import Coordinate
from slipbench.identification.mismatch.simulation.derivatives import Derivatives
from slipbench.identification.mismatch.simulation.injection_point import InjectionPoint
from slipbench.identification.mismatch.simulation.record import Record
from slipbench.identification.mismatch.simulation.simulation_input import SimulationInput
from slipbench.identification.mismatch.simulation.system import System
from slipbench.identification.mismatch.simulation.turn import Turn
from slipbench.identification.mismatch.simulation.written_units import SI, WrittenUnits
from slipbench.plant.effects.effect import Effect
from slipbench.plant.effects.free_curve import free_curve
from slipbench.plant.effects.library import LIBRARY
from slipbench.plant.errors import PlantError
from slipbench.plant.motorcycle import Motorcycle
from slipbench.plant.signals import Floats, Inputs
from slipbench.plant.vehicle_file import Vehicle, load_vehicle
from slipbench.plant.vehicle_writer import edited_vehicle, vehicle_tree
from slipbench.protocol.errors import InputError
from slipbench.protocol.recording.recording import Recording

IMPROVED = "Calibrated on recordings, with the effects found there"


@dataclass(frozen=True, eq=False)
class MotorcycleSystem(System):
    """A vehicle of a vehicle file. finer: integration steps per row.

    source: text of the file and the vehicle that it describes; None for a vehicle without a file.
    """

    vehicle: Vehicle
    finer: int = FINER
    source: tuple[str, Vehicle] | None = None

    units = UNITS
    operating = "engine speed"
    direction = "throttle rate"
    coordinate_bound = 4.0

    @classmethod
    def load(cls, path: Path) -> Self:
        """Load a vehicle file. Raises InputError where it is not valid."""
        try:
            vehicle = load_vehicle(path)
            return cls(vehicle, source=(path.read_text(encoding="utf-8"), vehicle))
        except PlantError as fault:
            raise InputError(str(fault)) from fault

    @property
    def name(self) -> str:
        """Name of the vehicle."""
        return self.vehicle.name

    @property
    def effects(self) -> tuple[Effect, ...]:
        """Effects of the motorcycle."""
        return self.vehicle.motorcycle.effects

    @property
    def library(self) -> tuple[type[Effect], ...]:
        """Effects of the plant, without errors of clocks.

        Recordings are already aligned to the bus clock, which removes the effect of a clock error.
        """
        return tuple(kind for kind in LIBRARY if not hasattr(kind, "clock_error"))

    @property
    def plus_minus(self) -> Mapping[str, float]:
        """Half widths as in the vehicle file."""
        return self.vehicle.plus_minus

    def at(self, known: Sequence[Coordinate], x: Floats, effects: Sequence[Effect]) -> Self:
        """Return the vehicle at coordinates x, (n,), every value limited to its range.

        The effects replace those of the vehicle with the same key.
        """
        base = self._with_numbers(known, x)
        new = {e.key for e in effects}
        others = tuple(e for e in base.effects if e.key not in new)
        bike = replace(base, effects=(*others, *effects))
        return replace(self, vehicle=replace(self.vehicle, motorcycle=bike))

    def _with_numbers(self, known: Sequence[Coordinate], x: Floats) -> Motorcycle:
        """Return the motorcycle at coordinates x; the last result is cached, for other effects."""
        last: tuple[Sequence[Coordinate], Floats, Motorcycle] | None = vars(self).get("_last")
        if last is not None and last[0] is known and np.array_equal(last[1], x):
            return last[2]
        new = motorcycle_at(self.vehicle.motorcycle, known, x)
        vars(self)["_last"] = (known, x.copy(), new)
        return new

    def as_improved(self, plus_minus: Mapping[str, float]) -> Self:
        """Return the vehicle with the name of an improved vehicle."""
        vehicle = replace(
            self.vehicle,
            name=f"{self.vehicle.name} improved",
            plus_minus=plus_minus,
            description=self.vehicle.description or IMPROVED,
        )
        return replace(self, vehicle=vehicle)

    def text(self) -> str:
        """Return the vehicle file."""
        if self.source is None:
            return tomli_w.dumps(vehicle_tree(self.vehicle))
        return edited_vehicle(*self.source, self.vehicle)

    @property
    def written(self) -> WrittenUnits:
        """Units of the vehicle file."""
        return WrittenUnits.of_tree(tomllib.loads(self.source[0])) if self.source else SI

    def prepare(self, recording: Recording) -> Record:
        """Prepare a recording."""
        return prepare(recording, self.vehicle)

    def check(self, record: Record) -> None:
        """Raise InputError where the speeds do not fit the gear."""
        check_same_vehicle(self.vehicle.motorcycle, record)

    def partition(self, records: Sequence[Record]) -> CausalPartition:
        """Cut the causal graph at the throttle and at the speeds."""
        return causal_cut.partition(records)

    def coordinates(
        self, records: Sequence[Record], partition: CausalPartition
    ) -> list[Coordinate]:
        """Return parameters of blocks, gears in use, and clock offsets to a reference clock."""
        gears = {int(g) for r in records for g in set(Inputs(r.inputs).gear) if g > 0}
        clocks = {
            r.sensors[o].clock
            for r in records
            for b in partition.groups
            if b.sensors_suspected
            for o in b.outputs
        }
        reference = "ecu" if "ecu" in clocks else min(clocks, default="")
        return coordinates(self.vehicle, gears, clocks - {reference})

    def affected_subsystems(
        self, partition: CausalPartition, coordinate: Coordinate
    ) -> tuple[str, ...]:
        """Return the servo for parameters of the servo, the motion for all others."""
        servo = "servo" in partition.subsystems and coordinate.owner == "throttle_servo"
        return ("servo",) if servo else ("motion",)

    def slow_subsystems(self, partition: CausalPartition) -> tuple[str, ...]:
        """Return the motion, on which wind and grade act."""
        return ("motion",)

    def concerns(self, effect: Effect, partition: CausalPartition, subsystem: str) -> bool:
        """Decide by the seams and the channel of the effect."""
        return causal_cut.concerns(effect, partition, subsystem)

    def changes_only_sensors(self, effect: Effect, partition: CausalPartition) -> bool:
        """Return False for the throttle sensor where its value drives the motion."""
        drives = any(
            causal_cut.changes_simulation(effect, partition, d) for d in partition.subsystems
        )
        return not drives and (hasattr(effect, "measure") or hasattr(effect, "tooth_offsets"))

    def simulate(self, given: SimulationInput) -> Mapping[str, Floats]:
        """Simulate one subsystem of one record. Returns columns by name, SI, shape (rows,) each."""
        return observed(self.vehicle.motorcycle, given, self.finer)

    def derivatives(
        self, given: SimulationInput, known: Sequence[Coordinate], x: Floats
    ) -> Derivatives:
        """Simulate one subsystem with tangents, shape (rows, directions) by column.

        x: coordinates of `known`, (n,).
        """
        numbers = [
            i
            for i, k in enumerate(known)
            if given.subsystem in self.affected_subsystems(given.partition, k)
        ]
        return derivatives(self.vehicle.motorcycle, given, self.finer, known, x, numbers)

    def acts_at(self, effect: Effect) -> str:
        """Return the injection point of an effect's first seam, or the sensor of its channel."""
        return places.acts_at(effect)

    def curve(
        self, place: InjectionPoint, regressor: str, knots: Floats, values: Floats, number: int
    ) -> Effect | None:
        """Return the plant's free curve. knots, values: (n,), SI."""
        return free_curve(place.name, regressor, tuple(knots), tuple(values), number)

    def unseen_turns(self) -> tuple[Turn, ...]:
        """Return the lines of the crank."""
        return crank_turns()

    def coarse(self) -> Self:
        """Return it with one integration step per row."""
        return replace(self, finer=1)

    def places(self, partition: CausalPartition) -> list[InjectionPoint]:
        """Return the injection points from the servo to the road."""
        return [p for p in places.PLACES if p.subsystem in partition.subsystems]

    def input_disturbance(
        self, place: InjectionPoint, record: Record, waveform: Floats
    ) -> dict[str, Floats]:
        """Return a disturbance as columns of the plant's inputs, SI, shape (rows,) each.

        waveform: in the unit of the injection point, SI, shape (rows,).
        """
        return places.columns(place, self.vehicle.motorcycle, record, waveform)

    def regressors(self, given: SimulationInput) -> Mapping[str, Floats]:
        """Return regressors of the servo, or of the motion from the throttle plate to the road.

        SI, shape (rows,) each; (2, rows) for a scale.
        """
        bike = self.vehicle.motorcycle
        out = simulate(bike, given)
        if given.subsystem == "servo":
            return servo_regressors(given.record, out, bike.throttle_servo.delay)
        return motion_regressors(given.record, out, bike.engine.spark_delay)

    def experiments(self) -> Sequence[Choice]:
        """Return sweeps and square waves of throttle and spark."""
        return tuple(menu(len(self.vehicle.motorcycle.gears)))

    def rehearse(self, like: Record, choice: Choice) -> Record:
        """Simulate a candidate trial."""
        return rehearse(self.vehicle.motorcycle, like, choice)

    def trial(self, choice: Choice, name: str, file: str) -> Mapping[str, Any]:
        """Return a trial file's tree."""
        return trial_tree(choice, name, file)
