"""Where the effects of model files may act, in words, and in the example of a model file."""

from functools import cache

from slipbench.examples import MODELS
from slipbench.identification.mismatch.systems.effects.seam_effect import (
    INPUT,
    OUTPUT,
    RATE,
    SEAM,
    SeamEffect,
)
from slipbench.identification.mismatch.systems.system import ModelSystem

EXAMPLE = MODELS / "throttle_by_wire.toml"
WORDS = {INPUT: "an input", SEAM: "a seam", RATE: "the rate of a state", OUTPUT: "an output"}
NEEDS = {
    "": "",
    "along": "It needs a speed: that of the seam's `along`, or of a state that is the rate of another",
    "channel": "It uses another input, `using`",
    "angle": "It uses another input in rad, `using`",
    "turn": "It uses an angle that goes round, `using`: a state in rad, or an input of a turn or more",
    "speed": "It uses a state that is a speed, `using`",
    "into": "What runs over goes into the state of `overflows_into`",
    "position": "It uses the state whose rate is this one: the position",
    "of_position": "The quantity is in rad, m or count",
    "of_speed": "The state is a speed: the rate of another, the `along` of a seam, or by its unit",
    "of_store": "The state is neither a speed nor the integral of another",
}
"""What an effect needs besides its place, by `uses`."""


def kinds(effect: type[SeamEffect]) -> tuple[str, ...]:
    """Kinds of places where an effect may act."""
    also = (RATE,) if effect.uses == "along" and RATE not in effect.acts_on else ()
    return (*effect.acts_on, *also)


def acts_at(effect: type[SeamEffect]) -> str:
    """Say where an effect may act, and where it does in the example."""
    words = [WORDS[kind] for kind in kinds(effect)]
    listed = " or ".join([", ".join(words[:-1]), words[-1]] if words[1:] else words)
    there = dict.fromkeys(f"`{k.place.name}`" for k in _library() if k.name == effect.name)
    needs = f"{NEEDS[effect.uses]}. " if effect.uses else ""
    return f"Acts at {listed}. {needs}In the example: {', '.join(there)}."


@cache
def _library() -> tuple[type[SeamEffect], ...]:
    """Every effect at every place of the example."""
    found = ModelSystem.load(EXAMPLE).library
    return tuple(kind for kind in found if issubclass(kind, SeamEffect))
