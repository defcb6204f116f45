"""The equations' derivatives and a set of effects become the text of one kernel with tangents.

Each equation, and each effect at its seam, gives to the row of its result: the partial derivative
to every argument times that argument's row. A parameter's own row is one at its column and zero
in the others, so that it costs one addition.
"""

import ast
from collections.abc import Iterator
from types import ModuleType

from slipbench.plant import equations as nominal
from slipbench.plant import kernel, kernel_tangents
from slipbench.plant.arriving_slopes import arriving_slopes
from slipbench.plant.compiled import entry, inlined, load, made_once, plain, text_of
from slipbench.plant.composition import ADVANCE, RENAMED_OUTPUTS, Names, constants
from slipbench.plant.derivatives import directional, gradient
from slipbench.plant.equations import RATES
from slipbench.plant.kernel_parts import HELD
from slipbench.plant.layout import EffectClass, layout, seams
from slipbench.plant.signals import Inputs, Outputs
from slipbench.plant.tangent_rows import COPIED, Call, Equations, Node, Rows, Source

MORE = "f8[:,::1],i8[::1],f8[:,:,::1],i8[::1],i8[::1],i8[::1],i8[::1],b1[:,::1],i8[::1],f8[:,:,::1]"
SIGNATURE = f"f8({ADVANCE.removeprefix('f8[::1](').removesuffix(')')},{MORE})"
HISTORY = {
    nominal.arriving: (
        arriving_slopes,
        ("throttle", "air_delay"),
        ("past[i * n + c]", "past_rate[i * n + c]", "past[j * n + c]", "past_rate[j * n + c]"),
    )
}
"""Equations that look into the history: their derivatives, to which arguments, and to which rows
of the history, at the places i and j."""
ARGUMENTS = (
    "w, n, x, u, throttle_command, spark, p, step, count, stage, history, history_rate, "
    "past, past_rate, columns, gear_column, driven, wanted, k, y"
)


@made_once
def compose_tangents(effects: tuple[EffectClass, ...], equations: Equations) -> ModuleType:
    """The compiled kernel with tangents: a module with `advance_tangents`."""
    return load(tangents_text(effects, equations))


def tangents_text(effects: tuple[EffectClass, ...], equations: Equations) -> str:
    """The whole text of the kernel with tangents."""
    rows = Rows(layout(effects), equations)
    writer = _Writer(rows)
    rates = writer.rates()
    held = gradient(kernel.held_value, "held_slopes", ["delay_steps"])
    stop = gradient(kernel.off_the_stop, "stop_slopes", ["position", "rate", "push"])
    parts = [constants(rows.order), rows.constants()]
    parts += [inlined(text_of(f), only) for f, only in kernel_tangents.SMALL.items()]
    parts += [inlined(text, writer.signatures.get(n, "")) for n, text in writer.functions.items()]
    parts += [plain(rates), inlined(held.text), inlined(stop.text), inlined(_read_row())]
    parts.append(inlined(text_of(kernel.transmission)))
    parts += [plain(text_of(function)) for function in kernel_tangents.PARTS]
    parts.append(entry(text_of(kernel_tangents.advance_tangents), SIGNATURE))
    return "\n\n".join(parts)


def _read_row() -> str:
    given = {"gear_ratio": "ratio", "clutch": "clutch"}
    values = (given.get(name) or f"row[{Inputs.names.index(name)}]" for name in HELD)
    lines = (f"    u[{i}] = {value}" for i, value in enumerate(values))
    return "\n".join(("def read_row(u, row, ratio, clutch):", *lines))


class _Writer:
    """Writes `rates_tangents`.

    functions: texts of all derivatives that it calls, by name; signatures: of some of them.
    """

    def __init__(self, rows: Rows) -> None:
        self.rows = rows
        self.names = Names(rows.order)
        self.functions: dict[str, str] = {}
        self.signatures: dict[str, str] = {}

    def rates(self) -> str:
        """The text of `rates_tangents`: every equation, each followed by the effects at its seam."""
        states, equations = self.rows.order.states, self.rows.equations
        lines = [f"{name} = x[{i}]" for i, name in enumerate(RATES)]
        lines += [f"{name} = u[{i}]" for i, name in enumerate(HELD)]
        lines.append("time = (count + stage) * step")
        lines += [f"dx{i} = 0.0" for i in range(len(RATES), len(states))]
        lines += [self._node(node, number) for number, node in enumerate(self.rows.nodes)]
        for copied, source in COPIED.items():
            row, from_row = (list(states).index(name) for name in (copied, source))
            copy = self._rows([self.rows.rate(row)], [[("1.0", ("state", from_row))]])[0]
            lines.append(f"if wanted[{len(equations)}]: {copy}")
        for i, rate in enumerate(RATES.values()):
            lines.append(f"k[{i}] = {rate if self.names.has(rate) else '0.0'}")
        lines += [f"k[{i}] = dx{i}" for i in range(len(RATES), len(states))]
        named = [RENAMED_OUTPUTS.get(name, name) for name in Outputs.names]
        values = [name if self.names.has(name) else "0.0" for name in named]
        values += [f"x[{i}]" for i in range(len(RATES), len(states))]
        lines += [f"y[{i}] = {value}" for i, value in enumerate(values)]
        return "\n".join([f"def rates_tangents({ARGUMENTS}):", *(f"    {line}" for line in lines)])

    def _node(self, node: Node, number: int) -> str:
        """A call of the function of a node, which is written first.

        One function for all nodes would take the compiler minutes.
        """
        governed = [
            f"dx{self.names.state(call.effect, state)}"
            for call in node.calls
            if call.effect
            for state in call.governs
        ]
        lines = [f"{dx} = 0.0" for dx in governed]
        lines += self._node_lines(node, number)
        results = ", ".join([*node.gives, *governed])
        arguments = ", ".join(["w", "n", *_free_names(lines)])
        name = f"node__{node.name}"
        body = "\n".join(f"    {line}" for line in [*lines, f"return {results}"])
        self.functions[name] = f"def {name}({arguments}):\n{body}"
        return f"{results} = {name}({arguments})"

    def _node_lines(self, node: Node, number: int) -> Iterator[str]:
        equation, *hooks = node.calls
        if equation.function in HISTORY:
            yield from self._from_history(node, number, equation)
        else:
            yield from self._call(number, equation, list(node.gives))
        self.names.add(node.gives)
        if node.name not in seams(self.rows.order.effects):
            return
        yield f"if p[{self.names.place(f'acting.{node.name}')}] > 0.5:"
        for call in hooks:
            assert call.effect is not None
            yield f"    if p[{self.names.place(f'{call.effect.name}.present')}] > 0.5:"
            states = (self.names.state(call.effect, state) for state in call.governs)
            targets = [*node.gives, *(f"dx{i}" for i in states)]
            write = self._along if call.effect.tuples else self._call
            yield from (f"        {line}" for line in write(number, call, targets))

    def _call(self, number: int, call: Call, targets: list[str]) -> Iterator[str]:
        """Yield a call with all partial derivatives, and the rows that they make."""
        sources = {n: s[0] for n, s in self.rows.sources(call).items() if s[0]}
        made = gradient(call.function, self._name(call), list(sources))
        self.functions |= {**made.helpers, self._name(call): made.text}
        slopes = [f"g{i}" for i in range(len(made.pairs))]
        arguments = self.names.arguments(call.function, call.effect)
        yield f"{', '.join([*targets, *slopes])} = {self._name(call)}({arguments})"
        terms = [
            [(g, sources[a]) for g, (r, a) in zip(slopes, made.pairs, strict=True) if r == result]
            for result in range(made.results)
        ]
        rows = [self._row(target) for target in targets]
        yield f"if wanted[{number}]:"
        yield from (f"    {line}" for line in self._rows(rows, terms))

    def _from_history(self, node: Node, number: int, call: Call) -> Iterator[str]:
        function, moving, past = HISTORY[call.function]
        self.functions[function.__name__] = text_of(function)
        slopes = [f"g{i}" for i in range(len(moving))]
        weights = [f"h{i}" for i in range(len(past))]
        arguments = self.names.arguments(call.function, None)
        results = ", ".join([*node.gives, *slopes, "i", "j", *weights])
        yield f"{results} = {function.__name__}({arguments})"
        sources = [self.rows.source(name, None) for name in moving]
        terms = [
            f"{g} * w[{self.rows.of(s)} + c]" for g, s in zip(slopes, sources, strict=True) if s
        ]
        terms += [f"{h} * {each}" for h, each in zip(weights, past, strict=True)]
        row = self.rows.quantity(node.gives[0])
        yield f"if wanted[{number}]:"
        yield "    for c in range(n):"
        yield f"        w[{row} + c] = {' + '.join(terms)}"

    def _rows(self, rows: list[int], terms: list[list[tuple[str, Source]]]) -> list[str]:
        """Sums of rows over all columns first, then inputs, then parameters."""
        numbers, shape, more = [str(row) for row in rows], list[int](), list[str]()
        for row, parts in zip(rows, terms, strict=True):
            length = 0
            for slope, source in parts:
                kind, which = source
                if kind == "parameter":
                    more.append(f"add_one(w, {row} + columns[{which}], {slope})")
                elif kind == "gear":
                    more.append(f"add_one(w, {row} + gear_column, {slope})")
                elif kind == "input":
                    of = self.rows.of(source)
                    more.append(f"if driven[{which}]: add_row(w, n, {row}, {slope}, {of})")
                else:
                    length += 1
                    numbers += [slope, str(self.rows.of(source))]
            shape.append(length)
        name = f"sums_{'_'.join(map(str, shape))}"
        self.functions.setdefault(name, _sums(name, shape))
        self.signatures[name] = f"void(f8[::1],i8{',i8' * len(shape)}{',f8,i8' * sum(shape)})"
        return [f"{name}(w, n, {', '.join(numbers)})", *more]

    def _along(self, number: int, call: Call, targets: list[str]) -> Iterator[str]:
        """Yield a call whose arguments are tuples: its derivative in the direction of each column."""
        sources = {n: s for n, s in self.rows.sources(call).items() if any(s)}
        made = directional(call.function, self._name(call), list(sources))
        assert call.effect is not None
        helpers = {f.__name__: text_of(f) for f in call.effect.helpers}
        self.functions |= {**helpers, **made.helpers, self._name(call): made.text}
        arguments = self.names.arguments(call.function, call.effect)
        tangents = (self._tangent(n, call, s) for n, s in sources.items())
        slopes = [f"w[{self._row(targets[r])} + c]" for r, _ in made.pairs]
        results = ", ".join([*(f"v{i}" for i in range(made.results)), *slopes])
        line = f"{results} = {self._name(call)}({arguments}, {', '.join(tangents)})"
        yield f"if wanted[{number}]:"
        yield "    for c in range(n):"
        yield f"        {line}"
        zeros = ", ".join(
            "0.0" if len(s) == 1 else f"({'0.0, ' * len(s)})" for s in sources.values()
        )
        results = ", ".join([*targets, *(f"g{i}" for i in range(len(made.pairs)))])
        yield f"{results} = {self._name(call)}({arguments}, {zeros})"

    def _tangent(self, name: str, call: Call, sources: list[Source | None]) -> str:
        """The text of an argument's tangent at column c."""
        texts = [self._at_column(source) for source in sources]
        several = call.effect is not None and name in call.effect.tuples
        return f"({', '.join(texts)},)" if several else texts[0]

    def _at_column(self, source: Source | None) -> str:
        if source is None:
            return "0.0"
        if source[0] == "parameter":
            return f"(1.0 if columns[{source[1]}] == c else 0.0)"
        if source[0] == "gear":
            return "(1.0 if gear_column == c else 0.0)"
        return f"w[{self.rows.of(source)} + c]"

    def _row(self, target: str) -> int:
        """Row of what a call gives: a quantity, or 'dx<number>' of an effect's state."""
        number = target.removeprefix("dx")
        return self.rows.rate(int(number)) if number.isdigit() else self.rows.quantity(target)

    def _name(self, call: Call) -> str:
        """Name of a derivative: hooks that several effects share have one."""
        page = call.function.__module__.rpartition(".")[2]
        return f"{page}__{call.function.__name__}__slopes"


def _sums(name: str, shape: list[int]) -> str:
    """The text of a function that writes rows, each the sum of other rows times their slopes."""
    arguments = [f"d{r}" for r in range(len(shape))]
    sums = []
    for r, length in enumerate(shape):
        pairs = [(f"g{r}_{i}", f"s{r}_{i}") for i in range(length)]
        arguments += [name for pair in pairs for name in pair]
        sums.append(" + ".join(f"{g} * w[{s} + c]" for g, s in pairs) or "0.0")
    lines = [f"        r{r} = {text}" for r, text in enumerate(sums)]
    lines += [f"        w[d{r} + c] = r{r}" for r in range(len(shape))]
    head = f"def {name}(w, n, {', '.join(arguments)}):"
    return "\n".join([head, "    for c in range(n):", *lines])


def _free_names(lines: list[str]) -> list[str]:
    """Names that lines use and do not assign, without functions."""
    tree = ast.parse("\n".join(lines))
    names = [node for node in ast.walk(tree) if isinstance(node, ast.Name)]
    assigned = {name.id for name in names if isinstance(name.ctx, ast.Store)}
    called = {ast.unparse(n.func) for n in ast.walk(tree) if isinstance(n, ast.Call)}
    return sorted({name.id for name in names} - assigned - called - {"w", "n"})
