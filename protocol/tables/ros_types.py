"""Decode messages of ROS by the definitions that stand beside them, through rosbags."""

from collections.abc import Callable
from typing import Any

from slipbench.protocol.extras import optional_library

Decode = Callable[[bytes], Any]


def ros_decoder(name: str, definition_format: str, definition: str, encoding: str) -> Decode | None:
    """Function that decodes messages of one type; None for a format that is not read.

    name: of the type, "sensor_msgs/msg/Imu" or "sensor_msgs/Imu". definition_format: "ros1msg",
    "ros2msg" or "ros2idl". encoding: "cdr" or "ros1". Raises whatever rosbags raises for a
    definition that is damaged.
    """
    typesys = optional_library("rosbags.typesys")

    full = _full_name(name)
    if definition_format == "ros2idl":
        types = typesys.get_types_from_idl(definition)
    elif definition_format in ("ros1msg", "ros2msg"):
        types = typesys.get_types_from_msg(definition, full)
    else:
        return None
    store = typesys.get_typestore(typesys.Stores.EMPTY)
    store.register(types)
    if encoding == "cdr":
        return lambda data: store.deserialize_cdr(data, full)
    if encoding == "ros1":
        return lambda data: store.deserialize_ros1(data, full)
    return None


def _full_name(name: str) -> str:
    """Name of a type with its "msg", as ROS 2 has it."""
    package, slash, kind = name.partition("/")
    return name if "/" in kind or not slash else f"{package}/msg/{kind}"
