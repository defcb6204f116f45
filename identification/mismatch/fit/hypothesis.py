"""A missing effect that can be added from magnitude zero and fitted."""

from abc import ABC, abstractmethod
from typing import Self

from slipbench.identification.mismatch.fit.variance_inflation import VarianceInflation
from slipbench.plant.effects.effect import Effect
from slipbench.plant.signals import Floats


class Hypothesis(ABC):
    """A missing effect. parameters: free values that are fitted.

    placebo: variance inflation of its size at placebo locations, if it has any. responses: response
    of the outputs to a unit of each parameter, (T, m, parameters) by output group and record, where
    known in advance; otherwise it is computed by finite differences.
    """

    parameters: tuple[float, ...]
    placebo: VarianceInflation | None = None
    responses: list[list[Floats]] | None = None

    @property
    @abstractmethod
    def name(self) -> str:
        """Its name."""

    @property
    @abstractmethod
    def deviations(self) -> tuple[float, ...]:
        """Prior deviation of every parameter."""

    @property
    @abstractmethod
    def difference_steps(self) -> tuple[float, ...]:
        """Finite-difference step of every parameter."""

    @abstractmethod
    def effect(self) -> Effect:
        """Return the effect at these parameters."""

    @abstractmethod
    def moved(self, step: Floats) -> Self:
        """Return the hypothesis after a step of its parameters, shape (parameters,)."""
