"""Interface between the mismatch engine and a simulated system.

A system is a set of nominal numbers with equations: a motorcycle of a vehicle file, or the content
of a model file. It is immutable; other numbers make another system. The engine calibrates, locates,
names and validates through these methods and does not depend on vehicles.
"""

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from typing import Any, Self

import numpy as np

from slipbench.identification.mismatch.simulation.causal_partition import CausalPartition
from slipbench.identification.mismatch.simulation.coordinates import Coordinate
from slipbench.identification.mismatch.simulation.derivatives import Derivatives
from slipbench.identification.mismatch.simulation.injection_point import InjectionPoint
from slipbench.identification.mismatch.simulation.record import Record
from slipbench.identification.mismatch.simulation.sensor import Columns
from slipbench.identification.mismatch.simulation.simulation_input import SimulationInput
from slipbench.identification.mismatch.simulation.turn import Turn
from slipbench.identification.mismatch.simulation.written_units import SI, WrittenUnits
from slipbench.plant.effects.effect import Effect
from slipbench.plant.signals import Floats
from slipbench.protocol.recording.recording import Recording


class System(ABC):
    """A simulated system.

    units: of regressors, by name. operating: the regressor over which operating regions are stated.
    direction: the regressor whose sign distinguishes opening from closing. Empty: there is none.
    smooth: whether outputs respond to the smallest changes of numbers and effects; False where
    sensors round. coordinate_bound: bound of every coordinate, in prior standard deviations, so
    that no calibration diverges on its way.
    """

    units: Mapping[str, str]
    operating: str = ""
    direction: str = ""
    coordinate_bound: float = math.inf
    smooth: bool = False

    # Description.

    @property
    @abstractmethod
    def name(self) -> str:
        """Name of the system."""

    @property
    @abstractmethod
    def effects(self) -> tuple[Effect, ...]:
        """Effects that act in the system."""

    @property
    @abstractmethod
    def library(self) -> tuple[type[Effect], ...]:
        """Effects that may be missing. Their patterns raise PlantError where they cannot run."""

    @property
    @abstractmethod
    def plus_minus(self) -> Mapping[str, float]:
        """95 % half widths, SI, by `Coordinate.key` or 'effects.<effect's key>.<parameter>'."""

    @abstractmethod
    def at(self, known: Sequence[Coordinate], x: Floats, effects: Sequence[Effect]) -> Self:
        """Return the system at coordinates x, (n,).

        These effects replace its own of the same key.
        """

    @abstractmethod
    def as_improved(self, plus_minus: Mapping[str, float]) -> Self:
        """Return the system of an improved file, with these half widths of its numbers."""

    @abstractmethod
    def text(self) -> str:
        """Return the text of its file."""

    @property
    def written(self) -> WrittenUnits:
        """Units in which its file is written."""
        return SI

    # Recordings.

    @abstractmethod
    def prepare(self, recording: Recording) -> Record:
        """Prepare a recording. Raises InputError where nothing in it can drive a simulation."""

    @abstractmethod
    def check(self, record: Record) -> None:
        """Raise InputError where a recording is of another system."""

    @abstractmethod
    def partition(self, records: Sequence[Record]) -> CausalPartition:
        """Return the subsystems and output groups that all these records support."""

    @abstractmethod
    def coordinates(
        self, records: Sequence[Record], partition: CausalPartition
    ) -> list[Coordinate]:
        """Return the uncertain parameters of the system and of the clocks of these records."""

    @abstractmethod
    def affected_subsystems(
        self, partition: CausalPartition, coordinate: Coordinate
    ) -> tuple[str, ...]:
        """Return the subsystems whose outputs a coordinate can change."""

    @abstractmethod
    def slow_subsystems(self, partition: CausalPartition) -> tuple[str, ...]:
        """Return the subsystems on which the slow disturbance of a record acts."""

    @abstractmethod
    def concerns(self, effect: Effect, partition: CausalPartition, subsystem: str) -> bool:
        """Return whether an effect can change the outputs of a subsystem."""

    def changes_only_sensors(self, effect: Effect, partition: CausalPartition) -> bool:
        """Return whether an effect leaves every simulation unchanged and changes sensor values."""
        return hasattr(effect, "measure")

    # Simulation.

    @abstractmethod
    def simulate(self, given: SimulationInput) -> Columns:
        """Simulate; each column has shape (rows,). Raises PlantError where it cannot run."""

    def derivatives(
        self, given: SimulationInput, known: Sequence[Coordinate], x: Floats
    ) -> Derivatives | None:
        """Simulate with derivatives of the columns of the subsystem's sensors, or return None.

        With respect to the coordinates `known`, at x, (n,), that change this subsystem, and to the
        slow disturbance if it acts here. None where derivatives are not available. Raises
        PlantError where it cannot run.
        """
        return None

    @abstractmethod
    def places(self, partition: CausalPartition) -> list[InjectionPoint]:
        """Return the injection points, except sensors, that the output groups can observe."""

    @abstractmethod
    def input_disturbance(
        self, place: InjectionPoint, record: Record, waveform: Floats
    ) -> dict[str, Floats]:
        """Return columns to add to the inputs, by name, for a waveform at an injection point.

        waveform: in the unit of the injection point, SI, shape (rows,). The result is SI, shape
        (rows,).
        """

    @abstractmethod
    def regressors(self, given: SimulationInput) -> Mapping[str, Floats]:
        """Return the regressors of effects in a simulated subsystem by name.

        SI, shape (rows,) each; (2, rows) for a scale.
        """

    @property
    def notes(self) -> tuple[str, ...]:
        """Notes for the user before an analysis, a line each; () where nothing is unusual."""
        return ()

    def duration(self, recordings: int) -> str:
        """Return the duration, as text, of an analysis of so many recordings; empty: not long."""
        return ""

    def acts_at(self, effect: Effect) -> str:
        """Return the injection point (see `places`) or sensor where an effect acts; empty: none."""
        return ""

    def curve(
        self, place: InjectionPoint, regressor: str, knots: Floats, values: Floats, number: int
    ) -> Effect | None:
        """Return a free curve as an effect of the simulation; None where there is none.

        knots, values: (n,), SI; number: index among several curves, from 0.
        """
        return None

    def turn_of(self, effect: Effect) -> str:
        """Return the turn of an angle that is the regressor of an effect's equation; or empty."""
        return ""

    def unseen_turns(self) -> tuple[Turn, ...]:
        """Return lines that could identify an unrecorded angle at the start of a recording."""
        return ()

    def turns_unseen(self) -> bool:
        """Return whether an effect depends on an angle of which only the speed is recorded."""
        return any(e.unseen_turn for e in self.effects)

    def without_unseen_turns(self) -> Self:
        """Return the system with all effects of such an angle set to zero."""
        return self.at((), np.zeros(0), [e.silent() for e in self.effects if e.unseen_turn])

    def first_angle(self) -> tuple[int, float] | None:
        """Return the slow coordinate of an unrecorded angle's first value, and rad per its unit."""
        return None

    def with_half_a_step(self) -> "Self | None":
        """Return the same with half the integration step; None where that is not possible."""
        return None

    def coarse(self) -> Self:
        """Return it with integration steps just fine enough to compare simulations."""
        return self

    # Candidate experiments; a system without candidates proposes nothing.

    def experiments(self) -> Sequence[Any]:
        """Return candidate experiments; str() of each is a description in one line."""
        return ()

    def rehearse(self, like: Record, choice: Any) -> Record:
        """Return the simulated record of an experiment, with sensors like the recorded ones.

        Raises ValueError where it cannot.
        """
        raise ValueError(f"{self.name} has no menu of trials, so {choice} cannot be rehearsed")

    def trial(self, choice: Any, name: str, file: str) -> Mapping[str, Any]:
        """Return an experiment as the tree of a trial file. file: path of the system's file.

        Raises ValueError for a system without trial files.
        """
        raise ValueError(f"{self.name} has no trial file for {choice}")
