"""Read bags of ROS 1 (.bag) and ROS 2 (SQLite, .db3) through rosbags, each topic with its own times."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from slipbench.protocol.errors import InputError
from slipbench.protocol.extras import optional_library
from slipbench.protocol.tables.table import Table
from slipbench.protocol.tables.topics import About, Topics
from slipbench.protocol.user_file import open_user_file


def read_ros1_bag(path: Path) -> Table:
    """Table of the numbers of every message of a ROS 1 bag. Raises InputError."""
    return _read(path, ".bag", "ROS 1 bag")


def read_ros2_bag(path: Path) -> Table:
    """Table of the numbers of every message of a ROS 2 bag in SQLite. Raises InputError."""
    return _read(path, ".db3", "ROS 2 bag")


def _read(path: Path, suffix: str, form: str) -> Table:
    open_user_file(path).close()
    topics = Topics(str(path))
    warnings: list[str] = []
    try:
        with _opened(path, suffix) as bag:
            _add_all(bag, topics)
    except InputError:
        raise
    except Exception as cause:  # rosbags passes on any exception of its parsing
        damage = f"{type(cause).__name__}: {cause}"[:200]
        if not topics.count:
            raise InputError(
                f"not a {form} that can be read",
                where=str(path),
                expected="a whole bag with its index",
                found=damage,
                remedy='close the recording, or repair it: "rosbag reindex", "ros2 bag reindex"',
            ) from cause
        warnings.append(
            f"{path}: damaged or broken off: {damage}; {topics.count} messages before it are read"
        )
    return topics.table(form, warnings)


@contextmanager
def _opened(path: Path, suffix: str) -> Iterator[Any]:
    """The bag, under a name with the suffix by which rosbags knows the format."""
    highlevel = optional_library("rosbags.highlevel")
    typesys = optional_library("rosbags.typesys")

    with TemporaryDirectory() as folder:
        link = Path(folder) / f"bag{suffix}"
        link.symlink_to(path.resolve())
        types = typesys.get_typestore(typesys.Stores.ROS2_HUMBLE)  # of bags without definitions
        with highlevel.AnyReader([link], default_typestore=types) as bag:
            yield bag


def _add_all(bag: Any, topics: Topics) -> None:
    for connection, time, data in bag.messages():
        try:
            message = bag.deserialize(data, connection.msgtype)
        except Exception as cause:  # whatever a damaged or unknown message makes
            topics.skip(connection.topic, f"cannot be decoded ({type(cause).__name__})")
            continue
        topics.add(connection.topic, time, message, About(connection.msgtype))
