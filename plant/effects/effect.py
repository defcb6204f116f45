"""An effect is physics beyond the nominal equations: it acts at a seam and can be absent.

A hook is a plain function of floats. Its arguments are found by name: the effect's own parameters
and states first, then every quantity of the nominal equations that is known at the seam, the
inputs, `time`, `step`, and nominal parameters as `<block>_<field>`. It returns the new values of
the seam's quantities, followed by the rates of those of the effect's states that it governs. It
may use `math` and nothing else, because its text is compiled into the kernel.
"""

import inspect
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, Self

from plant.parameters import Block

SECTIONS = ("Equation", "Symbols", "Trace", "Confused with", "Reference")


@dataclass(frozen=True)
class Hook:
    """A function at a seam. governs: the states of the effect whose rates it returns last."""

    seam: str
    function: Callable[..., Any]
    governs: tuple[str, ...] = ()


@dataclass(frozen=True)
class Effect(Block):
    """Base of all effects. name: its word in vehicle files; block: the part where it lives."""

    name: ClassVar[str]
    block: ClassVar[str]
    states: ClassVar[tuple[str, ...]] = ()
    hooks: ClassVar[tuple[Hook, ...]] = ()

    @classmethod
    def absent(cls) -> Self:
        """Return the effect at the size at which it vanishes."""
        return cls(**{p.name: p.absent for p in cls.parameters()})

    @classmethod
    def page(cls) -> Mapping[str, str]:
        """Return the sections of the effect's page by heading; 'Physics' is the opening."""
        text = inspect.cleandoc(sys.modules[cls.__module__].__doc__ or "")
        title, _, rest = text.partition("\n")
        sections = {"Title": title.strip()}
        heading, lines = "Physics", list[str]()
        for line in rest.splitlines():
            if line.strip() in SECTIONS:
                sections[heading] = "\n".join(lines).strip()
                heading, lines = line.strip(), []
            elif set(line) != {"-"}:
                lines.append(line)
        sections[heading] = "\n".join(lines).strip()
        return sections
