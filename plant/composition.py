"""The nominal equations and a set of effects become the text of one kernel.

Every effect of the set is in the kernel, behind a switch that its presence turns; parameters are
numbers handed in at each call. So one kernel serves every combination and every size, and is
compiled once (docs/decisions/plant-one-kernel.md tells why).
"""

import inspect
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from types import ModuleType
from typing import Any

import numpy as np

from plant import kernel
from plant.compiled import entry, inlined, load, text_of
from plant.effects.effect import Effect, Hook
from plant.equations import EQUATIONS, GIVES_SEVERAL, RATES
from plant.motorcycle import BLOCK_NAMES, Motorcycle
from plant.signals import Floats, Inputs, Outputs

EffectClass = type[Effect]
ARGUMENTS = (
    "throttle_command",
    "spark",
    "time",
    "step",
    "count",
    "stage",
    "history",
    "history_rate",
)
LED = ("throttle", "engine_speed", "rear_speed", "speed")
ELSEWHERE = ("throttle_command", "spark", "gear", *(f"measured_{state}" for state in LED))
HELD = ("gear_ratio", *(name for name in Inputs.names if name not in ELSEWHERE))
RENAMED_OUTPUTS = {"spark_applied": "spark"}
ADVANCE = "f8[::1](f8[::1],f8[:,::1],f8[::1],f8[::1],f8,i8,i8,i8,f8[::1],f8[:,::1])"
EVALUATE = "f8[::1](f8[::1],f8[::1],f8[::1],f8[::1],f8)"


@dataclass(frozen=True)
class Layout:
    """Where everything stands in the kernel's arrays, for one set of effects."""

    effects: tuple[EffectClass, ...]
    parameters: tuple[str, ...]
    states: tuple[str, ...]

    @property
    def effect_states(self) -> tuple[str, ...]:
        """Names of the states that effects add, as '<effect>.<state>'."""
        return self.states[len(RATES) :]

    def pack(self, motorcycle: Motorcycle) -> Floats:
        """Return the motorcycle's numbers in the kernel's order; absent effects are off."""
        present = {type(effect): effect for effect in motorcycle.effects}
        values = [value for _, block in motorcycle.blocks() for value in block.values()]
        for effect in self.effects:
            here = present.get(effect)
            values.append(float(here is not None))
            values.extend((here or effect.absent()).values())
        acting = {hook.seam for effect in present for hook in effect.hooks}
        values.extend(float(seam in acting) for seam in _seams(self.effects))
        return np.array(values)


@cache
def layout(effects: tuple[EffectClass, ...]) -> Layout:
    """Return the layout of the kernel for these effects."""
    parameters = [
        f"{block}_{p.name}"
        for block in BLOCK_NAMES
        for p in Motorcycle.__dataclass_fields__[block].default_factory.parameters()  # type: ignore[union-attr]
    ]
    for effect in effects:
        parameters.append(f"{effect.name}.present")
        parameters.extend(f"{effect.name}.{p.name}" for p in effect.parameters())
    parameters.extend(f"acting.{seam}" for seam in _seams(effects))
    states = [*RATES, *(f"{e.name}.{s}" for e in effects for s in e.states)]
    return Layout(effects, tuple(parameters), tuple(states))


def _seams(effects: tuple[EffectClass, ...]) -> list[str]:
    """Return the seams at which any of these effects acts."""
    return sorted({hook.seam for effect in effects for hook in effect.hooks})


@cache
def compose(effects: tuple[EffectClass, ...]) -> ModuleType:
    """Return the compiled kernel: a module with `advance` and `evaluate`."""
    return load(kernel_text(effects))


def kernel_text(effects: tuple[EffectClass, ...]) -> str:
    """Return the whole text of the kernel for these effects, nominal equations first."""
    constants = [
        f"{name} = {getattr(kernel, name)}"
        for name in ("HEADER", "RINGS", "THROTTLE_COMMAND", "SPARK", "GEAR", "CLUTCH", "BAD_GEAR")
    ]
    parts = ["\n".join(constants) + "\n"]
    parts += [inlined(text_of(equation, f"nominal__{equation.__name__}")) for equation in EQUATIONS]
    for effect in effects:
        parts += [inlined(text_of(h.function, _hook_name(effect, h))) for h in effect.hooks]
    parts.append(inlined(rates_text(layout(effects))))
    parts += [
        inlined(text_of(f)) for f in (kernel.held_value, kernel.transmission, kernel.off_the_stop)
    ]
    parts += [inlined(text) for text in tuple_texts(layout(effects))]
    parts += [entry(text_of(kernel.advance), ADVANCE), entry(text_of(kernel.evaluate), EVALUATE)]
    return "\n\n".join(parts)


def rates_text(order: Layout) -> str:
    """Return the text of `rates`: every equation, each followed by the effects at its seam."""
    known = _Names(order)
    signature = "x, u, led, throttle_command, spark, p, step, count, stage, history, history_rate"
    lines = [f"def rates({signature}):"]
    lines += [f"    {name} = x[{i}]" for i, name in enumerate(RATES)]
    lines += [f"    {name} = u[{i}]" for i, name in enumerate(HELD)]
    lines += ["    time = (count + stage) * step"]
    lines += [f"    dx{i} = 0.0" for i in range(len(RATES), len(order.states))]
    for equation in EQUATIONS:
        seam = equation.__name__
        gives = GIVES_SEVERAL.get(seam, (seam,))
        lines.append(f"    {', '.join(gives)} = nominal__{seam}({known.arguments(equation, None)})")
        known.add(gives)
        lines += _seam_lines(known, order.effects, seam, gives)
    rates = [*_led(RATES), *(f"dx{i}" for i in range(len(RATES), len(order.states)))]
    outputs = [RENAMED_OUTPUTS.get(name, name) for name in Outputs.names]
    outputs += [f"x[{i}]" for i in range(len(RATES), len(order.states))]
    lines.append(f"    return ({', '.join(rates)},), ({', '.join(outputs)},)")
    return "\n".join(lines)


def _led(rates: Mapping[str, str]) -> Iterator[str]:
    """Yield the rate of each nominal state: its equation's, or the slope of what leads it."""
    for state, rate in rates.items():
        if state == "throttle_rate":
            yield f"{rate} if led[0] != led[0] else 0.0"
        elif state in LED:
            i = LED.index(state)
            yield f"{rate} if led[{i}] != led[{i}] else led[{i}]"
        else:
            yield rate


def tuple_texts(order: Layout) -> list[str]:
    """Return the texts of the kernel's small functions, written out for the number of states."""
    n, outputs = len(order.states), len(Outputs.names) + len(order.effect_states)
    return [
        _tuple_text("along(x, h, k)", "x[{0}] + h * k[{0}]", n),
        _tuple_text("past_middle(x, h, k1, k2)", "x[{0}] + h * (2.0 * k2[{0}] - k1[{0}])", n),
        _tuple_text("mean_rate(a, b, c)", "(a[{0}] + 4.0 * b[{0}] + c[{0}]) / 6.0", n),
        _tuple_text("read_states(x)", "x[{0}]", n),
        _tuple_text("read_parameters(p)", "p[{0}]", len(order.parameters)),
        _inputs_text(),
        _throttle_text(n),
        _slopes_text(),
        _write_text("write", outputs),
        _write_text("write_states", n),
    ]


def _tuple_text(head: str, element: str, length: int) -> str:
    return f"def {head}:\n    return ({', '.join(element.format(i) for i in range(length))},)"


def _inputs_text() -> str:
    given = {"gear_ratio": "ratio", "clutch": "clutch"}
    places = {name: f"row[{i}]" for i, name in enumerate(Inputs.names)}
    elements = ", ".join(given.get(name) or places[name] for name in HELD)
    return f"def read_inputs(row, ratio, clutch):\n    return ({elements},)"


def _throttle_text(states: int) -> str:
    others = ", ".join(f"x[{i}]" for i in range(2, states))
    return f"def with_throttle(x, position, rate):\n    return (position, rate, {others})"


def _slopes_text() -> str:
    places = ((Inputs.names.index(f"measured_{s}"), list(RATES).index(s)) for s in LED)
    elements = ", ".join(f"(row[{column}] - x[{state}]) / duration" for column, state in places)
    return f"def slopes(row, x, duration):\n    return ({elements},)"


def _write_text(name: str, length: int) -> str:
    lines = "\n".join(f"    row[{i}] = numbers[{i}]" for i in range(length))
    return f"def {name}(row, numbers):\n{lines}"


def _seam_lines(
    known: "_Names", effects: tuple[EffectClass, ...], seam: str, gives: tuple[str, ...]
) -> Iterator[str]:
    """Yield the effects at a seam, behind one switch for the seam and one for each effect."""
    if seam not in _seams(effects):
        return
    yield f"    if p[{known.place(f'acting.{seam}')}] > 0.5:"
    for effect in effects:
        for hook in (h for h in effect.hooks if h.seam == seam):
            yield f"        if p[{known.place(f'{effect.name}.present')}] > 0.5:"
            targets = [*gives, *(f"dx{known.state(effect, state)}" for state in hook.governs)]
            call = f"{_hook_name(effect, hook)}({known.arguments(hook.function, effect)})"
            yield f"            {', '.join(targets)} = {call}"


def _hook_name(effect: EffectClass, hook: Hook) -> str:
    return f"{effect.name}__{hook.function.__name__}"


class _Names:
    """What each argument name means at this point of the kernel."""

    def __init__(self, order: Layout) -> None:
        self._parameters = {name: i for i, name in enumerate(order.parameters)}
        self._states = {name: i for i, name in enumerate(order.states)}
        self._known = {*RATES, *HELD, *ARGUMENTS}

    def add(self, names: tuple[str, ...]) -> None:
        """Count these quantities as known from here on."""
        self._known.update(names)

    def place(self, parameter: str) -> int:
        """Return the place of a parameter."""
        return self._parameters[parameter]

    def state(self, effect: EffectClass, name: str) -> int:
        """Return the place of an effect's state."""
        return self._states[f"{effect.name}.{name}"]

    def arguments(self, function: Callable[..., Any], effect: EffectClass | None) -> str:
        """Return the text of the arguments for a call of the function."""
        return ", ".join(
            self._text(name, effect) for name in inspect.signature(function).parameters
        )

    def _text(self, name: str, effect: EffectClass | None) -> str:
        own = f"{effect.name}.{name}" if effect else name
        if own in self._parameters:
            return f"p[{self._parameters[own]}]"
        if effect and own in self._states:
            return f"x[{self._states[own]}]"
        if name in self._parameters:
            return f"p[{self._parameters[name]}]"
        if name in self._known:
            return name
        raise NameError(
            f"{effect.name if effect else 'equation'}: '{name}' is neither its own parameter or "
            f"state nor known at this seam; known are {sorted(self._known)}"
        )
