"""Nodes of the motorcycle's bus, and which of them are simulated (restbus simulation)."""

import difflib
from collections.abc import Mapping

from slipbench.protocol.codec.codec import Codec
from slipbench.protocol.errors import InputError

MESSAGES_OF: Mapping[str, tuple[str, ...]] = {
    "ecu": ("EcuStatus", "EngineStatus", "ChassisStatus", "Temperatures"),
    "throttle": ("ThrottleStatus",),
    "rear_encoder": ("RearTeeth", "RearEncoderStatus", "RearWheelSpeed"),
    "front_encoder": ("FrontTeeth", "FrontEncoderStatus", "FrontWheelSpeed"),
    "optical": ("OpticalSpeed",),
    "rider": ("RiderControls",),
}
ALL_NODES = frozenset(MESSAGES_OF)
NODE_OF = {message: node for node, messages in MESSAGES_OF.items() for message in messages}
GROUPS = {"encoders": frozenset({"rear_encoder", "front_encoder"})}


def simulated_nodes(only: str = "", without: str = "") -> frozenset[str]:
    """Nodes that are simulated; the others are real devices.

    only, without: names of nodes or groups, separated by commas; empty: all nodes are simulated.
    Raises InputError for an unknown name, for both at once, and where no node is left to simulate.
    """
    if only and without:
        raise InputError(
            "--only and --without are given together",
            expected="one of them",
            found=f"--only {only} --without {without}",
            remedy="name the simulated nodes with --only, or the real devices with --without",
        )
    simulated = _nodes("--only", only) if only else ALL_NODES - _nodes("--without", without)
    if not simulated:
        raise InputError(
            "no node is left to simulate",
            where="--without",
            expected="at least one node that is simulated",
            found=without,
            remedy="leave a node out of --without",
        )
    return simulated


def _nodes(option: str, names: str) -> frozenset[str]:
    """Nodes of a list of names, separated by commas."""
    written = [name.strip() for name in names.split(",")] if names else []
    return frozenset(node for name in written for node in _node(option, name))


def _node(option: str, name: str) -> frozenset[str]:
    if name in GROUPS:
        return GROUPS[name]
    if name in ALL_NODES:
        return frozenset({name})
    known = [*MESSAGES_OF, *GROUPS]
    near = difflib.get_close_matches(name, known, n=1, cutoff=0.4)
    raise InputError(
        "no such node",
        where=option,
        expected=", ".join(known),
        found=repr(name),
        remedy=f"did you mean {near[0]}?" if near else "use one of these names",
    )


def carriers(codec: Codec, simulated: frozenset[str]) -> dict[str, str]:
    """Node that sends each message of the database.

    Raises InputError where a message holds signals of simulated nodes and of real devices.
    """
    found = {}
    for carrier, plan in codec.plans.items():
        nodes = [NODE_OF[part.name] for part in plan.parts if part.name in NODE_OF]
        if len({node in simulated for node in nodes}) > 1:
            raise InputError(
                f"message {carrier} holds signals of simulated nodes and of real devices",
                expected="one sender for each message",
                found=", ".join(dict.fromkeys(nodes)),
                remedy="name all of these nodes in --without, or none of them",
            )
        if nodes:
            found[carrier] = nodes[0]
    return found
