// Stand-ins of the interfaces of ROS 2, px4_msgs, px4_ros2_cpp and Eigen that the packages in ros/ use, with their names and fields. Messages are
// delivered at once, in this process; who subscribes late to a topic that keeps its last message is given it. A clock is set by hand.
#ifndef ROS_STAND_INS_HPP
#define ROS_STAND_INS_HPP

#include <any>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <variant>
#include <vector>

#define MESSAGE(name) using SharedPtr = std::shared_ptr<name>

namespace builtin_interfaces::msg {
struct Time {
    std::int32_t sec = 0;
    std::uint32_t nanosec = 0;
};
using Duration = Time;
}  // namespace builtin_interfaces::msg

namespace std_msgs::msg {
struct Header {
    builtin_interfaces::msg::Time stamp;
    std::string frame_id;
};
}  // namespace std_msgs::msg

namespace geometry_msgs::msg {
struct Vector3 {
    double x = 0.0, y = 0.0, z = 0.0;
};
using Point = Vector3;
struct Quaternion {
    double x = 0.0, y = 0.0, z = 0.0, w = 1.0;
};
struct Pose {
    Point position;
    Quaternion orientation;
};
struct PoseStamped {
    std_msgs::msg::Header header;
    Pose pose;
};
struct Transform {
    Vector3 translation;
    Quaternion rotation;
};
struct Twist {
    Vector3 linear, angular;
};
}  // namespace geometry_msgs::msg

namespace nav_msgs::msg {
struct Path {
    MESSAGE(Path);
    std_msgs::msg::Header header;
    std::vector<geometry_msgs::msg::PoseStamped> poses;
};
}  // namespace nav_msgs::msg

namespace nav_msgs::srv {
struct GetPlan {
    struct Request {
        MESSAGE(Request);
        geometry_msgs::msg::PoseStamped start, goal;
        float tolerance = 0.0F;
    };
    struct Response {
        MESSAGE(Response);
        nav_msgs::msg::Path plan;
    };
};
}  // namespace nav_msgs::srv

namespace trajectory_msgs::msg {
struct MultiDOFJointTrajectoryPoint {
    std::vector<geometry_msgs::msg::Transform> transforms;
    std::vector<geometry_msgs::msg::Twist> velocities, accelerations;
    builtin_interfaces::msg::Duration time_from_start;
};
struct MultiDOFJointTrajectory {
    MESSAGE(MultiDOFJointTrajectory);
    std_msgs::msg::Header header;
    std::vector<std::string> joint_names;
    std::vector<MultiDOFJointTrajectoryPoint> points;
};
}  // namespace trajectory_msgs::msg

namespace px4_msgs::msg {
struct OffboardControlMode {
    static constexpr std::uint32_t MESSAGE_VERSION = 0;
    MESSAGE(OffboardControlMode);
    std::uint64_t timestamp = 0;
    bool position = false, velocity = false, acceleration = false, attitude = false, body_rate = false, thrust_and_torque = false,
         direct_actuator = false;
};
struct TrajectorySetpoint {
    static constexpr std::uint32_t MESSAGE_VERSION = 0;
    MESSAGE(TrajectorySetpoint);
    std::uint64_t timestamp = 0;
    std::array<float, 3> position{}, velocity{}, acceleration{}, jerk{};
    float yaw = 0.0F, yawspeed = 0.0F;
};
struct VehicleLocalPosition {
    static constexpr std::uint32_t MESSAGE_VERSION = 1;
    MESSAGE(VehicleLocalPosition);
    bool xy_valid = true, z_valid = true, v_xy_valid = true, v_z_valid = true;
    float x = 0.0F, y = 0.0F, z = 0.0F, vx = 0.0F, vy = 0.0F, vz = 0.0F;
};
struct VehicleStatus {
    static constexpr std::uint32_t MESSAGE_VERSION = 1;
    MESSAGE(VehicleStatus);
    static constexpr std::uint8_t NAVIGATION_STATE_OFFBOARD = 14, ARMING_STATE_ARMED = 2;
    std::uint8_t nav_state = 0, arming_state = 0;
};
}  // namespace px4_msgs::msg

namespace rclcpp {
inline double seconds = 0.0;  // of all clocks

struct QoS {
    explicit QoS(std::size_t) {}
    QoS &transient_local() { return kept = true, *this; }
    QoS &reliable() { return *this; }
    QoS &best_effort() { return *this; }
    bool kept = false;
};

struct Topic {
    std::any last;
    std::vector<std::function<void(const std::any &)>> hear;
};
inline std::map<std::string, Topic> topics;
inline std::map<std::string, std::any> services;
inline std::map<std::string, std::variant<bool, double, std::string>> overrides;
inline std::vector<std::function<void()>> timers;

template <class Message>
struct Publisher {
    using SharedPtr = std::shared_ptr<Publisher>;
    std::string topic;
    bool kept = false;
    void publish(const Message &message) {
        auto &place = topics[topic];
        if (kept) place.last = message;
        for (auto &callback : place.hear) callback(message);
    }
};
template <class Message>
struct Subscription {
    using SharedPtr = std::shared_ptr<Subscription>;
};
template <class Kind>
struct Service {
    using SharedPtr = std::shared_ptr<Service>;
    using Callback = std::function<void(std::shared_ptr<typename Kind::Request>, std::shared_ptr<typename Kind::Response>)>;
};
struct TimerBase {
    using SharedPtr = std::shared_ptr<TimerBase>;
};
struct CallbackGroup {
    using SharedPtr = std::shared_ptr<CallbackGroup>;
};
enum class CallbackGroupType { MutuallyExclusive, Reentrant };
struct SubscriptionOptions {
    CallbackGroup::SharedPtr callback_group;
};
struct NodeOptions {};
struct Time {
    double value;
    double seconds() const { return value; }
};
struct Clock {
    using SharedPtr = std::shared_ptr<Clock>;
    Time now() const { return {rclcpp::seconds}; }
};
struct Logger {};
struct Parameter {
    std::variant<bool, double, std::string> value;
    bool as_bool() const { return std::get<bool>(value); }
    double as_double() const { return std::get<double>(value); }
    std::string as_string() const { return std::get<std::string>(value); }
};

class Node {
public:
    using SharedPtr = std::shared_ptr<Node>;
    explicit Node(const std::string &name, const NodeOptions & = {}) : name_(name) {}
    virtual ~Node() = default;

    template <class Value>
    Value declare_parameter(const std::string &name, Value value) {
        const auto given = overrides.find(name);
        values_[name].value = given == overrides.end() ? std::variant<bool, double, std::string>(value) : given->second;
        return std::get<Value>(values_[name].value);
    }
    Parameter get_parameter(const std::string &name) const { return values_.at(name); }
    Clock::SharedPtr get_clock() const { return std::make_shared<Clock>(); }
    Logger get_logger() const { return {}; }

    template <class Message>
    typename Publisher<Message>::SharedPtr create_publisher(const std::string &topic, const QoS &quality) {
        return std::make_shared<Publisher<Message>>(Publisher<Message>{full(topic), quality.kept});
    }
    template <class Message, class Callback>
    typename Subscription<Message>::SharedPtr create_subscription(const std::string &topic, const QoS &, Callback callback,
                                                                  const SubscriptionOptions & = {}) {
        auto &place = topics[full(topic)];
        place.hear.push_back(
            [callback](const std::any &message) { callback(std::make_shared<Message>(std::any_cast<const Message &>(message))); });
        if (place.last.has_value()) place.hear.back()(place.last);
        return std::make_shared<Subscription<Message>>();
    }
    template <class Kind, class Callback>
    typename Service<Kind>::SharedPtr create_service(const std::string &name, Callback callback) {
        services[full(name)] = typename Service<Kind>::Callback(callback);
        return std::make_shared<Service<Kind>>();
    }
    CallbackGroup::SharedPtr create_callback_group(CallbackGroupType) { return std::make_shared<CallbackGroup>(); }
    template <class Period, class Callback>
    TimerBase::SharedPtr create_wall_timer(Period, Callback callback, const CallbackGroup::SharedPtr & = nullptr) {
        timers.emplace_back(callback);
        return std::make_shared<TimerBase>();
    }

private:
    std::string full(const std::string &name) const { return name[0] == '~' ? "/" + name_ + name.substr(1) : name; }

    std::string name_;
    std::map<std::string, Parameter> values_;
};

inline void init(int, char *[]) {}
inline void spin(const Node::SharedPtr &) {}
inline void shutdown() {}
}  // namespace rclcpp

#define RCLCPP_INFO(logger, ...) (static_cast<void>(logger), std::printf("info "), std::printf(__VA_ARGS__), std::printf("\n"))
#define RCLCPP_ERROR(logger, ...) (static_cast<void>(logger), std::printf("error "), std::printf(__VA_ARGS__), std::printf("\n"))
#define RCLCPP_INFO_THROTTLE(logger, clock, milliseconds, ...) (static_cast<void>(clock), RCLCPP_INFO(logger, __VA_ARGS__))
#define RCLCPP_COMPONENTS_REGISTER_NODE(Kind) \
    std::shared_ptr<rclcpp::Node> make_node() { return std::make_shared<Kind>(rclcpp::NodeOptions{}); }

namespace Eigen {
struct Vector3f {
    Vector3f(float x, float y, float z) : values{x, y, z} {}
    float x() const { return values[0]; }
    float y() const { return values[1]; }
    float z() const { return values[2]; }
    float norm() const { return std::hypot(values[0], values[1], values[2]); }
    std::array<float, 3> values;
};
}  // namespace Eigen

namespace px4_ros2 {
inline Eigen::Vector3f position{0, 0, -2}, velocity{0, 0, 0};
enum class Result { Success, ModeFailureOther };
inline std::vector<Result> results;

struct Context {};
struct TrajectorySetpoint {
    Eigen::Vector3f position{0, 0, 0}, velocity{0, 0, 0}, acceleration{0, 0, 0};
    TrajectorySetpoint &withPosition(const Eigen::Vector3f &value) { return position = value, *this; }
    TrajectorySetpoint &withVelocity(const Eigen::Vector3f &value) { return velocity = value, *this; }
    TrajectorySetpoint &withAcceleration(const Eigen::Vector3f &value) { return acceleration = value, *this; }
};
inline std::vector<TrajectorySetpoint> sent;
struct TrajectorySetpointType {
    explicit TrajectorySetpointType(Context &) {}
    void update(const TrajectorySetpoint &setpoint) { sent.push_back(setpoint); }
};
struct OdometryLocalPosition {
    explicit OdometryLocalPosition(Context &) {}
    Eigen::Vector3f positionNed() const { return position; }
    Eigen::Vector3f velocityNed() const { return velocity; }
};
class ModeBase : public Context {
public:
    struct Settings {
        std::string name;
    };
    ModeBase(rclcpp::Node &, Settings) {}
    virtual ~ModeBase() = default;
    virtual void onActivate() = 0;
    virtual void onDeactivate() = 0;
    virtual void updateSetpoint(float) {}
    void setSetpointUpdateRate(float) {}
    void completed(Result result) { results.push_back(result); }
};
template <class Mode>
struct NodeWithMode : rclcpp::Node {
    NodeWithMode(const std::string &name, bool) : Node(name), mode(*this) {}
    Mode mode;
};
}  // namespace px4_ros2

#endif
