"""Rows of the tangents of every quantity, and inputs and outputs of each equation."""

import inspect
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from slipbench.plant.composition import RENAMED_OUTPUTS
from slipbench.plant.equations import GIVES_SEVERAL, RATES
from slipbench.plant.kernel_parts import HELD, LED
from slipbench.plant.kernel_rows import LANES, WIDTH
from slipbench.plant.layout import EffectClass, Layout
from slipbench.plant.signals import Inputs

Equations = tuple[Callable[..., Any], ...]
COMMANDS = ("throttle_command", "spark")
COPIED = {"rear_angle": "rear_speed", "distance": "speed"}
"""States whose rate is another state."""
HISTORY_OF = {"arriving": ("throttle", "throttle_rate")}
"""Equations that look into the history, and of which states."""

Source = tuple[str, int | str]
"""What an argument is: a 'parameter', 'state' or 'input' by number, a 'quantity' or 'command' by
name, or the 'gear'."""


@dataclass(frozen=True)
class Call:
    """An equation, or a hook of an effect with the states that it governs."""

    function: Callable[..., Any]
    effect: EffectClass | None = None
    governs: tuple[str, ...] = ()


@dataclass(frozen=True)
class Node:
    """An equation with the hooks at its seam. gives: quantities."""

    name: str
    gives: tuple[str, ...]
    calls: tuple[Call, ...]


@dataclass(frozen=True)
class Rows:
    """Offsets into the array of all rows."""

    order: Layout
    equations: Equations

    @cached_property
    def nodes(self) -> tuple[Node, ...]:
        """The equations in the order of evaluation, hooks in that of the effects."""
        return tuple(self._node(equation) for equation in self.equations)

    def _node(self, equation: Callable[..., Any]) -> Node:
        seam = equation.__name__
        hooks = (
            Call(hook.function, effect, hook.governs)
            for effect in self.order.effects
            for hook in effect.hooks
            if hook.seam == seam
        )
        return Node(seam, GIVES_SEVERAL.get(seam, (seam,)), (Call(equation), *hooks))

    @property
    def _blocks(self) -> dict[str, int]:
        """The first row of each block of rows."""
        states, inputs = len(self.order.states), len(Inputs.names)
        sizes = {
            "X_ROW": states,
            "Z_ROW": states,
            "K_ROW": states,
            "FIRST_ROW": states,
            "SUM_ROW": states,
            "INPUT_ROW": inputs,
            "LED_ROW": len(LED),
            "COMMAND_ROW": 1,
            "SPARK_ROW": 1,
            "QUANTITY_ROW": len(self._quantities),
            "ROWS": 0,
        }
        starts, row = {}, 0
        for name, size in sizes.items():
            starts[name] = row * WIDTH
            row += size
        return starts

    @cached_property
    def _quantities(self) -> tuple[str, ...]:
        """Quantities that are no rate."""
        return tuple(q for node in self.nodes for q in node.gives if q not in RATES.values())

    def constants(self) -> str:
        """The text of the offsets that kernel_rows.py, kernel_inputs.py and kernel_stages.py name."""
        states = tuple(list(RATES).index(state) for state in LED)
        inputs = tuple(Inputs.names.index(f"measured_{state}") for state in LED)
        stages = ("START", "MIDDLE", "END", "STOP", "OUTPUT", "STAGES")
        given = {name: number for number, name in enumerate(stages)}
        numbers = {
            **given,
            **self._blocks,
            "LANES": LANES,
            "WIDTH": WIDTH,
            "LED_STATES": states,
            "LED_INPUTS": inputs,
        }
        return "\n".join(f"{name} = {number}" for name, number in numbers.items()) + "\n"

    def state(self, number: int) -> int:
        """Row of a state at the stage under way."""
        return self._blocks["Z_ROW"] + number * WIDTH

    def rate(self, number: int) -> int:
        """Row of a state's rate."""
        return self._blocks["K_ROW"] + number * WIDTH

    def quantity(self, name: str) -> int:
        """Row of what an equation gives."""
        rates = list(RATES.values())
        if name in rates:
            return self.rate(rates.index(name))
        return self._blocks["QUANTITY_ROW"] + self._quantities.index(name) * WIDTH

    def of(self, source: Source) -> int:
        """Row of what an argument is, no parameter and no gear."""
        kind, which = source
        if kind == "command":
            return self._blocks["COMMAND_ROW" if which == COMMANDS[0] else "SPARK_ROW"]
        if isinstance(which, str):
            return self.quantity(which)
        return self.state(which) if kind == "state" else self.input(which)

    def input(self, number: int) -> int:
        """Row of an input."""
        return self._blocks["INPUT_ROW"] + number * WIDTH

    def output(self, name: str) -> Source | None:
        """Source of an output; None where it has no tangents."""
        return None if name == "time" else self.source(RENAMED_OUTPUTS.get(name, name), None)

    def sources(self, call: Call) -> dict[str, list[Source | None]]:
        """Source of each argument of a call, several for one that is a tuple; None: no tangent."""
        tuples = call.effect.tuples if call.effect else {}
        return {
            name: [self.source(each, call.effect) for each in tuples.get(name, (name,))]
            for name in inspect.signature(call.function).parameters
        }

    def source(self, name: str, effect: EffectClass | None) -> Source | None:
        """Source of a name, an effect's own parameters and states first."""
        own = f"{effect.name}.{name}" if effect else name
        for key in (own, name):
            if key in self.order.parameters:
                return "parameter", self.order.parameters.index(key)
            if key in self.order.states:
                return "state", self.order.states.index(key)
        if name in COMMANDS:
            return "command", name
        if name == "gear_ratio":
            return "gear", 0
        if name in HELD:
            return "input", Inputs.names.index(name)
        if any(name in node.gives for node in self.nodes):
            return "quantity", name
        return None
