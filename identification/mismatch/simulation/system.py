"""What the engine must be told of whatever is simulated: the one interface between the two.

A system is a set of nominal numbers with equations: a motorcycle of a vehicle file, or what a model
file tells. It is immutable; other numbers make another system. The engine calibrates, locates,
names and proves through these methods and knows no vehicle.
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
from slipbench.identification.mismatch.simulation.turn import Turn
from slipbench.identification.mismatch.simulation.written_units import SI, WrittenUnits
from slipbench.plant.effects.effect import Effect
from slipbench.plant.signals import Floats
from slipbench.protocol.recording.recording import Recording


class System(ABC):
    """Whatever is simulated.

    units: of regressors, by name. operating: the regressor along which a region is told.
    direction: the regressor whose sign tells opening from closing. Empty: there is none.
    smooth: whether outputs follow the smallest changes of numbers and effects; not where sensors round.
    farthest: prior deviations that a number may be off at all, so that no calibration is led astray
    on its way.
    """

    units: Mapping[str, str]
    operating: str = ""
    direction: str = ""
    farthest: float = math.inf
    smooth: bool = False

    # What it is.

    @property
    @abstractmethod
    def name(self) -> str:
        """Its name."""

    @property
    @abstractmethod
    def effects(self) -> tuple[Effect, ...]:
        """Effects that act in it."""

    @property
    @abstractmethod
    def library(self) -> tuple[type[Effect], ...]:
        """Effects that may be missing in it. Their patterns raise PlantError where they cannot."""

    @property
    @abstractmethod
    def plus_minus(self) -> Mapping[str, float]:
        """95 % half widths, SI, by `Coordinate.key` or 'effects.<effect's key>.<parameter>'."""

    @abstractmethod
    def at(self, known: Sequence[Coordinate], x: Floats, effects: Sequence[Effect]) -> Self:
        """Return it at coordinates x, with these effects in place of its own of the same key."""

    @abstractmethod
    def as_improved(self, plus_minus: Mapping[str, float]) -> Self:
        """Return it as an improved file tells it, its numbers known this well."""

    @abstractmethod
    def text(self) -> str:
        """Return the file that tells it."""

    @property
    def written(self) -> WrittenUnits:
        """Units in which its file is written."""
        return SI

    # What the recordings are to it.

    @abstractmethod
    def prepare(self, recording: Recording) -> Record:
        """Make a recording ready. Raises InputError where nothing in it can drive a simulation."""

    @abstractmethod
    def check(self, record: Record) -> None:
        """Raise InputError where a recording is of something else."""

    @abstractmethod
    def partition(self, records: Sequence[Record]) -> CausalPartition:
        """Find the drives and blocks that all these records carry."""

    @abstractmethod
    def coordinates(
        self, records: Sequence[Record], partition: CausalPartition
    ) -> list[Coordinate]:
        """List what is uncertain of it and of the clocks of these records."""

    @abstractmethod
    def touched(self, partition: CausalPartition, coordinate: Coordinate) -> tuple[str, ...]:
        """Return the drives whose outputs a coordinate can change."""

    @abstractmethod
    def slow_subsystems(self, partition: CausalPartition) -> tuple[str, ...]:
        """Return the drives on which the slow unknown of a record acts."""

    @abstractmethod
    def concerns(self, effect: Effect, partition: CausalPartition, subsystem: str) -> bool:
        """Tell whether an effect can change what the outputs of a drive show."""

    def changes_only_sensors(self, effect: Effect, partition: CausalPartition) -> bool:
        """Tell whether an effect leaves every simulation as it is and changes what sensors tell."""
        return hasattr(effect, "measure")

    # What it does.

    @abstractmethod
    def simulate(
        self,
        record: Record,
        partition: CausalPartition,
        subsystem: str,
        q: Floats,
        added: Mapping[str, Floats],
    ) -> Columns:
        """Run one drive of one record. q: of the slow unknown; added: to columns of the inputs.

        Raises PlantError where it cannot run.
        """

    def derivatives(
        self,
        record: Record,
        partition: CausalPartition,
        subsystem: str,
        q: Floats,
        added: Mapping[str, Floats],
        known: Sequence[Coordinate],
        x: Floats,
    ) -> Derivatives | None:
        """Run one drive and differentiate what its sensors look at; None where it cannot.

        To the coordinates known, at x, that this drive is touched by, and to the slow unknown if
        it acts here; q, added: as for `simulate`. Raises PlantError where it cannot run.
        """
        return None

    @abstractmethod
    def places(self, partition: CausalPartition) -> list[InjectionPoint]:
        """Places, sensors aside, where something may act that these blocks can see."""

    @abstractmethod
    def input_disturbance(
        self, place: InjectionPoint, record: Record, course: Floats
    ) -> dict[str, Floats]:
        """Columns to add to the inputs for a course, row by row, of what acts at a place."""

    @abstractmethod
    def regressors(
        self,
        record: Record,
        partition: CausalPartition,
        subsystem: str,
        q: Floats,
        added: Mapping[str, Floats],
    ) -> Mapping[str, Floats]:
        """Quantities along which something may act in a drive, (rows,) each.

        q, added: as for `simulate`.
        """

    @property
    def notes(self) -> tuple[str, ...]:
        """What its user should look at before an analysis, a line each; () where nothing is odd."""
        return ()

    def duration(self, recordings: int) -> str:
        """Say how long the analysis of so many prepared recordings takes; empty: not long."""
        return ""

    def acts_at(self, effect: Effect) -> str:
        """Return the place (see `places`) or the sensor where an effect acts; empty: no such."""
        return ""

    def curve(
        self, place: InjectionPoint, regressor: str, knots: Floats, values: Floats, number: int
    ) -> Effect | None:
        """Return a free curve as an effect of the simulation; None where it knows none there.

        number: of several at once, from 0.
        """
        return None

    def turn_of(self, effect: Effect) -> str:
        """Return the regressor around a turn along which an effect acts by its equation; or empty."""
        return ""

    def unseen_turns(self) -> tuple[Turn, ...]:
        """Lines that could tell at which angle of what turns unseen a recording began."""
        return ()

    def turns_unseen(self) -> bool:
        """Tell whether it has something that goes with an angle of which recordings tell only the speed."""
        return any(e.unseen_turn for e in self.effects)

    def silenced(self) -> Self:
        """Return it with nothing that goes with such an angle."""
        return self.at((), np.zeros(0), [e.silent() for e in self.effects if e.unseen_turn])

    def first_angle(self) -> tuple[int, float] | None:
        """Return which slow unknown is the first value of an unseen angle, and rad of its unit."""
        return None

    def with_half_a_step(self) -> "Self | None":
        """Return the same with half of the step of integration; None where that is not to be had."""
        return None

    def coarse(self) -> Self:
        """Return it with steps of integration that are just fine enough to compare simulations."""
        return self

    # What could be tried next; a system without a menu proposes nothing.

    def experiments(self) -> Sequence[Any]:
        """Trials that one could make; each says itself in a line."""
        return ()

    def rehearse(self, like: Record, choice: Any) -> Record:
        """Return the record that a trial would give, seen by sensors like the recorded ones.

        Raises ValueError where it cannot.
        """
        raise ValueError(f"{self.name} has no menu of trials, so {choice} cannot be rehearsed")

    def trial(self, choice: Any, name: str, file: str) -> Mapping[str, Any]:
        """Return a trial of the menu as the tree of a trial file. file: path of the system's."""
        raise ValueError(f"{self.name} has no trial file for {choice}")
