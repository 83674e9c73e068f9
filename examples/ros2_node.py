"""A ROS 2 node that publishes a plan to PX4: one px4_msgs/TrajectorySetpoint every 50 ms, in NED.

Without ROS it writes the messages into a file. With ROS 2, px4_msgs and PX4's bridge running, ``python
examples/ros2_node.py --publish`` publishes them: the first setpoint until the vehicle is in offboard mode, then the
plan, then its end. Arming and the offboard mode are left to the pilot. Positions are those of PX4's local frame: the
vehicle should stand below the plan's first point.
"""

import sys
from pathlib import Path

import numpy as np

import minsnap
from minsnap.files.formats.robot_messages import offboard_control_mode, px4_setpoints, write_px4

RATE = 20.0
OFFBOARD = 14
"""NAVIGATION_STATE_OFFBOARD of px4_msgs/VehicleStatus."""


def planned() -> minsnap.Samples:
    """Return the setpoints of a rectangle, looking where it flies."""
    return minsnap.rectangle(4.0, 3.0, altitude=2.0, yaw="velocity").sample(RATE)


def filled(message, values):
    """Return a ROS message with the fields of one row of setpoints."""
    for name in values.dtype.names:
        value = values[name]
        setattr(message, name, int(value) if name == "timestamp" else np.asarray(value).tolist())
    return message


def publish() -> None:
    """Run the node until it is interrupted."""
    import rclpy
    from px4_msgs.msg import OffboardControlMode, TrajectorySetpoint, VehicleStatus
    from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

    rclpy.init()
    node = rclpy.create_node("minsnap")
    quality = QoSProfile(
        depth=1, reliability=ReliabilityPolicy.BEST_EFFORT, durability=DurabilityPolicy.TRANSIENT_LOCAL
    )
    modes = node.create_publisher(OffboardControlMode, "/fmu/in/offboard_control_mode", quality)
    setpoints = node.create_publisher(TrajectorySetpoint, "/fmu/in/trajectory_setpoint", quality)
    state = {"next": 0, "offboard": False}

    def heard(status) -> None:
        state["offboard"] = status.nav_state == OFFBOARD

    def tick() -> None:
        now = node.get_clock().now().nanoseconds // 1000
        row = messages[state["next"]].copy()
        row["timestamp"] = now
        modes.publish(OffboardControlMode(**offboard_control_mode(now)))
        setpoints.publish(filled(TrajectorySetpoint(), row))
        if state["offboard"]:
            state["next"] = min(state["next"] + 1, len(messages) - 1)

    messages = px4_setpoints(planned())
    node.create_subscription(VehicleStatus, "/fmu/out/vehicle_status", heard, quality)
    node.create_timer(1.0 / RATE, tick)
    rclpy.spin(node)


def main(folder: Path) -> None:
    """Write the messages, and say what they are."""
    folder.mkdir(parents=True, exist_ok=True)
    samples = planned()
    write_px4(samples, folder / "px4_setpoints.npy")
    print(f"{len(samples)} setpoints for {samples.duration:.2f} s at {RATE:g} Hz")


if __name__ == "__main__":
    if "--publish" in sys.argv:
        publish()
    else:
        main(Path(sys.argv[1] if len(sys.argv) > 1 else "out"))
