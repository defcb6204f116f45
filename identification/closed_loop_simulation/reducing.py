"""A controller that may only reduce torque: its upper limit is the rider's command."""

from typing import Any

from slipbench.controllers.slip_controller import SlipController, from_tree
from slipbench.protocol.controller_file import ControllerFile


def reducing_only(file: ControllerFile) -> SlipController:
    """Controller that may only close the throttle and retard the spark."""
    return from_tree(reducing_tree(file))


def reducing_tree(file: ControllerFile) -> dict[str, Any]:
    """Numbers of that controller, as in a controller file; without a governor."""
    tree = file.model_dump()
    tree["limits"]["high"] = 0.0
    if tree.get("mixed"):
        tree["mixed"]["throttle"]["high"] = 0.0
    tree["governor"] = None
    return tree
