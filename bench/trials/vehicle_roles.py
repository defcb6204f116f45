"""The role map of a trial: that of the bench's database, with the radii of the trial's vehicle."""

from pathlib import Path

import tomli_w

from slipbench.bench.safety.vehicle_monitor import Wheels
from slipbench.protocol.configuration import load_toml


def roles_text(path: Path, wheels: Wheels) -> str:
    """Text of the role map at `path`, with the geometry of `wheels`."""
    roles = load_toml(path)
    roles.pop("database", None)  # the recording has a copy of it
    roles["vehicle"] = {
        **roles.get("vehicle", {}),
        "rear_radius": wheels.rear_radius,
        "front_radius": wheels.front_radius,
        "teeth_per_turn": wheels.teeth,
    }
    return tomli_w.dumps(roles)
