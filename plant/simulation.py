"""A motorcycle in motion: a state, an input, a time step, the next state."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from types import ModuleType

import numpy as np
from numpy.typing import NDArray

from slipbench.plant.composition import SERVO, compose
from slipbench.plant.effects.effect import Effect
from slipbench.plant.effects.library import LIBRARY, STAND_INS
from slipbench.plant.equations import EQUATIONS
from slipbench.plant.kernel import BAD_GEAR, HEADER, RINGS
from slipbench.plant.layout import Layout, layout, moving
from slipbench.plant.motorcycle import Motorcycle
from slipbench.plant.signals import Floats, Inputs, Outputs

HISTORY = 0.25
"""Longest delay that is kept [s]."""

__all__ = ["Inputs", "Outputs", "Simulation", "ring_length"]


def ring_length(step: float) -> int:
    """Length of the kept history in steps of so many seconds, a power of two."""
    return 1 << math.ceil(math.log2(HISTORY / step + 4))


@dataclass(frozen=True, eq=False)
class Simulation:
    """The compiled motorcycle.

    step: integration step [s]. steps_per_row: steps for which a row of inputs is held (the command
    period). every: steps per row of output. library: the effects that are in the kernel, present or
    not; those of the motorcycle are added. servo_only: nothing but the throttle servo moves, which
    is many times faster. Making one is cheap once its kernel has been compiled.
    """

    motorcycle: Motorcycle
    step: float = 0.25e-3
    steps_per_row: int = 4
    every: int = 1
    library: tuple[type[Effect], ...] = (*LIBRARY, *STAND_INS)
    servo_only: bool = False
    layout: Layout = field(init=False, repr=False)
    kernel: ModuleType = field(init=False, repr=False)
    parameters: Floats = field(init=False, repr=False)
    ratios: Floats = field(init=False, repr=False)
    delays: Floats = field(init=False, repr=False)
    size: int = field(init=False, repr=False)
    shown: NDArray[np.int64] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        if (self.steps_per_row % self.every and self.every % self.steps_per_row) or self.every < 1:
            raise ValueError(
                f"every = {self.every} steps and the command period of {self.steps_per_row} steps "
                "do not divide one another; choose a multiple or a divisor"
            )
        present = (type(effect) for effect in self.motorcycle.effects)
        effects = moving((*self.library, *present))
        servo, engine = self.motorcycle.throttle_servo, self.motorcycle.engine
        self._set("layout", layout(effects))
        self._set("kernel", compose(effects, SERVO if self.servo_only else EQUATIONS))
        self._set("parameters", self.layout.pack(self.motorcycle))
        self._set("ratios", np.array(self.motorcycle.gears))
        self._set("size", HEADER + len(self.layout.states) + RINGS * ring_length(self.step))
        self._set("shown", np.arange(len(Outputs.names) + len(self.layout.effect_states)))
        self._set("delays", np.array([servo.delay, engine.spark_delay]) / self.step)

    def _set(self, name: str, value: object) -> None:
        object.__setattr__(self, name, value)

    @property
    def ring(self) -> int:
        """Length of the history in steps, a power of two."""
        states: int = len(self.layout.states)
        return (self.size - HEADER - states) // RINGS

    def advance(self, state: Floats, inputs: Inputs) -> tuple[Floats, Outputs]:
        """State after all rows of the inputs, shape (size,), and the outputs on the way.

        The given state is not changed. Raises ValueError for a gear that does not exist and for a
        state that another kind of simulation has made.
        """
        out = np.empty((self._samples(inputs), len(self.shown)))
        new = self._run(state, inputs, self.shown, out)
        return new, Outputs(out, self.layout.effect_states)

    def trajectories(
        self, state: Floats, inputs: Inputs, names: Sequence[str]
    ) -> dict[str, Floats]:
        """Some outputs by name, shape (samples,) each, in SI. Raises as `advance` does.

        Less is written than by `advance`, and each time series is contiguous.
        """
        every = (*Outputs.names, *self.layout.effect_states)
        out = np.empty((len(names), self._samples(inputs)))
        self._run(state, inputs, np.array([every.index(n) for n in names], np.int64), out.T)
        return dict(zip(names, out, strict=True))

    def _samples(self, inputs: Inputs) -> int:
        return len(inputs.table) * self.steps_per_row // self.every

    def _run(self, state: Floats, inputs: Inputs, shown: NDArray[np.int64], out: Floats) -> Floats:
        """The state after all rows; fill the outputs `shown` into the columns of out."""
        table = inputs.table
        if len(state) != self.size:
            raise ValueError(
                f"a state of {len(state)} numbers; this simulation's have {self.size}: it was made "
                "with another step or other effects; make it with this simulation"
            )
        new: Floats = self.kernel.advance(
            state,
            table,
            self.parameters,
            self.ratios,
            self.step,
            self.steps_per_row,
            self.every,
            len(self.layout.states),
            self.delays,
            shown,
            out,
        )
        if new[0] == BAD_GEAR:
            raise ValueError(
                f"gears {sorted(set(inputs.gear))} asked for; this motorcycle has 1 to "
                f"{len(self.ratios)}, and 0 for neutral"
            )
        return new

    def state(
        self, *, throttle_command: float = 0.0, spark: float = 0.0, **states: float
    ) -> Floats:
        """State at time zero, shape (size,): named states in SI, the others zero, constant commands."""
        x = np.zeros(len(self.layout.states))
        for name, value in states.items():
            x[self.layout.states.index(name)] = value
        return self.pack(x, throttle_command, spark)

    def pack(self, x: Floats, throttle_command: float, spark: float) -> Floats:
        """State array, shape (size,), for states x with a history of constant commands and throttle."""
        past = np.repeat([x[0], x[1], throttle_command, spark], self.ring)
        return np.concatenate([[0.0], x, past])

    def states(self, state: Floats) -> Floats:
        """All states in SI in the order of `layout.states`, shape (states,)."""
        return state[HEADER : HEADER + len(self.layout.states)].copy()

    def value(self, state: Floats, name: str) -> float:
        """One named state in SI, such as 'rear_angle' or 'relaxation_length.force'."""
        return float(state[HEADER + self.layout.states.index(name)])

    def instant(self, x: Floats, row: Floats) -> tuple[Floats, Outputs]:
        """Rates of states x, shape (states,), and the outputs, without any dead time; SI.

        row: one row of inputs, as `Inputs.table[0]`, but with the overall ratio for the gear.
        """
        names = self.layout.effect_states
        out = np.empty((1, len(Outputs.names) + len(names)))
        dx: Floats = self.kernel.evaluate(x, out[0], self.parameters, row, self.step)
        return dx, Outputs(out, names)

    def row(self, gear: int, throttle: float) -> Floats:
        """A row of inputs for `instant`, shape (inputs,): a gear and a throttle command (0..1)."""
        ratio = self.motorcycle.gears[gear - 1]
        only: Floats = Inputs.held(gear=ratio, throttle_command=throttle).table[0]
        return only
