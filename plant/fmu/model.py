"""Definition of an FMU of a motorcycle: the motorcycle, its internal step, and how it starts."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

from slipbench.plant.equilibrium import equilibrium
from slipbench.plant.layout import Layout, layout, moving
from slipbench.plant.motorcycle import Motorcycle
from slipbench.plant.signals import Floats
from slipbench.plant.simulation import Simulation


@dataclass(frozen=True, eq=False)
class FmuModel:
    """name: of the vehicle. step: internal step, s. gear and command (0..1): at the start.

    initial: every state at the start by name, SI. Only effects that this motorcycle has are in the
    FMU.
    """

    name: str
    motorcycle: Motorcycle
    step: float
    gear: int
    command: float
    initial: Mapping[str, float]
    layout: Layout = field(init=False, repr=False)

    def __post_init__(self) -> None:
        effects = moving(type(effect) for effect in self.motorcycle.effects)
        object.__setattr__(self, "layout", layout(effects))

    @property
    def parameters(self) -> Floats:
        """Start values of the kernel's parameters, shape (parameters,)."""
        return self.layout.pack(self.motorcycle)


def model_at(name: str, simulation: Simulation, gear: int, engine_speed: float) -> FmuModel:
    """Return the model that starts in the steady state at an engine speed, rad/s, in a gear.

    Raises ValueError where no throttle holds it.
    """
    state, command = equilibrium(simulation, gear, engine_speed)
    values = dict(zip(simulation.layout.states, simulation.states(state), strict=True))
    initial = MappingProxyType({key: float(value) for key, value in values.items()})
    return FmuModel(name, simulation.motorcycle, simulation.step, gear, command, initial)


def sensor_effects(motorcycle: Motorcycle) -> tuple[str, ...]:
    """Return the keys of effects that act in a sensor: they are not part of the FMU."""
    return tuple(effect.key for effect in motorcycle.effects if not effect.hooks)
