"""Something missing that can be turned up from nothing, and fitted."""

from abc import ABC, abstractmethod
from typing import Self

from slipbench.identification.mismatch.fit.variance_inflation import VarianceInflation
from slipbench.plant.effects.effect import Effect
from slipbench.plant.signals import Floats


class Hypothesis(ABC):
    """Something missing that can be turned up from nothing. dials: what is fitted, free numbers.

    placebo: how its size scatters over other places at which it is looked for, if it has any.
    responses: what a unit of each dial brings in the outputs, (T, m, dials) by block and record,
    where that is known beforehand; else it is measured by nudging.
    """

    parameters: tuple[float, ...]
    placebo: VarianceInflation | None = None
    responses: list[list[Floats]] | None = None

    @property
    @abstractmethod
    def name(self) -> str:
        """Its word."""

    @property
    @abstractmethod
    def deviations(self) -> tuple[float, ...]:
        """Prior deviation of every dial."""

    @property
    @abstractmethod
    def difference_steps(self) -> tuple[float, ...]:
        """Small steps by which the dials' effect is measured."""

    @abstractmethod
    def effect(self) -> Effect:
        """Return the effect at these dials."""

    @abstractmethod
    def moved(self, step: Floats) -> Self:
        """Return it with its dials turned."""
