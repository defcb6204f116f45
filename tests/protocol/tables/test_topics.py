"""Laws: MCAP and bags of ROS give the numbers that were written, at their times; damage is said."""

import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from slipbench.protocol.errors import InputError
from slipbench.protocol.recording.role_map import TableRules
from slipbench.protocol.tables import is_table, read_table, samples

mcap_writer = pytest.importorskip("mcap.writer", reason="pip install 'slipbench[logs]'")
rosbag1 = pytest.importorskip("rosbags.rosbag1", reason="pip install 'slipbench[logs]'")
rosbag2 = pytest.importorskip("rosbags.rosbag2", reason="pip install 'slipbench[logs]'")
typesys = pytest.importorskip("rosbags.typesys")

ANY = TableRules()
START_NS = 1_700_000_000 * 10**9
ROS1 = typesys.get_typestore(typesys.Stores.ROS1_NOETIC)
ROS2 = typesys.get_typestore(typesys.Stores.ROS2_HUMBLE)
IMU = "sensor_msgs/msg/Imu"
finite = st.floats(-1e6, 1e6)
rows_of = st.lists(st.tuples(finite, finite, finite), min_size=1, max_size=12)


def write_mcap(path, rows, compression="zstd"):
    """Messages in JSON: nested values and arrays; every second lacks one; log times of 10 ms."""
    kinds = {"zstd": mcap_writer.CompressionType.ZSTD, "lz4": mcap_writer.CompressionType.LZ4}
    with path.open("wb") as file:
        writer = mcap_writer.Writer(
            file,
            chunk_size=200,
            compression=kinds.get(compression, mcap_writer.CompressionType.NONE),
        )
        writer.start()
        units = {"v": {"type": "number", "description": "km/h"}, "w": {"description": "a word"}}
        text = json.dumps({"type": "object", "properties": {"a": {"properties": units}}})
        schema = writer.register_schema("x", "jsonschema", text.encode())
        channel = writer.register_channel("/car/state", "json", schema)
        for n, (v, w, x) in enumerate(rows):
            message = {"a": {"v": v, "name": "text"}, "list": [w, [x]], "none": None}
            if n % 2:
                del message["a"]["v"]
            data = json.dumps(message).encode()
            writer.add_message(channel, START_NS + n * 10_000_000, data, START_NS, n)
        writer.finish()


@given(rows_of, st.sampled_from(["zstd", "lz4", "none"]))
@settings(max_examples=50, deadline=None)
def test_json_in_mcap_is_what_was_written(tmp_path_factory, rows, compression):
    path = tmp_path_factory.mktemp("mcap") / "x.mcap"
    write_mcap(path, rows, compression)
    table = read_table(path)
    time = START_NS / 1e9 + 0.01 * np.arange(len(rows))
    for name, position in (("car/state.list[0]", 1), ("car/state.list[1][0]", 2)):
        found = samples(table, name, "", ANY)
        assert found.value.tolist() == [row[position] for row in rows]
        assert found.time == pytest.approx(time, abs=1e-6)
    found = samples(table, "car/state.a.v", "", ANY)
    assert found.value.tolist() == [row[0] for row in rows[::2]]
    assert found.unit == "km/h"
    assert not table.warnings


def imu(store, n, row, *, stamped=True):
    """Message of n x 0.1 s, whose stamp is 0.02 s before it was logged."""
    types = store.types
    time = types["builtin_interfaces/msg/Time"]
    stamp = START_NS + n * 100_000_000 - 20_000_000 if stamped else 0
    header = {"stamp": time(sec=stamp // 10**9, nanosec=stamp % 10**9), "frame_id": "imu"}
    if "seq" in types["std_msgs/msg/Header"].__dataclass_fields__:
        header["seq"] = n
    vector, nine = types["geometry_msgs/msg/Vector3"], np.zeros(9)
    return types[IMU](
        header=types["std_msgs/msg/Header"](**header),
        orientation=types["geometry_msgs/msg/Quaternion"](x=0.0, y=0.0, z=0.0, w=1.0),
        orientation_covariance=nine,
        angular_velocity=vector(x=row[0], y=0.0, z=row[1]),
        angular_velocity_covariance=nine,
        linear_acceleration=vector(x=row[2], y=0.0, z=9.8),
        linear_acceleration_covariance=nine,
    )


def image(store):
    """A camera's message: its data are more than are expanded to channels."""
    types = store.types
    stamp = types["builtin_interfaces/msg/Time"](sec=1, nanosec=0)
    header = {"stamp": stamp, "frame_id": ""}
    if "seq" in types["std_msgs/msg/Header"].__dataclass_fields__:
        header["seq"] = 0
    return types["sensor_msgs/msg/Image"](
        header=types["std_msgs/msg/Header"](**header),
        height=10, width=10, encoding="mono8", is_bigendian=0, step=10,
        data=np.zeros(100, np.uint8),
    )  # fmt: skip


def write_ros1(folder, rows, *, stamped=True):
    path = folder / "x.bag"
    with rosbag1.Writer(path) as writer:
        one = writer.add_connection("/imu", IMU, typestore=ROS1)
        two = writer.add_connection("/camera", "sensor_msgs/msg/Image", typestore=ROS1)
        for n, row in enumerate(rows):
            data = ROS1.serialize_ros1(imu(ROS1, n, row, stamped=stamped), IMU)
            writer.write(one, START_NS + n * 100_000_000, data)
        data = ROS1.serialize_ros1(image(ROS1), "sensor_msgs/msg/Image")
        writer.write(two, START_NS, data)
    return path


def write_ros2(folder, rows, plugin, *, stamped=True):
    bag = folder / "bag"
    with rosbag2.Writer(bag, version=9, storage_plugin=plugin) as writer:
        one = writer.add_connection("/imu", IMU, typestore=ROS2)
        two = writer.add_connection("/camera", "sensor_msgs/msg/Image", typestore=ROS2)
        for n, row in enumerate(rows):
            data = ROS2.serialize_cdr(imu(ROS2, n, row, stamped=stamped), IMU)
            writer.write(one, START_NS + n * 100_000_000, data)
        data = ROS2.serialize_cdr(image(ROS2), "sensor_msgs/msg/Image")
        writer.write(two, START_NS, data)
    return next(path for path in bag.iterdir() if path.suffix in (".db3", ".mcap"))


def write(folder, kind, rows, *, stamped=True):
    if kind == "ros1":
        return write_ros1(folder, rows, stamped=stamped)
    plugin = rosbag2.StoragePlugin.MCAP if kind == "mcap" else rosbag2.StoragePlugin.SQLITE3
    return write_ros2(folder, rows, plugin, stamped=stamped)


KINDS = ["ros1", "sqlite", "mcap"]


@given(st.sampled_from(KINDS), rows_of, st.booleans())
@settings(max_examples=40, deadline=None)
def test_messages_of_ros_are_what_was_written(tmp_path_factory, kind, rows, stamped):
    """Times of the stamps where they are set, else of logging; units of the message's definition."""
    path = write(tmp_path_factory.mktemp("ros"), kind, rows, stamped=stamped)
    table = read_table(path)
    first = START_NS / 1e9 - (0.02 if stamped else 0.0)
    for name, unit, position in (
        ("imu.angular_velocity.x", "rad/s", 0),
        ("imu.angular_velocity.z", "rad/s", 1),
        ("imu.linear_acceleration.x", "m/s^2", 2),
    ):
        found = samples(table, name, "", ANY)
        assert found.value.tolist() == [row[position] for row in rows]
        assert found.time == pytest.approx(first + 0.1 * np.arange(len(rows)), abs=1e-6)
        assert found.unit == unit
    assert any("/imu: times of header.stamp" in line for line in table.layout) == stamped
    assert any("/camera: data: array of more than 64 elements" in each for each in table.warnings)


@pytest.mark.parametrize("kind", KINDS)
def test_the_format_is_known_by_its_content(tmp_path, kind):
    path = write(tmp_path, kind, [(1.0, 2.0, 3.0)])
    renamed = path.rename(tmp_path / "log.001")
    assert is_table(renamed)
    assert samples(read_table(renamed), "imu.angular_velocity.x", "", ANY).value.tolist() == [1.0]


def test_an_mcap_file_that_breaks_off_is_read_up_to_there_and_said(tmp_path):
    path = tmp_path / "x.mcap"
    rows = [(float(n), 2.0 * n, 3.0 * n) for n in range(40)]
    write_mcap(path, rows)
    whole = path.read_bytes()
    read = []
    for length in range(20, len(whole) - 1, 97):
        path.write_bytes(whole[:length])
        try:
            table = read_table(path)
        except InputError as cause:
            assert "no message with numbers" in cause.what  # noqa: PT017
            continue
        found = samples(table, "car/state.list[0]", "", ANY).value
        assert found.tolist() == [row[1] for row in rows[: found.size]]
        assert table.warnings or found.size == len(rows)
        read.append(found.size)
    assert read == sorted(read)
    assert len(set(read)) > 3


@pytest.mark.parametrize("kind", ["json", *KINDS])
def test_damage_is_an_error_or_is_read(tmp_path, kind):
    """Ten bytes anywhere are changed; nothing but an InputError comes out."""
    if kind == "json":
        path = tmp_path / "x.mcap"
        write_mcap(path, [(1.0, 2.0, 3.0)] * 20)
    else:
        path = write(tmp_path, kind, [(1.0, 2.0, 3.0)] * 10)
    whole = path.read_bytes()
    random = np.random.default_rng(20261125)
    for at in np.linspace(0, len(whole) - 10, 40).astype(int):
        damaged = bytearray(whole)
        damaged[at : at + 10] = random.bytes(10)
        path.write_bytes(bytes(damaged))
        try:
            table = read_table(path)
            for name in table.names:
                samples(table, name, "", ANY)
        except InputError:
            continue


@pytest.mark.parametrize("compression", ["ZSTD", "LZ4"])
def test_a_chunk_that_unpacks_to_too_much_is_refused(tmp_path, monkeypatch, compression):
    """A small file can unpack to any size; the limit is lowered here to keep the test small."""
    monkeypatch.setattr("slipbench.protocol.tables.mcap_file.LARGEST_CHUNK", 1 << 20)
    path = tmp_path / "x.mcap"
    with path.open("wb") as file:
        kind = getattr(mcap_writer.CompressionType, compression)
        writer = mcap_writer.Writer(file, compression=kind, chunk_size=1 << 24)
        writer.start()
        channel = writer.register_channel("/a", "json", 0)
        writer.add_message(channel, START_NS, b'{"v": 1}' + b" " * (1 << 22), START_NS)
        writer.finish()
    assert path.stat().st_size < 40_000
    with pytest.raises(InputError, match="unpacks to more"):
        read_table(path)
    monkeypatch.undo()
    assert samples(read_table(path), "a.v", "", ANY).value.tolist() == [1]


def test_other_encodings_are_counted(tmp_path):
    path = tmp_path / "x.mcap"
    write_mcap(path, [])
    with path.open("wb") as file:
        writer = mcap_writer.Writer(file)
        writer.start()
        known = writer.register_channel("/a", "json", 0)
        other = writer.register_channel("/b", "protobuf", 0)
        for n in range(3):
            writer.add_message(known, START_NS + n, b'{"v": 1}', START_NS)
            writer.add_message(other, START_NS + n, b"\x08\x01", START_NS)
        writer.add_message(known, START_NS, b"{no json", START_NS)
        writer.finish()
    table = read_table(path)
    assert any("/b: encoding 'protobuf': 3 not read" in each for each in table.warnings)
    assert any("/a: cannot be decoded" in each for each in table.warnings)
    assert samples(table, "a.v", "", ANY).value.tolist() == [1, 1, 1]


def test_another_sqlite_file_is_an_error(tmp_path):
    import sqlite3

    path = tmp_path / "x.db"
    connection = sqlite3.connect(path)
    connection.execute("create table a (b int)")
    connection.commit()
    connection.close()
    with pytest.raises(InputError, match="not a ROS 2 bag"):
        read_table(path)
