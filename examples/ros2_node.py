"""A ROS 2 node that publishes a plan to PX4: one px4_msgs/TrajectorySetpoint every 50 ms, in NED.

Without ROS it writes the messages into a file. With ROS 2, px4_msgs and PX4's bridge running, ``python
examples/ros2_node.py --publish`` publishes them: the first setpoint until the vehicle is armed and in offboard mode,
and for 10 s more, in which it climbs there; then the plan, then its end. It stops when the vehicle leaves that mode.
Arming and the offboard mode are left to the pilot. Positions are those of PX4's local frame: the vehicle must stand
below the plan's first point. The package ros/minsnap_ros compares the vehicle's position with it, too.
"""

import sys
from pathlib import Path

import numpy as np

import minsnap
from minsnap.files import offboard_control_mode, px4_setpoints, write_px4

RATE = 20.0
CLIMB = 10.0
"""Time for the climb to the first setpoint [s]."""

OFFBOARD, ARMED = 14, 2
"""NAVIGATION_STATE_OFFBOARD and ARMING_STATE_ARMED of px4_msgs/VehicleStatus."""


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
    state = {"next": -round(CLIMB * RATE), "flying": False}

    def heard(status) -> None:
        follows = status.nav_state == OFFBOARD and status.arming_state == ARMED
        if state["flying"] and not follows:
            raise SystemExit("the vehicle left offboard mode or was disarmed: the flight is over")
        state["flying"] = follows

    def tick() -> None:
        now = node.get_clock().now().nanoseconds // 1000
        row = messages[max(state["next"], 0)].copy()
        row["timestamp"] = now
        modes.publish(OffboardControlMode(**offboard_control_mode(now)))
        setpoints.publish(filled(TrajectorySetpoint(), row))
        if state["flying"]:
            state["next"] = min(state["next"] + 1, len(messages) - 1)

    messages = px4_setpoints(planned())
    version = getattr(VehicleStatus, "MESSAGE_VERSION", 0)  # above 0 it is a part of the topic's name
    node.create_subscription(VehicleStatus, "/fmu/out/vehicle_status" + f"_v{version}" * (version > 0), heard, quality)
    node.create_timer(1.0 / RATE, tick)
    try:
        rclpy.spin(node)
    except KeyboardInterrupt:
        pass


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
