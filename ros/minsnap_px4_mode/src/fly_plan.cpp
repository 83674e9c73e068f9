// A flight mode of PX4, by the interface library px4_ros2_cpp: selected by the pilot like any other, it flies from where the vehicle hovers
// through the waypoints of ~/waypoints, and is completed at rest at the last one.
#include <Eigen/Core>
#include <memory>
#include <minsnap_cpp/flown_plan.hpp>
#include <nav_msgs/msg/path.hpp>
#include <px4_ros2/components/mode.hpp>
#include <px4_ros2/components/node_with_mode.hpp>
#include <px4_ros2/control/setpoint_types/experimental/trajectory.hpp>
#include <px4_ros2/odometry/local_position.hpp>
#include <rclcpp/rclcpp.hpp>
#include <string>
#include <vector>

namespace minsnap_cpp {

class FlyPlan : public px4_ros2::ModeBase {
public:
    explicit FlyPlan(rclcpp::Node &node) : ModeBase(node, Settings{"Minimum snap"}), node_(node) {
        setpoints_ = std::make_shared<px4_ros2::TrajectorySetpointType>(*this);
        vehicle_ = std::make_shared<px4_ros2::OdometryLocalPosition>(*this);
        setSetpointUpdateRate(RATE);
        asked_.corridor = node.declare_parameter("corridor", 0.0);
        asked_.speed = node.declare_parameter("max_speed", 3.0);
        asked_.acceleration = node.declare_parameter("max_acceleration", 6.0);
        waypoints_ =
            node.create_subscription<nav_msgs::msg::Path>("~/waypoints", rclcpp::QoS(1), [this](const nav_msgs::msg::Path::SharedPtr path) {
                points_.clear();
                for (const auto &pose : path->poses) points_.push_back({pose.pose.position.x, pose.pose.position.y, pose.pose.position.z});
            });
    }

    // Plan from where the vehicle is to the waypoints; the time of the mode is that of the plan.
    void onActivate() override {
        const Eigen::Vector3f ned = vehicle_->positionNed();
        std::vector<Vector> points{{ned.y(), ned.x(), -ned.z()}};
        points.insert(points.end(), points_.begin(), points_.end());
        std::string reason;
        plan_ = vehicle_->velocityNed().norm() > AT_REST ? nullptr : FlownPlan::through(points, asked_, reason);
        time_ = 0.0;
        if (plan_)
            plan_ = plan_->begun_at(0.0);
        else
            RCLCPP_ERROR(node_.get_logger(), "%s", reason.empty() ? "the vehicle moves: hover first" : reason.c_str());
    }

    void onDeactivate() override { plan_ = nullptr; }

    void updateSetpoint(float seconds) override {
        if (!plan_) return completed(px4_ros2::Result::ModeFailureOther);
        time_ += seconds;
        const State state = plan_->state(time_);
        const auto ned = [](const Vector &enu) {
            return Eigen::Vector3f(static_cast<float>(enu[1]), static_cast<float>(enu[0]), static_cast<float>(-enu[2]));
        };
        px4_ros2::TrajectorySetpoint setpoint;
        setpoint.withPosition(ned(state[0])).withVelocity(ned(state[1])).withAcceleration(ned(state[2]));
        setpoints_->update(setpoint);
        if (plan_->over(time_)) completed(px4_ros2::Result::Success);
    }

private:
    static constexpr float RATE = 50.0F, AT_REST = 0.2F;

    rclcpp::Node &node_;
    Asked asked_;
    std::vector<Vector> points_;
    std::shared_ptr<FlownPlan> plan_;
    double time_ = 0.0;
    std::shared_ptr<px4_ros2::TrajectorySetpointType> setpoints_;
    std::shared_ptr<px4_ros2::OdometryLocalPosition> vehicle_;
    rclcpp::Subscription<nav_msgs::msg::Path>::SharedPtr waypoints_;
};

}  // namespace minsnap_cpp

int main(int argc, char *argv[]) {
    rclcpp::init(argc, argv);
    rclcpp::spin(std::make_shared<px4_ros2::NodeWithMode<minsnap_cpp::FlyPlan>>("minsnap_px4_mode", false));
    rclcpp::shutdown();
    return 0;
}
