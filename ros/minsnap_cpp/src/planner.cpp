// The node `planner` in C++, on the library alone: waypoints in, a certified plan out, changed while it is flown, and setpoints for PX4.
#include <builtin_interfaces/msg/time.hpp>
#include <chrono>
#include <cinttypes>
#include <functional>
#include <memory>
#include <minsnap_cpp/flown_plan.hpp>
#include <mutex>
#include <nav_msgs/msg/path.hpp>
#include <nav_msgs/srv/get_plan.hpp>
#include <rclcpp/rclcpp.hpp>
#include <rclcpp_components/register_node_macro.hpp>
#include <string>
#include <trajectory_msgs/msg/multi_dof_joint_trajectory.hpp>
#include <vector>
#if MINSNAP_WITH_PX4
#include <px4_msgs/msg/offboard_control_mode.hpp>
#include <px4_msgs/msg/trajectory_setpoint.hpp>
#include <px4_msgs/msg/vehicle_local_position.hpp>
#include <px4_msgs/msg/vehicle_status.hpp>
#endif

namespace minsnap_cpp {

using nav_msgs::msg::Path;
using nav_msgs::srv::GetPlan;
using trajectory_msgs::msg::MultiDOFJointTrajectory;
using trajectory_msgs::msg::MultiDOFJointTrajectoryPoint;

// Where a flight may begin, as `minsnap stream` has it.
constexpr double MAX_START_DISTANCE = 1.0;  // beside the first point [m]
constexpr double SETTLED_DISTANCE = 0.15, SETTLED_SPEED = 0.2, SETTLE_TIME = 1.0;

#if MINSNAP_WITH_PX4
// The topic of a message; versions above 0 are in its name.
template <class Message>
std::string topic(const std::string &name) {
    if constexpr (Message::MESSAGE_VERSION > 0)
        return name + "_v" + std::to_string(Message::MESSAGE_VERSION);
    else
        return name;
}
#endif

class Planner : public rclcpp::Node {
public:
    explicit Planner(const rclcpp::NodeOptions &options) : Node("planner", options) {
        declare_parameter("corridor", 0.0);
        declare_parameter("max_speed", 3.0);
        declare_parameter("max_acceleration", 6.0);
        declare_parameter("rate", 20.0);
        declare_parameter("budget", 0.1);
        declare_parameter("frame_id", std::string("map"));
        declare_parameter("px4", true);
        const rclcpp::QoS kept = rclcpp::QoS(1).transient_local().reliable();
        trajectories_ = create_publisher<MultiDOFJointTrajectory>("~/trajectory", kept);
        paths_ = create_publisher<Path>("~/path", kept);
        waypoints_ =
            create_subscription<Path>("~/waypoints", rclcpp::QoS(1), [this](const Path::SharedPtr path) { take_waypoints(*path); });
        replans_ = create_service<GetPlan>("~/replan", [this](const GetPlan::Request::SharedPtr request,
                                                              GetPlan::Response::SharedPtr response) { replan(*request, *response); });
        if (get_parameter("px4").as_bool()) connect();
    }

private:
    Asked asked() const {
        return {get_parameter("corridor").as_double(), get_parameter("max_speed").as_double(),
                get_parameter("max_acceleration").as_double()};
    }

    double seconds() const { return get_clock()->now().seconds(); }

    std::shared_ptr<FlownPlan> flown() const {
        const std::lock_guard<std::mutex> lock(mutex_);
        return flown_;
    }

    // Replace what is flown, unless another thread did so since.
    bool swap(const std::shared_ptr<FlownPlan> &before, std::shared_ptr<FlownPlan> after) {
        const std::lock_guard<std::mutex> lock(mutex_);
        if (flown_ != before) return false;
        flown_ = std::move(after);
        return true;
    }

    void refuse(const std::string &reason) const { RCLCPP_ERROR(get_logger(), "%s", reason.c_str()); }

    // Whether positions are in the frame of the plans.
    bool in_frame(const std::string &frame) const {
        const std::string own = get_parameter("frame_id").as_string();
        if (frame.empty() || frame == own) return true;
        refuse("positions in " + frame + ", and plans in " + own + ": transform them, or set frame_id");
        return false;
    }

    void take_waypoints(const Path &path) {
        std::vector<Vector> points;
        if (!in_frame(path.header.frame_id)) return;
        for (const auto &pose : path.poses) {
            if (!in_frame(pose.header.frame_id)) return;
            points.push_back({pose.pose.position.x, pose.pose.position.y, pose.pose.position.z});
        }
        const auto before = flown();
        std::string reason;
        auto plan = FlownPlan::through(points, asked(), reason);
        if (!plan) return refuse(reason);
        const double now = seconds();
        if (followed_ && before && before->begun() &&
            !(before->at(now).over(now) && distance(before->state(now)[0], plan->state(now)[0]) <= SETTLED_DISTANCE))
            return refuse("the vehicle flies a plan: change it by the service replan, or plan from its end once it is there");
        Path shown;
        if (!take(before, followed_ ? plan : plan->begun_at(now), shown)) refuse(LATE);
    }

    void replan(const GetPlan::Request &request, GetPlan::Response &response) {
        const auto before = flown();
        if (!before) return refuse("nothing was planned yet");
        if (!in_frame(request.goal.header.frame_id)) return;
        const auto &goal = request.goal.pose.position;
        std::string reason;
        auto after = before->changed({goal.x, goal.y, goal.z}, seconds(), get_parameter("budget").as_double(), asked(), reason);
        if (!after) return refuse(reason);
        if (!take(before, after, response.plan)) refuse(LATE);
    }

    // Fly `after` in place of `before`, and publish it; nothing changes where that fails.
    bool take(const std::shared_ptr<FlownPlan> &before, const std::shared_ptr<FlownPlan> &after, Path &path) {
        if (!swap(before, after)) return false;  // first of all, since messages of many points take longer than some budgets
        const FlownPlan plan = after->newest();
        const double rate = get_parameter("rate").as_double(), began = plan.begun() ? plan.began() : seconds();
        const auto nanoseconds = static_cast<std::int64_t>(std::llround(began * 1e9));
        MultiDOFJointTrajectory trajectory;
        trajectory.header.stamp.sec = static_cast<std::int32_t>(nanoseconds / 1000000000);
        trajectory.header.stamp.nanosec = static_cast<std::uint32_t>(nanoseconds % 1000000000);
        trajectory.header.frame_id = get_parameter("frame_id").as_string();
        trajectory.joint_names = {"base_link"};
        path.header = trajectory.header;
        const double duration = plan.curve().duration();
        const auto full = static_cast<int>(std::floor(duration * rate));
        const FlownPlan clocked = *plan.begun_at(0.0);
        for (int i = 0; i <= full + (full < duration * rate ? 1 : 0); ++i) {
            const double t = std::min(i / rate, duration);
            add(trajectory, path, clocked.state(t), t);
        }
        trajectories_->publish(trajectory);
        paths_->publish(path);
        return true;
    }

    static void add(MultiDOFJointTrajectory &trajectory, Path &path, const State &state, double t) {
        MultiDOFJointTrajectoryPoint point;
        point.transforms.resize(1), point.velocities.resize(1), point.accelerations.resize(1);
        const auto fill = [](auto &to, const Vector &from) { to.x = from[0], to.y = from[1], to.z = from[2]; };
        fill(point.transforms[0].translation, state[0]);
        point.transforms[0].rotation.w = 1.0;
        fill(point.velocities[0].linear, state[1]);
        fill(point.accelerations[0].linear, state[2]);
        const auto nanoseconds = static_cast<std::int64_t>(std::llround(t * 1e9));
        point.time_from_start.sec = static_cast<std::int32_t>(nanoseconds / 1000000000);
        point.time_from_start.nanosec = static_cast<std::uint32_t>(nanoseconds % 1000000000);
        trajectory.points.push_back(point);
        path.poses.emplace_back();
        path.poses.back().header.frame_id = path.header.frame_id;
        fill(path.poses.back().pose.position, state[0]);
        path.poses.back().pose.orientation.w = 1.0;
    }

#if MINSNAP_WITH_PX4
    using Status = px4_msgs::msg::VehicleStatus;
    using Position = px4_msgs::msg::VehicleLocalPosition;
    using Mode = px4_msgs::msg::OffboardControlMode;
    using Setpoint = px4_msgs::msg::TrajectorySetpoint;

    // Listen to the vehicle, and send it setpoints; they have a thread of their own, so that they go on while a plan is made.
    void connect() {
        const double rate = get_parameter("rate").as_double();
        if (!(rate >= 2.0)) return refuse("PX4 leaves the offboard mode below 2 Hz: set a higher rate");
        const rclcpp::QoS px4 = rclcpp::QoS(1).transient_local().best_effort();
        rclcpp::SubscriptionOptions own;
        own.callback_group = group_ = create_callback_group(rclcpp::CallbackGroupType::MutuallyExclusive);
        followed_ = true;
        modes_ = create_publisher<Mode>(topic<Mode>("/fmu/in/offboard_control_mode"), px4);
        setpoints_ = create_publisher<Setpoint>(topic<Setpoint>("/fmu/in/trajectory_setpoint"), px4);
        statuses_ = create_subscription<Status>(
            topic<Status>("/fmu/out/vehicle_status"), px4, [this](const Status::SharedPtr status) { take_status(*status); }, own);
        positions_ = create_subscription<Position>(
            topic<Position>("/fmu/out/vehicle_local_position"), px4,
            [this](const Position::SharedPtr position) { take_position(*position); }, own);
        timer_ = create_wall_timer(std::chrono::duration<double>(1.0 / rate), [this]() { send(); }, group_);
    }

    // The flight is over when the vehicle is not armed and in offboard mode any more.
    void take_status(const Status &status) {
        follows_ = status.nav_state == Status::NAVIGATION_STATE_OFFBOARD && status.arming_state == Status::ARMING_STATE_ARMED;
        const auto plan = flown();
        if (plan && plan->begun() && !follows_ && swap(plan, nullptr))
            RCLCPP_INFO(get_logger(), "the vehicle does not follow setpoints any more: the flight is over, plan again");
    }

    // The plan begins when the vehicle has been at rest where it begins for long enough.
    void take_position(const Position &told) {
        known_ = told.xy_valid && told.z_valid && told.v_xy_valid && told.v_z_valid;
        here_ = {told.y, told.x, -told.z};
        const auto plan = flown();
        if (!plan || plan->begun()) return;
        const double now = seconds();
        const bool there = follows_ && known_ && std::hypot(told.vx, told.vy, told.vz) <= SETTLED_SPEED &&
                           distance(here_, plan->state(now)[0]) <= SETTLED_DISTANCE;
        if (!there || settled_ < 0.0) settled_ = there ? now : -1.0;
        if (there && now - settled_ >= SETTLE_TIME && swap(plan, plan->begun_at(now))) settled_ = -1.0;
    }

    void send() {
        const auto plan = flown();
        if (!plan) return;
        const double now = seconds();
        const State state = plan->state(now);
        if (!plan->begun() && !follows_) {
            const double beside = std::hypot(state[0][0] - here_[0], state[0][1] - here_[1]);
            if (!known_ || beside > MAX_START_DISTANCE) {
                RCLCPP_INFO_THROTTLE(get_logger(), *get_clock(), 5000, "%s: no setpoint is sent",
                                     known_ ? "the vehicle is not below the plan's first point" : "PX4 reports no valid local position");
                return;
            }
        }
        Mode mode;
        Setpoint setpoint;
        mode.timestamp = setpoint.timestamp = static_cast<std::uint64_t>(std::llround(now * 1e6));
        mode.position = mode.velocity = mode.acceleration = true;
        const auto ned = [](const Vector &enu) {
            return std::array<float, 3>{static_cast<float>(enu[1]), static_cast<float>(enu[0]), static_cast<float>(-enu[2])};
        };
        setpoint.position = ned(state[0]), setpoint.velocity = ned(state[1]), setpoint.acceleration = ned(state[2]),
        setpoint.jerk = ned(state[3]);
        setpoint.yaw = static_cast<float>(M_PI_2), setpoint.yawspeed = 0.0F;  // yaw 0 of east, north, up
        modes_->publish(mode);
        setpoints_->publish(setpoint);
    }

    rclcpp::CallbackGroup::SharedPtr group_;
    rclcpp::Publisher<Mode>::SharedPtr modes_;
    rclcpp::Publisher<Setpoint>::SharedPtr setpoints_;
    rclcpp::Subscription<Status>::SharedPtr statuses_;
    rclcpp::Subscription<Position>::SharedPtr positions_;
    rclcpp::TimerBase::SharedPtr timer_;
    bool follows_ = false, known_ = false;
    Vector here_{};
    double settled_ = -1.0;  // since when the vehicle is at rest at the start [s]
#else
    void connect() { RCLCPP_INFO(get_logger(), "built without px4_msgs: the plan is published, and no setpoints for PX4"); }
#endif

    static constexpr const char *LATE = "the vehicle came into offboard mode or left it while this was planned: try again";

    mutable std::mutex mutex_;
    std::shared_ptr<FlownPlan> flown_;
    bool followed_ = false;
    rclcpp::Publisher<MultiDOFJointTrajectory>::SharedPtr trajectories_;
    rclcpp::Publisher<Path>::SharedPtr paths_;
    rclcpp::Subscription<Path>::SharedPtr waypoints_;
    rclcpp::Service<GetPlan>::SharedPtr replans_;
};

}  // namespace minsnap_cpp

RCLCPP_COMPONENTS_REGISTER_NODE(minsnap_cpp::Planner)
