"""Definitions of the messages that are read, for bags without them, as ROS 2 recorded in SQLite until 2023.

As far as they are read: what a message has behind is left out. Those of px4_msgs are of PX4 1.14 and later.
"""

_HEADER = """
std_msgs/Header header
"""

_TYPES = """
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
MSG: geometry_msgs/Pose
geometry_msgs/Point position
geometry_msgs/Quaternion orientation
MSG: geometry_msgs/Transform
geometry_msgs/Vector3 translation
geometry_msgs/Quaternion rotation
MSG: geometry_msgs/PoseWithCovariance
geometry_msgs/Pose pose
float64[36] covariance
MSG: geometry_msgs/TwistWithCovariance
geometry_msgs/Twist twist
float64[36] covariance
MSG: geometry_msgs/Twist
geometry_msgs/Vector3 linear
geometry_msgs/Vector3 angular
MSG: geometry_msgs/Point
float64 x
float64 y
float64 z
MSG: geometry_msgs/Vector3
float64 x
float64 y
float64 z
MSG: geometry_msgs/Quaternion
float64 x
float64 y
float64 z
float64 w
"""

_FIELDS = {
    "nav_msgs/msg/Odometry": """
string child_frame_id
geometry_msgs/PoseWithCovariance pose
geometry_msgs/TwistWithCovariance twist
""",
    "geometry_msgs/msg/PoseStamped": "geometry_msgs/Pose pose\n",
    "geometry_msgs/msg/PoseWithCovarianceStamped": "geometry_msgs/PoseWithCovariance pose\n",
    "geometry_msgs/msg/TransformStamped": """
string child_frame_id
geometry_msgs/Transform transform
""",
    "mavros_msgs/msg/PositionTarget": """
uint8 coordinate_frame
uint16 type_mask
geometry_msgs/Point position
geometry_msgs/Vector3 velocity
geometry_msgs/Vector3 acceleration_or_force
float32 yaw
float32 yaw_rate
""",
}

DEFINITIONS = {kind: _HEADER + fields + _TYPES for kind, fields in _FIELDS.items()} | {
    "px4_msgs/msg/TrajectorySetpoint": """
uint64 timestamp
float32[3] position
float32[3] velocity
float32[3] acceleration
float32[3] jerk
float32 yaw
float32 yawspeed
""",
    "px4_msgs/msg/VehicleOdometry": """
uint64 timestamp
uint64 timestamp_sample
uint8 pose_frame
float32[3] position
float32[4] q
uint8 velocity_frame
float32[3] velocity
""",
    "px4_msgs/msg/VehicleLocalPosition": """
uint64 timestamp
uint64 timestamp_sample
bool xy_valid
bool z_valid
bool v_xy_valid
bool v_z_valid
float32 x
float32 y
float32 z
float32[2] delta_xy
uint8 xy_reset_counter
float32 delta_z
uint8 z_reset_counter
float32 vx
float32 vy
float32 vz
float32 z_deriv
float32[2] delta_vxy
uint8 vxy_reset_counter
float32 delta_vz
uint8 vz_reset_counter
float32 ax
float32 ay
float32 az
float32 heading
""",
}
"""By the type of the message."""
