// Drives the node `planner` of ros/minsnap_cpp by its topics: waypoints, a vehicle of PX4 that takes off to the start, a change in flight, the end.
#include "stand_ins.hpp"

std::shared_ptr<rclcpp::Node> make_node();

namespace {

template <class Message>
void publish(const char *topic, const Message &message) {
    rclcpp::Publisher<Message>{topic}.publish(message);
}

nav_msgs::msg::Path path(std::initializer_list<std::array<double, 3>> points) {
    nav_msgs::msg::Path made;
    for (const auto &point : points) {
        made.poses.emplace_back();
        auto &to = made.poses.back().pose.position;
        to.x = point[0], to.y = point[1], to.z = point[2];
    }
    return made;
}

// Time goes on; the vehicle is said to be at the start.
void step(double until) {
    px4_msgs::msg::VehicleLocalPosition here;
    here.z = -1.0F;
    for (; rclcpp::seconds < until; rclcpp::seconds += 0.05) {
        for (const auto &timer : rclcpp::timers) timer();
        publish("/fmu/out/vehicle_local_position_v1", here);
    }
}

}  // namespace

int main() {
    rclcpp::overrides["corridor"] = 0.3, rclcpp::overrides["budget"] = 0.8;
    const auto node = make_node();
    rclcpp::Node listener("listener");
    const rclcpp::QoS quality(1);
    listener.create_subscription<trajectory_msgs::msg::MultiDOFJointTrajectory>("/planner/trajectory", quality, [](const auto message) {
        for (const auto &point : message->points) {
            const auto &p = point.transforms[0].translation;
            const auto &v = point.velocities[0].linear;
            std::printf("plan %.17g %.17g %.17g %.17g %.17g %.17g\n", p.x, p.y, p.z, v.x, v.y, v.z);
        }
    });
    listener.create_subscription<px4_msgs::msg::TrajectorySetpoint>("/fmu/in/trajectory_setpoint", quality, [](const auto message) {
        std::printf("setpoint %.3f %.9g %.9g %.9g\n", rclcpp::seconds, message->position[0], message->position[1], message->position[2]);
    });
    auto elsewhere = path({{0, 0, 1}, {1, 0, 1}});
    elsewhere.header.frame_id = "odom";
    publish("/planner/waypoints", elsewhere);
    publish("/planner/waypoints", path({{0, 0, 1}}));
    publish("/planner/waypoints", path({{0, 0, 1}, {4, 0, 1}, {4, 3, 1.5}}));
    px4_msgs::msg::VehicleStatus offboard;
    offboard.nav_state = 14, offboard.arming_state = 2;
    step(0.5);
    publish("/fmu/out/vehicle_status_v1", offboard);
    step(3.0);
    publish("/planner/waypoints", path({{0, 0, 1}, {1, 0, 1}}));
    const auto change = std::any_cast<rclcpp::Service<nav_msgs::srv::GetPlan>::Callback>(rclcpp::services["/planner/replan"]);
    const auto request = std::make_shared<nav_msgs::srv::GetPlan::Request>();
    const auto response = std::make_shared<nav_msgs::srv::GetPlan::Response>();
    request->goal.pose.position.x = 4.1, request->goal.pose.position.y = 6.0, request->goal.pose.position.z = 1.8;
    change(request, response);
    std::printf("changed %zu\n", response->plan.poses.size());
    step(9.0);
    publish("/fmu/out/vehicle_status_v1", px4_msgs::msg::VehicleStatus{});
    std::printf("over\n");
    step(9.5);
    return 0;
}
