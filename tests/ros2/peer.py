"""Nodes of a real ROS 2: rclpy over Fast DDS. Usage: peer.py CASE. Fails with a traceback and exit code 1."""

import os
import sys
import time

# A process with threads may not fork. numpy would start some.
os.environ["OPENBLAS_NUM_THREADS"] = "1"

import rclpy
from diagnostic_msgs.msg import DiagnosticStatus
from geometry_msgs.msg import PoseStamped, WrenchStamped
from rcl_interfaces.msg import ParameterEvent
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.parameter_client import AsyncParameterClient
from rclpy.qos import DurabilityPolicy, QoSProfile, qos_profile_parameter_events, qos_profile_sensor_data
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64MultiArray
from std_srvs.srv import SetBool, Trigger

JOINTS = [f"joint{number}" for number in range(1, 7)]
LATCHED = QoSProfile(depth=100, durability=DurabilityPolicy.TRANSIENT_LOCAL)


# How long a test waits for what must happen [s]. Only a failing test waits so long.
PATIENCE = 60.0


def wait(what, found, node):
    """Spins the node until `found` returns something that counts as true, and returns that."""
    end = time.monotonic() + PATIENCE
    while time.monotonic() < end:
        if result := found():
            return result
        rclpy.spin_once(node, timeout_sec=0.05)
    raise TimeoutError(f"{what}: not within {PATIENCE} s")


def answer(what, future, node):
    """Returns the result of a call."""
    return wait(what, lambda: future.done() and future.result(), node)


def parameters_of(node, name):
    """Returns a client of the parameters of the node `name`, once they are served."""
    client = AsyncParameterClient(node, name)
    assert client.wait_for_services(PATIENCE), name
    return client


def values(status):
    return {pair.key: pair.value for pair in status.values}


def listen(node, kind, topic, qos=10):
    """Subscribes, and returns the list to which messages are added."""
    messages = []
    node.create_subscription(kind, topic, messages.append, qos)
    return messages


def newest(messages):
    """Returns the last message and forgets all."""
    last = messages[-1] if messages else None
    messages.clear()
    return last


def goal(x):
    pose = PoseStamped()
    pose.header.frame_id = "base_link"
    pose.pose.position.x, pose.pose.position.y, pose.pose.position.z = x, 0.2, 0.2
    pose.pose.orientation.w = 1.0
    return pose


def publish_once(namespace, x):
    """Does what `ros2 topic pub --once` does: waits for a subscriber, publishes, and leaves 0.1 s later."""
    rclpy.init()
    node = Node("once", namespace=namespace)
    publisher = node.create_publisher(PoseStamped, "goal_pose", 10)
    wait("a subscriber of goals", publisher.get_subscription_count, node)
    publisher.publish(goal(x))
    time.sleep(0.1)
    node.destroy_node()
    rclpy.shutdown()


def processes_publish_once(namespace, count):
    """Publishes each goal from a process of its own."""
    for number in range(count):
        child = os.fork()
        if child == 0:
            publish_once(namespace, -0.125 - 0.001 * number)
            os._exit(0)
        assert os.waitpid(child, 0)[1] == 0, f"publisher {number} failed"


def case_goals():
    """Twenty publishers leave at once. The left servo takes all their goals, the right one none; motions are latched."""
    processes_publish_once("/left", 20)
    rclpy.init()
    node = Node("user")
    left = listen(node, DiagnosticStatus, "/left/dq_servo/status")
    right = listen(node, DiagnosticStatus, "/right/dq_servo/status")
    motions = listen(node, DiagnosticStatus, "/left/dq_servo/motions", LATCHED)
    status = lambda messages: values(wait("a status", lambda: newest(messages), node))
    taken = lambda: status(left)["goal_count"]
    wait("20 goals", lambda: taken() == "20", node)
    assert status(right)["goal_count"] == "0"
    ended = lambda: [values(motion)["outcome"] for motion in motions]
    wait("20 motions", lambda: len({values(motion)["motion"] for motion in motions}) == 20, node)
    wait("the end of the last motion", lambda: ended()[-1] == "arrived", node)
    assert ended().count("underway") == 20, ended()


def case_parameters():
    """Parameters and services answer as those of a node of rclcpp."""
    rclpy.init()
    node = Node("user", namespace="/left")
    client = parameters_of(node, "dq_servo")
    names = answer("a list", client.list_parameters([], 0), node).result.names
    assert {"controller", "gains.logc", "use_sim_time"} <= set(names) and len(names) > 50, names
    assert len(answer("all values", client.get_parameters(names), node).values) == len(names)

    def set_to(name, value):
        [result] = answer("a change", client.set_parameters([Parameter(name, value=value)]), node).results
        return result

    get = lambda name: answer("a value", client.get_parameters([name]), node).values[0]
    assert set_to("controller", "diffc").successful and get("controller").string_value == "diffc"
    refused = set_to("controller", "diffd")
    assert not refused.successful and "diffc" in refused.reason and get("controller").string_value == "diffc", refused
    wrong_type = set_to("gains.diffc", "fast")
    assert not wrong_type.successful and "gains.diffc" in wrong_type.reason, wrong_type
    assert not set_to("update_rate", 100).successful
    assert set_to("update_rate", get("update_rate").integer_value).successful, "it has that value, as `ros2 param load` of a dump finds"
    [described] = answer("a description", client.describe_parameters(["gains.diffc"]), node).descriptors
    assert described.description and described.floating_point_range and not described.read_only, described
    [described] = answer("a description", client.describe_parameters(["update_rate"]), node).descriptors
    assert described.read_only, described

    states = listen(node, DiagnosticStatus, "dq_servo/status")
    message = lambda: (last := newest(states)) and last.message
    pause = node.create_client(SetBool, "dq_servo/pause")
    stop = node.create_client(Trigger, "dq_servo/stop")
    assert pause.wait_for_service(PATIENCE) and stop.wait_for_service(PATIENCE)
    assert answer("a pause", pause.call_async(SetBool.Request(data=True)), node).success
    wait("a pause", lambda: "paused" in (message() or ""), node)
    assert answer("its end", pause.call_async(SetBool.Request(data=False)), node).success
    assert answer("a stop", stop.call_async(Trigger.Request()), node).success
    wait("the end of the pause", lambda: "holding" in (message() or ""), node)


def subscribe_as_rosbag2(node, topic, kind):
    """Subscribes as rosbag2's recorder: latched if all publishers are, reliable if all are."""
    offers = [found.qos_profile for found in node.get_publishers_info_by_topic(topic) if found.node_name != node.get_name()]
    latched = all(offer.durability == DurabilityPolicy.TRANSIENT_LOCAL for offer in offers)
    durability = DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE
    return listen(node, kind, topic, QoSProfile(depth=10, durability=durability))


def case_graph():
    """Every endpoint belongs to a node that is known, and a recorder that joins receives the parameter events of all."""
    rclpy.init()
    recorder = Node("recorder")
    ours = {(f"/{side}", name) for side in ("left", "right") for name in ("dq_servo", "puma560")}
    nodes = lambda: set(recorder.get_node_names_and_namespaces())
    wait("all nodes", lambda: {(space, name) for name, space in nodes()} == ours | {("/", "recorder")}, recorder)

    def strangers():
        topics = [topic for topic, _ in recorder.get_topic_names_and_types()]
        infos = [info for topic in topics for find in (recorder.get_publishers_info_by_topic, recorder.get_subscriptions_info_by_topic) for info in find(topic)]
        return sorted({(info.topic_type, info.node_namespace, info.node_name) for info in infos if (info.node_namespace, info.node_name) not in ours | {("/", "recorder")}})

    wait("the owners of all endpoints", lambda: not strangers(), recorder)
    assert recorder.count_publishers("/left/goal_pose") == 0, "nobody drags the goal"
    events = subscribe_as_rosbag2(recorder, "/parameter_events", ParameterEvent)
    # A node that joins later, as those of a user whose recorder runs already.
    other = Node("later", parameter_overrides=[Parameter("speed", value=1.0)])
    other.declare_parameter("speed", 1.0)
    client = parameters_of(recorder, "/left/dq_servo")

    def both_are_heard():
        other.set_parameters([Parameter("speed", value=2.0)])
        answer("a change", client.set_parameters([Parameter("gains.diffc", value=180.0)]), recorder)
        return {"/later", "/left/dq_servo"} <= {event.node for event in events}

    wait("the parameter events of both nodes", both_are_heard, recorder)


def case_robot():
    """Is a robot that publishes its joint states BEST_EFFORT at 200 Hz and integrates the speeds that it gets."""
    rclpy.init()
    node = Node("robot")
    period = 1.0 / 200.0
    positions, speeds = [0.0, -0.6, 0.9, 0.1, 0.8, 0.0], [0.0] * 6
    publisher = node.create_publisher(JointState, "joint_states", qos_profile_sensor_data)

    def publish():
        for joint, speed in enumerate(speeds):
            positions[joint] += speed * period
        message = JointState(name=JOINTS, position=positions, velocity=speeds)
        message.header.stamp = node.get_clock().now().to_msg()
        publisher.publish(message)

    def take(commands):
        speeds[:] = commands.data

    node.create_subscription(Float64MultiArray, "forward_velocity_controller/commands", take, 10)
    node.create_timer(period, publish)
    rclpy.spin(node)


def case_wrench():
    """A wrist sensor: the goal yields by F/K, a silence of the sensor stops the arm, and a large force is named."""
    rclpy.init()
    node = Node("sensor")
    wrenches = node.create_publisher(WrenchStamped, "wrench", qos_profile_sensor_data)
    force = [7.0]  # N along x; None: the sensor is silent

    def publish():
        if force[0] is not None:
            message = WrenchStamped()
            message.header.frame_id, message.header.stamp = "tool0", node.get_clock().now().to_msg()
            # A sensor that repeats one number while the tool moves would count as frozen.
            message.wrench.force.x = force[0] + 1e-7 * (time.monotonic() % 1.0)
            wrenches.publish(message)

    node.create_timer(0.008, publish)
    states = listen(node, DiagnosticStatus, "dq_servo/status")
    status = lambda: wait("a status", lambda: newest(states), node)
    tare, identify = node.create_client(Trigger, "dq_servo/tare"), node.create_client(SetBool, "dq_servo/identify_tool")
    assert tare.wait_for_service(PATIENCE) and identify.wait_for_service(PATIENCE)
    wait("the wrench", lambda: abs(float(values(status()).get("contact_force_n", 0.0)) - 7.0) < 1e-6, node)
    end = time.monotonic() + 1.5
    wait("the sensor's mean", lambda: time.monotonic() > end, node)
    assert answer("a tare", tare.call_async(Trigger.Request()), node).success
    goals = node.create_publisher(PoseStamped, "goal_pose", 10)
    wait("a subscriber of goals", goals.get_subscription_count, node)
    goals.publish(goal(-0.125))
    wait("arrival", lambda: status().message == "settled", node)
    # 11 N are 10 N beyond the dead band: 20 mm at 500 N/m.
    force[0] = 18.0
    wait("the goal to yield", lambda: abs(float(values(status())["yielded_m"]) - 0.02) < 1e-4, node)
    force[0] = None
    wait("the sensor's silence to be noticed", lambda: status().message == "stale_wrench", node)
    force[0] = 7.0
    wait("arrival", lambda: status().message == "settled" and float(values(status())["yielded_m"]) < 1e-3, node)
    assert answer("the begin of an identification", identify.call_async(SetBool.Request(data=True)), node).success
    refused = answer("its end", identify.call_async(SetBool.Request(data=False)), node)
    assert not refused.success and "turn it slowly" in refused.message, refused
    force[0] = 69.0
    wait("the stop", lambda: "contact: 62 N" in values(status()).get("reason", ""), node)


if __name__ == "__main__":
    globals()[f"case_{sys.argv[1]}"]()
