"""A parameter of a simulation: nominal value, prior half width and bounds."""

import math
from dataclasses import dataclass

from slipbench.identification.mismatch.systems.model_file import MOST_HALF_WIDTHS, Number
from slipbench.protocol.errors import InputError


@dataclass(frozen=True)
class Parameter:
    """A parameter of a simulation, with its prior.

    start       nominal value, in `unit`
    plus_minus  half width of the 95 % prior interval, in `unit`; 0: exact; None: half of the
                distance between the bounds
    bounds      values that the simulation accepts, (low, high) in `unit`; None: no limits
    unit        in the notation of pint; "1": without unit

    A start above 0 has a multiplicative prior; a parameter of either sign has a start of 0 or less.
    """

    start: float
    plus_minus: float | None = None
    bounds: tuple[float, float] | None = None
    unit: str = "1"

    def number(self, where: str) -> Number:
        """Return it as a number of a model file. Raises InputError, which names `where`."""
        self._check(where)
        half = self.half_width
        if self.start > 0.0:
            half = min(half, MOST_HALF_WIDTHS * self.start)
        try:
            return Number(value=self.start, unit=self.unit, plus_minus=half)
        except ValueError as fault:
            raise InputError(f"{self} cannot be used", where=where, found=str(fault)) from fault

    @property
    def half_width(self) -> float:
        """Half width (95 %), in `unit`; requires plus_minus or bounds."""
        if self.plus_minus is not None:
            return self.plus_minus
        assert self.bounds is not None
        return 0.5 * (self.bounds[1] - self.bounds[0])

    def _check(self, where: str) -> None:
        if not math.isfinite(self.start):
            raise InputError("start is not a finite number", where=where, found=str(self.start))
        if self.plus_minus is None and self.bounds is None:
            raise InputError(
                "how far it may be from its start is unknown: it has neither plus_minus nor bounds",
                where=where,
                expected="plus_minus (half width of what is reliable with 95 %) or bounds",
                remedy=f"as in Parameter({self.start:g}, plus_minus={self._a_tenth:g}); 0 is exact",
            )
        if self.plus_minus is not None and not 0.0 <= self.plus_minus < math.inf:
            raise InputError(
                "plus_minus is no half width",
                where=where,
                expected="a number of 0 or more",
                found=str(self.plus_minus),
            )
        self._check_bounds(where)

    def _check_bounds(self, where: str) -> None:
        if self.bounds is None:
            return
        low, high = self.bounds
        if not low < high or (self.plus_minus is None and math.isinf(high - low)):
            raise InputError(
                "the bounds are no range",
                where=where,
                expected="low below high; both finite where plus_minus is not given",
                found=f"({low}, {high})",
            )
        if not low <= self.start <= high:
            raise InputError(
                "the start is outside of the bounds",
                where=where,
                expected=f"{low:g} to {high:g} {self.unit}",
                found=f"{self.start:g} {self.unit}",
            )

    @property
    def _a_tenth(self) -> float:
        return 0.1 * abs(self.start) or 1.0
