"""Which rides are made and judged: motorcycles, noise and lengths."""

from dataclasses import dataclass

from rides import drawn, linear, vehicle

from slipbench.plant.motorcycle import Motorcycle

FIRST = 400_000  # seeds from here on had no part in any choice, nor had motorcycles drawn by them
RIDES_EACH = 10  # of one drawn motorcycle


@dataclass(frozen=True)
class Case:
    """Rides of one kind. kind: linear, drawn, whole; noise: 1 is the virtual bench's; lasts: s."""

    title: str
    kind: str
    vehicle: str
    noise: float
    lasts: float

    @property
    def name(self) -> str:
        """Name of the file that keeps what its rides gave."""
        return f"{self.kind}-{self.vehicle}-{self.noise:g}-{self.lasts:g}"


CASES = (
    Case("demonstration, linear", "linear", "demonstration", 0.1, 30.0),
    Case("demonstration, linear", "linear", "demonstration", 0.3, 30.0),
    Case("demonstration, linear", "linear", "demonstration", 1.0, 30.0),
    Case("demonstration, linear", "linear", "demonstration", 3.0, 30.0),
    Case("demonstration, linear", "linear", "demonstration", 1.0, 60.0),
    Case("nominal", "linear", "nominal", 1.0, 30.0),
    Case("drawn about nominal", "drawn", "nominal", 1.0, 30.0),
    Case("demonstration, all effects", "whole", "demonstration", 1.0, 30.0),
)


def motorcycle_of(case: Case, seed: int) -> Motorcycle:
    """Give the motorcycle of one ride."""
    if case.kind == "drawn":
        return drawn(case.vehicle, FIRST + (seed - FIRST) // RIDES_EACH)
    return vehicle(case.vehicle).motorcycle if case.kind == "whole" else linear(case.vehicle)
