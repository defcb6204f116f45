"""An effect is physics beyond the nominal equations: it acts at a seam and can be absent.

A hook is a plain function of floats. Its arguments are found by name: the effect's own parameters
and states first, then every quantity of the nominal equations that is known at the seam, the
inputs, `time`, `step`, and nominal parameters as `<block>_<field>`. It returns the new values of
the seam's quantities, followed by the rates of those of the effect's states that it governs. It
may use `math` and nothing else, because its text is compiled into the kernel.

What a sensor reports lies outside the kernel: such an effect has no hooks, but a method that
`plant/sensing.py` (channels and clocks) or `plant/encoder.py` (teeth) looks for.
"""

import inspect
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Self

from slipbench.plant.parameters import Block

SECTIONS = ("Equation", "Symbols", "Trace", "Confused with", "Reference")


@dataclass(frozen=True)
class Hook:
    """A function at a seam. governs: the states of the effect whose rates it returns last."""

    seam: str
    function: Callable[..., Any]
    governs: tuple[str, ...] = ()


@dataclass(frozen=True)
class Effect(Block):
    """Base of all effects.

    name: its word in vehicle files; block: the part where it lives; shows_in: the channels of a
    trial that carry its trace, the plainest first; confused_with: names of effects that leave a
    like trace.
    states: what it remembers, each governed by one hook; starts: for each of them a number near
    which its steady value is sought, or the nominal state from which it starts if any value is
    steady.
    helpers: functions that its hooks call. tuples: arguments of its hooks that are several
    quantities at once, and which.
    periodic: whether it goes with the angle of crank or wheel, so that steady means on average.
    unseen_turn: whether that angle is the crank's, of which recordings determine only the speed.
    """

    name: ClassVar[str]
    block: ClassVar[str]
    shows_in: ClassVar[tuple[str, ...]]
    confused_with: ClassVar[tuple[str, ...]]
    states: ClassVar[tuple[str, ...]] = ()
    hooks: ClassVar[tuple[Hook, ...]] = ()
    starts: ClassVar[tuple[float | str, ...]] = ()
    periodic: ClassVar[bool] = False
    unseen_turn: ClassVar[bool] = False
    helpers: ClassVar[tuple[Callable[..., Any], ...]] = ()
    tuples: ClassVar[Mapping[str, tuple[str, ...]]] = {}

    @property
    def subject(self) -> str:
        """The channel, clock or wheel that it acts on; empty where there is no choice."""
        return "/".join(getattr(self, name) for name in self.words())

    @property
    def key(self) -> str:
        """Identity among the effects of a motorcycle: its name and subject."""
        return f"{self.name}.{self.subject}" if self.subject else self.name

    @classmethod
    def candidates(cls) -> tuple[Self, ...]:
        """The effect at its typical size, once for every subject that may have it."""
        return (cls(),)

    def smallest(self) -> Self:
        """Return it at the least size of interest, in proportion to the sizes that it has now."""
        sizes = {
            p.name: getattr(self, p.name) * p.smallest / p.typical
            for p in self.parameters()
            if p.smallest is not None
        }
        return replace(self, **sizes)

    def silent(self) -> Self:
        """Return it at the size at which it vanishes, its shape kept."""
        return replace(self, **{p.name: p.absent for p in self.parameters() if p.sized})

    @classmethod
    def absent(cls) -> Self:
        """The effect at the size at which it vanishes, on its first subject."""
        return cls(**{p.name: p.absent for p in cls.parameters()})

    @classmethod
    def page(cls) -> Mapping[str, str]:
        """The sections of the effect's page by heading; 'Physics' is the opening."""
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
