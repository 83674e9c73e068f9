// Drives the flight mode of ros/minsnap_px4_mode as PX4's interface library does: selected, flown to its end, selected again in motion.
#include "stand_ins.hpp"
#define main mode_main
#include "fly_plan.cpp"
#undef main

int main() {
    px4_ros2::NodeWithMode<minsnap_cpp::FlyPlan> node("mode", false);
    nav_msgs::msg::Path path;
    path.poses.resize(2);
    path.poses[0].pose.position.x = 4.0, path.poses[0].pose.position.z = 2.0;
    path.poses[1].pose.position.x = 4.0, path.poses[1].pose.position.y = 3.0, path.poses[1].pose.position.z = 3.0;
    rclcpp::Publisher<nav_msgs::msg::Path>{"/mode/waypoints"}.publish(path);
    node.mode.onActivate();
    for (int i = 0; i < 1000 && px4_ros2::results.empty(); ++i) node.mode.updateSetpoint(0.02F);
    for (const auto &setpoint : px4_ros2::sent) {
        const auto &p = setpoint.position.values, &v = setpoint.velocity.values;
        std::printf("setpoint %.9g %.9g %.9g %.9g %.9g %.9g\n", p[0], p[1], p[2], v[0], v[1], v[2]);
    }
    node.mode.onDeactivate();
    px4_ros2::velocity = {1, 0, 0};
    node.mode.onActivate();
    node.mode.updateSetpoint(0.02F);
    for (const auto result : px4_ros2::results) std::printf("%s\n", result == px4_ros2::Result::Success ? "completed" : "failed");
    return 0;
}
