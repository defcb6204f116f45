"""The nominal equations and a set of effects become the text of one kernel.

Every effect of the set is in the kernel, behind a switch that its presence turns; parameters are
numbers handed in at each call. So one kernel serves every combination and every size, and is
compiled once (docs/decisions/plant-one-kernel.md states why).
"""

import inspect
from collections.abc import Callable, Iterator, Mapping, Sequence
from types import ModuleType
from typing import Any

from slipbench.plant import kernel
from slipbench.plant.compiled import entry, inlined, load, made_once, text_of
from slipbench.plant.effects.effect import Hook
from slipbench.plant.equations import EQUATIONS, GIVES_SEVERAL, RATES, air_delay
from slipbench.plant.kernel_parts import HELD, LED, tuple_texts
from slipbench.plant.layout import EffectClass, Layout, layout, seams
from slipbench.plant.signals import Outputs

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
RENAMED_OUTPUTS = {"spark_applied": "spark"}
ADVANCE = "f8[::1](f8[::1],f8[:,::1],f8[::1],f8[::1],f8,i8,i8,i8,f8[::1],i8[::1],f8[:,:])"
EVALUATE = "f8[::1](f8[::1],f8[::1],f8[::1],f8[::1],f8)"


SERVO = EQUATIONS[: EQUATIONS.index(air_delay)]
"""The equations of the throttle servo, which nothing behind it acts upon."""


@made_once
def compose(
    effects: tuple[EffectClass, ...], equations: tuple[Callable[..., Any], ...] = EQUATIONS
) -> ModuleType:
    """The compiled kernel: a module with `advance` and `evaluate`.

    equations: the first of `EQUATIONS`; states whose rates come later stand still.
    """
    return load(kernel_text(effects, equations))


def kernel_text(
    effects: tuple[EffectClass, ...], equations: tuple[Callable[..., Any], ...] = EQUATIONS
) -> str:
    """The whole text of the kernel for these effects, nominal equations first."""
    parts = [motion_text(effects, equations), inlined(text_of(kernel.proceed))]
    parts += [entry(text_of(kernel.advance), ADVANCE), entry(text_of(kernel.evaluate), EVALUATE)]
    return "\n\n".join(parts)


def motion_text(
    effects: tuple[EffectClass, ...], equations: tuple[Callable[..., Any], ...] = EQUATIONS
) -> str:
    """The text of the functions that `kernel.proceed` and `kernel.evaluate` call."""
    order = layout(effects)
    parts = [constants(order)]
    parts += [inlined(text_of(equation, f"nominal__{equation.__name__}")) for equation in equations]
    for effect in effects:
        parts += [inlined(text_of(f)) for f in effect.helpers]
        hooks = (h for h in effect.hooks if h.seam in {e.__name__ for e in equations})
        parts += [inlined(text_of(h.function, hook_name(effect, h))) for h in hooks]
    parts.append(inlined(rates_text(order, equations)))
    parts += [
        inlined(text_of(f)) for f in (kernel.held_value, kernel.transmission, kernel.off_the_stop)
    ]
    parts += [inlined(text) for text in tuple_texts(order)]
    return "\n\n".join(parts)


def constants(order: Layout) -> str:
    """The text of the numbers that the functions of kernel.py name."""
    names = ("HEADER", "RINGS", "THROTTLE_COMMAND", "SPARK", "GEAR", "CLUTCH", "BAD_GEAR")
    outputs = len(Outputs.names) + len(order.effect_states)
    lines = [f"{name} = {getattr(kernel, name)}" for name in names]
    return "\n".join((*lines, f"OUTPUTS = {outputs}")) + "\n"


def rates_text(order: Layout, equations: Sequence[Callable[..., Any]]) -> str:
    """The text of `rates`: every equation, each followed by the effects at its seam."""
    known = Names(order)
    signature = "x, u, led, throttle_command, spark, p, step, count, stage, history, history_rate"
    lines = [f"def rates({signature}):"]
    lines += [f"    {name} = x[{i}]" for i, name in enumerate(RATES)]
    lines += [f"    {name} = u[{i}]" for i, name in enumerate(HELD)]
    lines += ["    time = (count + stage) * step"]
    lines += [f"    dx{i} = 0.0" for i in range(len(RATES), len(order.states))]
    for equation in equations:
        seam = equation.__name__
        gives = GIVES_SEVERAL.get(seam, (seam,))
        lines.append(f"    {', '.join(gives)} = nominal__{seam}({known.arguments(equation, None)})")
        known.add(gives)
        lines += _seam_lines(known, order.effects, seam, gives)
    rates = [
        *_led({s: r if known.has(r) else "0.0" for s, r in RATES.items()}),
        *(f"dx{i}" for i in range(len(RATES), len(order.states))),
    ]
    named = [RENAMED_OUTPUTS.get(name, name) for name in Outputs.names]
    outputs = [name if known.has(name) else "0.0" for name in named]
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


def _seam_lines(
    known: "Names", effects: tuple[EffectClass, ...], seam: str, gives: tuple[str, ...]
) -> Iterator[str]:
    """Yield the effects at a seam, behind one switch for the seam and one for each effect."""
    if seam not in seams(effects):
        return
    yield f"    if p[{known.place(f'acting.{seam}')}] > 0.5:"
    for effect in effects:
        for hook in (h for h in effect.hooks if h.seam == seam):
            yield f"        if p[{known.place(f'{effect.name}.present')}] > 0.5:"
            targets = [*gives, *(f"dx{known.state(effect, state)}" for state in hook.governs)]
            call = f"{hook_name(effect, hook)}({known.arguments(hook.function, effect)})"
            yield f"            {', '.join(targets)} = {call}"


def hook_name(effect: EffectClass, hook: Hook) -> str:
    """The name of a hook's function in the kernel."""
    return f"{effect.name}__{hook.function.__name__}"


class Names:
    """What each argument name means at this point of the kernel."""

    def __init__(self, order: Layout) -> None:
        self._parameters = {name: i for i, name in enumerate(order.parameters)}
        self._states = {name: i for i, name in enumerate(order.states)}
        self._known = {*RATES, *HELD, *ARGUMENTS}

    def add(self, names: tuple[str, ...]) -> None:
        """Count these quantities as known from here on."""
        self._known.update(names)

    def has(self, name: str) -> bool:
        """Whether a quantity is known."""
        return name in self._known

    def place(self, parameter: str) -> int:
        """The place of a parameter."""
        return self._parameters[parameter]

    def state(self, effect: EffectClass, name: str) -> int:
        """The place of an effect's state."""
        return self._states[f"{effect.name}.{name}"]

    def arguments(self, function: Callable[..., Any], effect: EffectClass | None) -> str:
        """The text of the arguments for a call of the function."""
        return ", ".join(
            self._text(name, effect) for name in inspect.signature(function).parameters
        )

    def _text(self, name: str, effect: EffectClass | None) -> str:
        if effect and name in effect.tuples:
            return f"({', '.join(self._text(each, effect) for each in effect.tuples[name])},)"
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
