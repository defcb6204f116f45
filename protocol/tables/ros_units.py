"""Units of the fields of ROS messages: SI, as REP 103 and the comments of the definitions state them."""

import re
from functools import lru_cache

# Type, without its package's "msg": the paths of its fields, and their unit.
_UNITS = (
    (r"sensor_msgs/Imu", r"linear_acceleration\.[xyz]", "m/s^2"),
    (r"geometry_msgs/(?:Twist|Accel).*|nav_msgs/Odometry", r"(?:.*\.)?linear\.[xyz]", "m/s"),
    (
        r"sensor_msgs/Imu|geometry_msgs/.*|nav_msgs/Odometry",
        r"(?:.*\.)?angular(?:_velocity)?\.[xyz]",
        "rad/s",
    ),
    (r"nav_msgs/Odometry|geometry_msgs/P.*", r"(?:.*\.)?position\.[xyz]", "m"),
    (r"geometry_msgs/PointStamped", r"point\.[xyz]", "m"),
    (r"sensor_msgs/NavSatFix", r"latitude|longitude", "deg"),
    (r"sensor_msgs/NavSatFix", r"altitude", "m"),
    (r"sensor_msgs/FluidPressure", r"fluid_pressure", "Pa"),
    (r"sensor_msgs/Temperature", r"temperature", "degC"),
    (r"sensor_msgs/Range", r"range|min_range|max_range", "m"),
    (r"sensor_msgs/MagneticField", r"magnetic_field\.[xyz]", "T"),
    (r"sensor_msgs/BatteryState", r"voltage", "V"),
    (r"sensor_msgs/BatteryState", r"current", "A"),
    (r"ackermann_msgs/AckermannDrive.*", r"(?:drive\.)?speed", "m/s"),
    (r"ackermann_msgs/AckermannDrive.*", r"(?:drive\.)?steering_angle", "rad"),
    (r"ackermann_msgs/AckermannDrive.*", r"(?:drive\.)?acceleration", "m/s^2"),
)


@lru_cache(maxsize=4096)
def ros_unit(kind: str, path: str) -> str:
    """Unit of a field of a ROS message of the type `kind`, "sensor_msgs/msg/Imu"; "" where unknown."""
    plain = kind.replace("/msg/", "/")
    for types, paths, unit in _UNITS:
        if re.fullmatch(types, plain) and re.fullmatch(paths, path):
            return "m/s^2" if "Accel" in plain and unit == "m/s" else unit
    return ""
