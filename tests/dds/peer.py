"""A DDS implementation of another vendor acts as the ROS 2 peer of servo and plant. Usage: peer.py CASE. Fails with an exception."""
import os
import subprocess
import sys
import time

from cyclonedds.builtin import BuiltinDataReader, BuiltinTopicDcpsPublication, BuiltinTopicDcpsSubscription
from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.internal import InvalidSample
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration

import rostypes as ros

RELIABLE = Qos(Policy.Reliability.Reliable(duration(seconds=1)), Policy.History.KeepLast(10), Policy.Durability.Volatile)
EVERY = Qos(Policy.Reliability.Reliable(duration(seconds=1)), Policy.History.KeepAll, Policy.Durability.Volatile)
LATCHED = Qos(
    Policy.Reliability.Reliable(duration(seconds=1)), Policy.History.KeepLast(1), Policy.Durability.TransientLocal
)
PARTICIPANT = DomainParticipant(int(os.environ["ROS_DOMAIN_ID"]))

# The number of readers of what is published here: the servo, and possibly a recorder, which is sometimes found first.
READERS = int(os.environ.get("READERS", 1))

# The orientation of theta_desired in the reference work, at a point that is easy to reach.
GOAL = ros.PoseStamped(
    ros.Header(frame_id="base_link"),
    ros.Pose(
        ros.Point(-0.12500000000000006, 0.20330072640553965, 0.20247567402305685),
        ros.Quaternion(-0.7906751133619655, 0.28121111222173983, -0.3664814565722668, -0.4018015896704795),
    ),
)


def reader(topic, kind, qos=RELIABLE):
    return DataReader(PARTICIPANT, Topic(PARTICIPANT, f"rt/{topic}", kind), qos=qos)


def writer(topic, kind):
    return DataWriter(PARTICIPANT, Topic(PARTICIPANT, f"rt/{topic}", kind), qos=RELIABLE)


# How long a test waits for what must happen [s]. Only a failing test waits so long; fake time tests how fast the nodes are.
PATIENCE = 60.0


def wait(what, condition):
    """Waits until the condition returns a true value, and returns it."""
    end = time.monotonic() + PATIENCE
    while time.monotonic() < end:
        result = condition()
        if result:
            return result
        time.sleep(0.002)
    raise TimeoutError(f"{what}: not within {PATIENCE} s")


def take(source):
    """All samples that arrived, without those that only announce the end of a writer."""
    return [sample for sample in source.take(100000) if not isinstance(sample, InvalidSample)]


def last(source):
    samples = take(source)
    return samples[-1] if samples else None


def wait_matched(entity, readers=READERS):
    if isinstance(entity, DataWriter):
        wait("all readers", lambda: entity.get_publication_matched_status().current_count >= readers)
    else:
        wait("a writer", lambda: entity.get_subscription_matched_status().current_count > 0)


def call(node, service, types, cyclone, **fields):
    """Calls a service as rmw_cyclonedds does (with its header) or as rmw_fastrtps does (payload only)."""
    request, response = types[2:] if cyclone else types[:2]
    out = DataWriter(PARTICIPANT, Topic(PARTICIPANT, f"rq/{node}/{service}Request", request), qos=RELIABLE)
    back = DataReader(PARTICIPANT, Topic(PARTICIPANT, f"rr/{node}/{service}Reply", response), qos=RELIABLE)
    wait_matched(out, 1)
    wait_matched(back)
    time.sleep(0.2)  # The server must have matched our reader too, which nothing here can see.
    header = {"client": 0x1122334455667788, "sequence_number": 7} if cyclone else {}
    out.write(request(**header, **fields))
    reply = wait(f"a reply of {service}", lambda: last(back))
    if cyclone:
        assert (reply.client, reply.sequence_number) == (0x1122334455667788, 7), reply
    return reply


def set_controller(law, cyclone):
    parameter = ros.Parameter("controller", ros.ParameterValue(type=4, string_value=law))
    return call("dq_servo", "set_parameters", ros.SET_PARAMETERS, cyclone, parameters=[parameter]).results[0]


def get_controller(cyclone):
    return call("dq_servo", "get_parameters", ros.GET_PARAMETERS, cyclone, names=["controller"]).values[0].string_value


def send_goal():
    goals = writer("goal_pose", ros.PoseStamped)
    wait_matched(goals)
    goals.write(GOAL)
    return goals


def apart(p, g):
    return ((p.x - g.x) ** 2 + (p.y - g.y) ** 2 + (p.z - g.z) ** 2) ** 0.5


def distance(pose):
    return apart(pose.pose.position, GOAL.pose.position)


def moving(states):
    """Waits until the arm moves fast."""
    def fast():
        state = last(states)
        return state and max(map(abs, state.velocity)) > 0.3
    wait("motion", fast)


def case_arrive():
    """A goal from Cyclone DDS moves the arm there. The joint states and the tool pose show that."""
    poses, states = reader("dq_servo/current_pose", ros.PoseStamped), reader("joint_states", ros.JointState)
    statuses = reader("dq_servo/status", ros.DiagnosticStatus)
    before = wait("a joint state", lambda: last(states))
    assert before.name == [f"joint{i}" for i in range(1, 7)], before
    goals = send_goal()
    wait("settled", lambda: (s := last(statuses)) and s.message == "settled")
    pose = wait("a pose", lambda: last(poses))
    assert pose.header.frame_id == "base_link" and distance(pose) < 1.1e-3, pose
    after = wait("a joint state", lambda: last(states))
    assert max(abs(a - b) for a, b in zip(before.position, after.position)) > 0.5
    description = wait("a description", lambda: last(reader_of_description))
    assert description.data.startswith("<?xml") and "joint6" in description.data
    del goals


def case_parameters():
    """The controller is set with the header of Cyclone DDS and with the mapping of Fast DDS. An invalid one is rejected and changes
    nothing."""
    events = reader("parameter_events", ros.ParameterEvent)
    wait_matched(events)
    for cyclone in (True, False):
        for law in ("diffc", "logc"):
            result = set_controller(law, cyclone)
            assert result.successful, result
            assert get_controller(cyclone) == law
        refused = set_controller("pid", cyclone)
        assert not refused.successful and "one of diffc, diffc_inverse, logc" in refused.reason, refused
        assert get_controller(cyclone) == "logc"
    told = [(event.node, [p.value.string_value for p in event.changed_parameters]) for event in take(events)]
    assert told[-4:] == [("/dq_servo", [law]) for law in ("diffc", "logc") * 2], told


def case_switch():
    """A change of the law during a motion takes effect without a step in the command."""
    commands = reader("forward_velocity_controller/commands", ros.Float64MultiArray, EVERY)
    states = reader("joint_states", ros.JointState)
    goals = send_goal()
    moving(states)
    seen = []
    for law in ("diffc", "double_geodesic", "logc"):
        assert set_controller(law, True).successful
        seen += take(commands)
    assert len(seen) > 100, len(seen)
    # 50 rad/s² in cycles of 2 ms.
    steps = [abs(b - a) for x, y in zip(seen, seen[1:]) for a, b in zip(x.data, y.data)]
    assert max(steps) <= 50 * 0.002 * 1.000001, max(steps)
    del goals


def case_interrupt(servo, signal):
    """A servo that gets a signal during a motion decelerates and sends zeros, which are acknowledged."""
    commands = reader("forward_velocity_controller/commands", ros.Float64MultiArray, EVERY)
    states = reader("joint_states", ros.JointState)
    goals = send_goal()
    moving(states)
    os.kill(servo, signal)
    seen = []
    wait("the end of commands", lambda: seen.extend(take(commands)) or (seen and not any(seen[-1].data)))
    time.sleep(0.3)
    seen += take(commands)
    assert not any(seen[-1].data), seen[-1]
    steps = [abs(b - a) for x, y in zip(seen, seen[1:]) for a, b in zip(x.data, y.data)]
    assert max(steps) <= 50 * 0.002 * 1.000001, max(steps)
    state = wait("a joint state", lambda: last(states))
    assert not any(state.velocity), state
    del goals


def case_interrupt_twice(servo):
    """A second signal does not wait for the end of a long deceleration: zeros are sent immediately."""
    commands = reader("forward_velocity_controller/commands", ros.Float64MultiArray, EVERY)
    goals = send_goal()
    wait("motion", lambda: (c := last(commands)) and max(map(abs, c.data)) > 0.5)
    os.kill(servo, 2)
    time.sleep(0.05)
    seen = take(commands)
    assert any(seen[-1].data), "at 1 rad/s² it takes half a second"
    os.kill(servo, 2)
    wait("zeros", lambda: seen.extend(take(commands)) or not any(seen[-1].data))
    slowest = min(max(map(abs, c.data)) for c in seen if any(c.data))
    assert slowest > 0.1, "without a ramp"
    time.sleep(0.3)
    assert all(not any(c.data) for c in take(commands))
    del goals


def set_parameter(node, name, value):
    typed = {str: {"type": 4, "string_value": value}, bool: {"type": 1, "bool_value": value}}.get(type(value), {"type": 3, "double_value": value})
    parameter = ros.Parameter(name, ros.ParameterValue(**typed))
    result = call(node, "set_parameters", ros.SET_PARAMETERS, True, parameters=[parameter]).results[0]
    assert result.successful, result


def case_guarded():
    """The servo has a guard and an arm."""
    statuses = reader("dq_servo/status", ros.DiagnosticStatus)
    guard = lambda status: {pair.key: pair.value for pair in status.values}.get("guard")
    wait("the guard", lambda: (s := last(statuses)) and s.message == "holding" and guard(s) == "watching")


def transform(child, x, y, z, stamp=None):
    """The position of a frame in base_link. Its axes are rotated by 180° about x."""
    at = ros.Transform(ros.Vector3(x, y, z), ros.Quaternion(1.0, 0.0, 0.0, 0.0))
    header = ros.Header(stamp or ros.Time(), "base_link")
    return ros.TFMessage([ros.TransformStamped(header, child, at)])


def as_time(nanoseconds):
    return ros.Time(nanoseconds // 10**9, nanoseconds % 10**9)


def goal_seen_from(frame, x, y, z, stamp=None):
    """GOAL relative to a frame at the given position that is rotated by 180° about x."""
    p, q = GOAL.pose.position, GOAL.pose.orientation
    # The product of (-1, 0, 0, 0) as x y z w and the orientation.
    turned = ros.Quaternion(-q.w, q.z, -q.y, q.x)
    return ros.PoseStamped(ros.Header(stamp or ros.Time(), frame), ros.Pose(ros.Point(p.x - x, y - p.y, z - p.z), turned))


def values(status):
    return {pair.key: pair.value for pair in status.values}


def rejected(motions, why):
    """The report of a rejected goal, if the servo has published one with the given reason."""
    reports = (values(report) for report in take(motions))
    return next((report for report in reports if report["outcome"] == "rejected" and why in report["why"]), None)


def case_framed_goals():
    """Goals in TF frames: unknown frames are rejected by name. Goals in a static frame, and in a moving frame at its stamp, are
    reached."""
    statuses, poses = reader("dq_servo/status", ros.DiagnosticStatus), reader("dq_servo/current_pose", ros.PoseStamped)
    motions = reader("dq_servo/motions", ros.DiagnosticStatus)
    goals, tf = writer("goal_pose", ros.PoseStamped), writer("tf", ros.TFMessage)
    tf_static = DataWriter(PARTICIPANT, Topic(PARTICIPANT, "rt/tf_static", ros.TFMessage), qos=LATCHED)
    tf_static.write(transform("table", 0.3, 0.1, -0.2))
    for entity in goals, tf, tf_static:
        wait_matched(entity)
    begin = wait("a pose", lambda: last(poses)).pose.position

    def rejection(stamp, *parts):
        report = wait(f"the rejection of {stamp}", lambda: rejected(motions, parts[0]))
        assert report["goal_stamp"] == f"{stamp}.000000000" and all(part in report["why"] for part in parts), report

    goals.write(goal_seen_from("map", 0.0, 0.0, 0.0, ros.Time(7, 0)))
    rejection(7, 'frame_id is "map", not "base_link"', 'TF has no frame "map"')
    tf.write(transform("camera", 0.0, 0.0, 0.5, ros.Time(1000, 0)))
    time.sleep(0.3)
    goals.write(goal_seen_from("camera", 0.0, 0.0, 0.5, ros.Time(900, 0)))
    rejection(900, '100.000 s before the oldest transform of "camera"')
    goals.write(goal_seen_from("camera", 0.0, 0.0, 0.5, ros.Time(1001, 0)))
    rejection(1001, '1.000 s after the newest transform of "camera"')
    assert apart(wait("a pose", lambda: last(poses)).pose.position, begin) < 1e-9, "nothing has moved"

    goals.write(goal_seen_from("table", 0.3, 0.1, -0.2))
    wait("settled at the table's", lambda: (s := last(statuses)) and s.message == "settled")
    wait("the pose there", lambda: (p := last(poses)) and distance(p) < 1.1e-3)
    arrived = wait("its motion", lambda: next((s for s in take(motions) if values(s)["outcome"] == "arrived"), None))
    assert arrived.message.startswith("arrived in ") and values(arrived)["goal_frame"] == "table", arrived
    # A goal 0.15 s from now waits for its transform. Its pose follows from the camera's pose halfway between two transforms.
    now = time.time_ns()
    tf.write(transform("camera", 0.0, 0.0, 0.5, as_time(now)))
    goals.write(goal_seen_from("camera", 0.05, 0.0, 0.55, as_time(now + 150_000_000)))
    time.sleep(0.1)
    tf.write(transform("camera", 0.0, 0.1, 0.5, as_time(now + 300_000_000)))
    # The camera was at (0, 0.05, 0.5) then: the goal is 0.05 m before GOAL in x and z, and 0.05 m beyond it in y.
    g = GOAL.pose.position
    there = ros.Point(g.x - 0.05, g.y + 0.05, g.z - 0.05)
    wait("the goal by the camera", lambda: (p := last(poses)) and apart(p.pose.position, there) < 1.1e-3)
    # A goal in the base frame replaces one that waits.
    goals.write(goal_seen_from("camera", 0.0, 0.0, 0.5, as_time(now + 600_000_000)))
    goals.write(GOAL)
    tf.write(transform("camera", 0.0, 0.0, 0.5, as_time(now + 900_000_000)))
    wait("the goal in the base frame", lambda: (p := last(poses)) and distance(p) < 1.1e-3)
    status = wait("settled there", lambda: (s := last(statuses)) and s.message == "settled" and s)
    assert values(status)["rejected"] == "3", status
    del goals, tf_static


def case_late_table(milliseconds):
    """Publishes the position of the table with the given delay after each goal in its frame, until the process is ended."""
    goals, tf = reader("goal_pose", ros.PoseStamped), writer("tf", ros.TFMessage)
    while True:
        goal = wait("a goal", lambda: next((g for g in take(goals) if g.header.frame_id == "table"), None))
        time.sleep(milliseconds / 1e3)
        # Around the goal's stamp, and once more for later lookups.
        at = goal.header.stamp.sec * 10**9 + goal.header.stamp.nanosec
        for moment in at - 10**9, at + 10**9, time.time_ns() + 10**9:
            tf.write(transform("table", 0.3, 0.1, -0.2, as_time(moment)))


def peer_whose_goals_follow_their_frames():
    """What it receives from the servo (statuses and poses) and what it sends (goals and TF)."""
    statuses, poses = reader("dq_servo/status", ros.DiagnosticStatus), reader("dq_servo/current_pose", ros.PoseStamped)
    goals, tf = writer("goal_pose", ros.PoseStamped), writer("tf", ros.TFMessage)
    for entity in goals, tf:
        wait_matched(entity)
    set_parameter("dq_servo", "frame_mode", "follow")
    return statuses, poses, goals, tf


def case_followed_goal():
    """A goal moves with its frame at 0.05 m/s, published at 50 Hz: the tool follows it, holds while the frame is lost, and continues."""
    statuses, poses, goals, tf = peer_whose_goals_follow_their_frames()
    g, began = GOAL.pose.position, time.monotonic()

    def told(y):
        tf.write(transform("cup", 0.0, y, 0.5, as_time(time.time_ns())))
        time.sleep(0.02)

    told(0.0)
    goals.write(goal_seen_from("cup", 0.0, 0.0, 0.5))
    wait("settled", lambda: told(0.0) or (s := last(statuses)) and s.message == "settled")
    count = values(wait("a status", lambda: last(statuses)))["goal_count"]
    began, lags = time.monotonic(), []
    while (passed := time.monotonic() - began) < 5.0:
        told(0.05 * passed)
        pose = last(poses)
        if pose and passed > 4.0:
            lags.append(0.05 * (time.monotonic() - began) - (pose.pose.position.y - g.y))
    # The law alone at 1 1/s would lag by 50 mm then.
    assert lags and abs(sum(lags) / len(lags)) < 0.015, lags
    assert last(statuses).message == "tracking"
    lost = wait("the loss", lambda: next((s for s in take(statuses) if s.message == "stale_goal"), None))
    assert "TF no longer has the goal's frame" in values(lost)["reason"], lost
    end = 0.05 * passed
    wait("settled again", lambda: told(end) or (s := last(statuses)) and s.message == "settled")
    pose = wait("a pose", lambda: last(poses)).pose.position
    assert apart(pose, ros.Point(g.x, g.y + end, g.z)) < 2.1e-3, pose
    status = wait("a status", lambda: last(statuses))
    assert (values(status)["goal_count"], values(status)["rejected"]) == (count, "0"), status
    tool = goal_seen_from("tool0", 0.0, 0.0, 0.0)
    motions = reader("dq_servo/motions", ros.DiagnosticStatus)
    wait("the tool's refusal", lambda: goals.write(tool) or time.sleep(0.2) or rejected(motions, "moves with the tool"))
    goals.write(GOAL)
    wait("a goal in the base frame", lambda: (p := last(poses)) and distance(p) < 1.1e-3)
    told(0.3)
    time.sleep(0.5)
    assert distance(wait("a pose", lambda: last(poses))) < 1.1e-3, "the frame has no goal any more"
    del goals


def case_waiting_goals():
    """Goals whose frames become known only after a stop or a jump of the robot are rejected by name. The current one continues to follow
    its frame."""
    statuses, poses, goals, tf = peer_whose_goals_follow_their_frames()
    motions = reader("dq_servo/motions", ros.DiagnosticStatus)
    set_parameter("dq_servo", "tf_timeout", 1.5)

    def follows(y):
        told = lambda: tf.write(transform("cup", 0.0, y, 0.5, as_time(time.time_ns()))) or time.sleep(0.02)
        there = ros.Point(GOAL.pose.position.x, GOAL.pose.position.y + y, GOAL.pose.position.z)
        wait("the goal by the cup", lambda: told() or (p := last(poses)) and apart(p.pose.position, there) < 1.1e-3)

    def trigger(node, service):
        assert call(node, service, ros.TRIGGER, True, structure_needs_at_least_one_member=0).success

    def overtaken(frame, by, name, why):
        goals.write(goal_seen_from(frame, 0.0, 0.0, 0.5))
        time.sleep(0.1)
        by()
        # If the frame arrived before the revocation, the goal would be in force, and revoked instead of rejected.
        wait("the revocation", lambda: (s := last(statuses)) and values(s).get("revoked_by") == name)
        tf.write(transform(frame, 0.0, 0.0, 0.5, as_time(time.time_ns())))
        wait("the rejection", lambda: rejected(motions, why))

    goals.write(goal_seen_from("cup", 0.0, 0.0, 0.5))
    follows(0.0)
    overtaken("shelf", lambda: trigger("dq_servo", "stop"), "stop", "~/stop was called")
    # A stream whose frame is unknown has not paused.
    for _ in range(20):
        goals.write(goal_seen_from("nowhere", 0.0, 0.0, 0.5))
        time.sleep(0.1)
    take(motions)
    # Only the last rejection of a publisher is reported, so this goal is repeated until the others have waited long enough.
    repeated = lambda: goals.write(GOAL) or time.sleep(0.1) or rejected(motions, "~/stop was called")
    wait("the rejection of a stream", repeated)
    time.sleep(1.6)  # What goes on after a stop asks for nothing.
    goals.write(goal_seen_from("cup", 0.0, 0.0, 0.5))
    follows(0.05)
    overtaken("rack", lambda: trigger("puma560", "reset"), "robot_jumped", "came back elsewhere")
    # If a stream was revoked, ~/pause (false) is refused. A goal whose frame is lost continues to stream.
    until = time.time() + 1.6
    while time.time() < until:
        tf.write(transform("cup", 0.0, 0.05, 0.5, as_time(time.time_ns())))
        time.sleep(0.02)
    answer = call("dq_servo", "pause", ros.SET_BOOL, True, data=False)
    assert answer.success, answer.message
    follows(0.1)
    del goals


def case_jog():
    """A twist moves the tool along z while it is sent, and the status shows that. Then the arm holds, and a goal is accepted again."""
    statuses, states = reader("dq_servo/status", ros.DiagnosticStatus), reader("joint_states", ros.JointState)
    poses = reader("dq_servo/current_pose", ros.PoseStamped)
    wait("holding", lambda: (s := last(statuses)) and s.message == "holding")
    begin = wait("a pose", lambda: last(poses)).pose.position
    twists = writer("dq_servo/target_twist", ros.TwistStamped)
    wait_matched(twists)
    twist = ros.Twist(ros.Vector3(0.0, 0.0, 0.05), ros.Vector3(0.0, 0.0, 0.0))
    rules = lambda status: {pair.key: pair.value for pair in status.values}["input"]
    seen, started = set(), time.time()
    for _ in range(100):
        twists.write(ros.TwistStamped(ros.Header(frame_id="base_link"), twist))
        time.sleep(0.02)
        seen |= {(status.message, rules(status)) for status in take(statuses)}
    jogged = time.time() - started
    assert ("jogging", "twist") in seen, seen
    wait("the end", lambda: (s := last(statuses)) and s.message == "holding" and rules(s) == "none")
    wait("a standstill", lambda: (s := last(states)) and not any(s.velocity))
    time.sleep(0.3)
    end = wait("a pose", lambda: last(poses)).pose.position
    assert 0.05 < end.z - begin.z < 0.05 * jogged + 0.02, (begin, end, jogged)
    goals = send_goal()
    moving(states)
    assert call("dq_servo", "stop", ros.TRIGGER, True, structure_needs_at_least_one_member=0).success
    wait("holding again", lambda: (s := last(statuses)) and s.message == "holding")
    del goals


def case_wrench():
    """The frame of a wrist sensor is in TF, 0.1 m along x of the tool, once the sensor publishes. A goal in force yields to it."""
    statuses = reader("dq_servo/status", ros.DiagnosticStatus)
    wrenches = writer("wrench", ros.WrenchStamped)
    tf_static = DataWriter(PARTICIPANT, Topic(PARTICIPANT, "rt/tf_static", ros.TFMessage), qos=LATCHED)
    for entity in wrenches, tf_static:
        wait_matched(entity, 1)
    set_parameter("dq_servo", "contact.compliance", True)

    def felt(key, force):
        """The value in the status, while the sensor reports this force along z [N]."""
        # A sensor that repeats one number while the tool moves would count as frozen.
        wrench = ros.Wrench(ros.Vector3(0.0, 0.0, force + 1e-7 * (time.time() % 1.0)), ros.Vector3(0.0, 0.0, 0.0))
        wrenches.write(ros.WrenchStamped(ros.Header(as_time(time.time_ns()), "ft_sensor"), wrench))
        time.sleep(0.005)
        status = last(statuses)
        return status and float(values(status).get(key, "nan"))

    for _ in range(50):
        assert felt("contact_force_n", 20.0) in (None, 0.0), "TF does not have the frame yet"
    mount = ros.Transform(ros.Vector3(0.1, 0.0, 0.0), ros.Quaternion(0.0, 0.0, 0.0, 1.0))
    tf_static.write(ros.TFMessage([ros.TransformStamped(ros.Header(ros.Time(), "tool0"), "ft_sensor", mount)]))
    wait("the wrench at the tool", lambda: (torque := felt("contact_torque_nm", 11.0)) and abs(torque - 1.1) < 1e-6)
    goals = send_goal()
    wait("the goal to yield by 10 N at 500 N/m", lambda: (far := felt("yielded_m", 11.0)) and abs(far - 0.02) < 2e-4)
    wait("the sensor's silence to be noticed", lambda: (s := last(statuses)) and s.message == "stale_wrench")
    del goals, tf_static


def case_speed_scaling():
    """The speed that the robot reports, in percent or as a fraction, is the speed_factor while it is reported. The arm arrives."""
    statuses = reader("dq_servo/status", ros.DiagnosticStatus)
    scaling = writer("speed_scaling_state_broadcaster/speed_scaling", ros.Float64)
    wait_matched(scaling, 1)
    goals = send_goal()
    for told, factor in ((20.0, 0.2), (0.5, 0.5)):
        says = lambda: scaling.write(ros.Float64(told)) or (s := last(statuses)) and float(values(s)["speed_factor"]) == factor
        wait("the factor", says)
    wait("the measured factor", lambda: (s := last(statuses)) and float(values(s)["speed_factor"]) > 0.5)
    wait("settled", lambda: (s := last(statuses)) and s.message == "settled")
    del goals


def case_unheard():
    """The peer is silent for longer than its lease: the servo, which has received a goal from it, logs that and ends when the peer is
    back."""
    states, statuses = reader("joint_states", ros.JointState), reader("dq_servo/status", ros.DiagnosticStatus)
    goals = send_goal()
    moving(states)
    assert call("dq_servo", "stop", ros.TRIGGER, True, structure_needs_at_least_one_member=0).success
    wait("a standstill", lambda: (s := last(states)) and not any(s.velocity))
    pid = os.getpid()
    subprocess.run(["sh", "-c", f"kill -STOP {pid}; sleep 6; kill -CONT {pid}"], check=True)
    time.sleep(0.5)
    wait("the end of the servo", lambda: goals.get_publication_matched_status().current_count == 0)


def case_simulated_time():
    """Stamps follow /clock, including its jumps. The arm still reaches its goal."""
    states, poses = reader("joint_states", ros.JointState), reader("dq_servo/current_pose", ros.PoseStamped)
    statuses, clock = reader("dq_servo/status", ros.DiagnosticStatus), writer("clock", ros.Clock)
    state = wait("a joint state", lambda: last(states))
    assert (state.header.stamp.sec, state.header.stamp.nanosec) == (0, 0), "no clock yet"
    wait("holding", lambda: (s := last(statuses)) and s.message == "holding")
    wait_matched(clock)
    time.sleep(0.3)
    goals = send_goal()
    moving(states)
    # The clock goes on from there at half speed, jumps ahead, stands still, and jumps back to the start.
    for begin, speed in ((1000.0, 0.5), (90000.0, 1.0), (90001.0, 0.0), (10.0, 2.0)):
        since = time.monotonic()
        while (passed := time.monotonic() - since) < 0.7:
            now = begin + speed * passed
            clock.write(ros.Clock(ros.Time(int(now), int(now % 1 * 1e9))))
            time.sleep(0.01)
        for source in states, poses:
            stamp = wait("a message", lambda: last(source)).header.stamp
            assert abs(stamp.sec + 1e-9 * stamp.nanosec - now) < 0.5, (stamp, now)
        assert wait("a status", lambda: last(statuses)).message in ("tracking", "settled")
    wait("settled", lambda: (s := last(statuses)) and s.message == "settled")
    # The simulation restarts five seconds earlier. The camera's poses from before the restart do not count.
    tf = writer("tf", ros.TFMessage)
    wait_matched(tf)
    for begin, y in ((20.0, 0.1), (15.0, 0.0)):
        for i in range(50):
            now = as_time(int(1e9 * begin) + 10_000_000 * i)
            clock.write(ros.Clock(now))
            tf.write(transform("camera", 0.0, y, 0.5, now))
            time.sleep(0.01)
    goals.write(goal_seen_from("camera", 0.0, -0.05, 0.5))
    g = GOAL.pose.position
    there = ros.Point(g.x, g.y + 0.05, g.z)
    wait("settled by the camera", lambda: (s := last(statuses)) and s.message == "settled"
         and (p := last(poses)) and apart(p.pose.position, there) < 1.1e-3)
    del goals


def case_simulated_table():
    """A clock that began long ago, and a table that moves by it, until the host ends."""
    clock, tf = writer("clock", ros.Clock), writer("tf", ros.TFMessage)
    begun = time.monotonic()
    while True:
        now = as_time(int(1e9 * (1000.0 + time.monotonic() - begun)))
        clock.write(ros.Clock(now))
        tf.write(transform("table", 0.1, 0.0, 0.0, now))
        time.sleep(0.01)


def case_dual():
    """Two arms: a relative goal, the four primitives and both forms by parameter, and a stop during a motion. The limits hold for both
    arms."""
    statuses, poses = reader("dq_dual_servo/status", ros.DiagnosticStatus), reader("dq_dual_servo/current_pose", ros.PoseStamped)
    arms = ("left", "right")
    commands = [reader(f"{arm}/forward_velocity_controller/commands", ros.Float64MultiArray, EVERY) for arm in arms]
    states = [reader(f"{arm}/joint_states", ros.JointState) for arm in arms]
    transforms = reader("tf", ros.TFMessage)
    wait("holding", lambda: (s := last(statuses)) and s.message == "holding")
    pose = wait("a pose", lambda: last(poses))
    assert pose.header.frame_id == "left/tool0", pose
    goals = writer("relative_goal", ros.PoseStamped)
    wait_matched(goals)
    p, seen = pose.pose.position, [[], []]

    def settled(primitive):
        for kept, source in zip(seen, commands):
            kept += take(source)
        status = last(statuses)
        values = {pair.key: pair.value for pair in status.values} if status else {}
        return status and status.message == "settled" and values["primitive"] == primitive

    for number, primitive in enumerate(("relative_position", "relative_orientation", "relative_distance", "relative_pose")):
        set_parameter("dq_dual_servo", "primitive", primitive)
        set_parameter("dq_dual_servo", "controller", ("transpose", "damped_inverse")[number % 2])
        shift = 0.03 * (number + 1)
        point = ros.Point(p.x + shift, p.y - shift, p.z + shift)
        goals.write(ros.PoseStamped(ros.Header(frame_id="left/tool0"), ros.Pose(point, pose.pose.orientation)))
        time.sleep(0.3)  # The settled of the goal before must not be taken for this one's.
        take(statuses)
        wait(f"settled with {primitive}", lambda: settled(primitive))
    now = wait("a pose", lambda: last(poses)).pose.position
    assert max(abs(now.x - p.x - 0.12), abs(now.y - p.y + 0.12), abs(now.z - p.z - 0.12)) < 1.1e-3, now
    for kept in seen:
        steps = [abs(b - a) for x, y in zip(kept, kept[1:]) for a, b in zip(x.data, y.data)]
        assert len(kept) > 500 and 0 < max(steps) <= 50 * 0.002 * 1.000001, (len(kept), max(steps))
    frames = {t.child_frame_id for message in take(transforms) for t in message.transforms}
    assert {"left/link1", "right/link6"} <= frames, frames
    goals.write(ros.PoseStamped(ros.Header(frame_id="map"), pose.pose))
    rejected = lambda s: int({pair.key: pair.value for pair in s.values}["rejected"])
    wait("a rejection", lambda: (s := last(statuses)) and rejected(s) == 1)
    goals.write(ros.PoseStamped(ros.Header(), pose.pose))
    wait("motion of both", lambda: all((s := last(source)) and max(map(abs, s.velocity)) > 0.02 for source in states))
    assert call("dq_dual_servo", "stop", ros.TRIGGER, True, structure_needs_at_least_one_member=0).success
    wait("a standstill", lambda: all((s := last(source)) and not any(s.velocity) for source in states))
    wait("holding", lambda: (s := last(statuses)) and s.message == "holding")
    del goals


def case_one_topic():
    """The joint states of two arms in one message on one topic, as a robot with two arms publishes them."""
    states = [reader(f"{arm}/joint_states", ros.JointState) for arm in ("left", "right")]
    out = writer("joint_states", ros.JointState)
    while True:
        left, right = (wait("a joint state", lambda: last(source)) for source in states)
        out.write(
            ros.JointState(
                right.header, left.name + right.name, list(left.position) + list(right.position),
                list(left.velocity) + list(right.velocity), [],
            )
        )


def case_services():
    """Pause, stop and reset answer and take effect."""
    statuses, states = reader("dq_servo/status", ros.DiagnosticStatus), reader("joint_states", ros.JointState)
    start = wait("a joint state", lambda: last(states)).position
    goals = send_goal()
    moving(states)
    assert call("dq_servo", "stop", ros.TRIGGER, True, structure_needs_at_least_one_member=0).success
    wait("holding", lambda: (s := last(statuses)) and s.message == "holding")
    assert call("puma560", "reset", ros.TRIGGER, False, structure_needs_at_least_one_member=0).success
    wait("the start", lambda: (s := last(states)) and s.position == start and not any(s.velocity))
    del goals


def case_counter():
    """The example node of dq_ros works with clients of both vendors: a topic, a parameter and a service."""
    counts = reader("count", ros.String)
    wait_matched(counts)
    def counted():
        return int(wait("a count", lambda: last(counts)).data)
    first = counted()
    assert counted() == first + 1
    for cyclone, step in ((True, 3), (False, 5)):
        parameter = ros.Parameter("step", ros.ParameterValue(type=2, integer_value=step))
        result = call("counter", "set_parameters", ros.SET_PARAMETERS, cyclone, parameters=[parameter]).results[0]
        assert result.successful, result
        take(counts)
        before = counted()
        assert counted() == before + step
    assert call("counter", "reset", ros.TRIGGER, False, structure_needs_at_least_one_member=0).success
    wait("a count from 0 on", lambda: any(int(sample.data) == 0 for sample in take(counts)))


def case_pictures():
    """Markers, path and the interactive marker of the goal have the form that RViz expects. Dragging the marker moves the arm there."""
    markers, paths = reader("dq_servo/markers", ros.MarkerArray), reader("dq_servo/path", ros.Path)
    updates, heard = reader("dq_servo/goal/update", ros.InteractiveMarkerUpdate, EVERY), reader("goal_pose", ros.PoseStamped)
    statuses, poses = reader("dq_servo/status", ros.DiagnosticStatus), reader("dq_servo/current_pose", ros.PoseStamped)
    at_rest = {m.ns: m for m in wait("markers", lambda: last(markers)).markers}
    assert at_rest["goal"].action == 2 and at_rest["tool"].action == 0, "no goal yet, but a tool"
    goals = send_goal()
    wait("settled", lambda: (s := last(statuses)) and s.message == "settled")
    last(markers), last(paths)
    seen = {m.ns: m for m in wait("markers", lambda: last(markers)).markers}
    assert sorted(seen) == ["closest", "frames", "goal", "path", "tool"], seen
    assert seen["closest"].action == 2, "there is nothing to keep out of"
    goal, way = seen["goal"], seen["path"]
    assert (goal.header.frame_id, goal.type, goal.action, len(goal.points), len(goal.colors)) == ("base_link", 5, 0, 6, 6), goal
    assert goal.frame_locked and apart(goal.points[0], GOAL.pose.position) < 1e-9 and goal.pose.orientation.w == 1.0, goal
    assert way.type == 4 and len(way.points) > 5 and len(seen["frames"].points) > 12, (len(way.points), seen["frames"])
    path = wait("a path", lambda: last(paths))
    assert path.header.frame_id == "base_link" and [p.pose.position for p in path.poses] == way.points, path
    assert distance(path.poses[-1]) < 5e-3 and distance(path.poses[0]) > 0.2, path.poses[-1]

    for cyclone in True, False:
        known = call("dq_servo/goal", "get_interactive_markers", ros.GET_INTERACTIVE_MARKERS, cyclone,
                     structure_needs_at_least_one_member=0)
        (marker,) = known.markers
        assert (known.server_id, marker.header.frame_id, marker.name) == ("/dq_servo", "base_link", "goal"), known
        assert apart(marker.pose.position, GOAL.pose.position) < 1e-9 and marker.scale > 0.1, marker
        assert sorted(control.interaction_mode for control in marker.controls) == [3, 3, 3, 5, 5, 5], marker
    numbers = [update.seq_num for update in take(updates)]
    assert numbers == list(range(numbers[0], known.updates + 1)), (numbers, known.updates)

    take(heard)
    hand, pose = writer("dq_servo/goal/feedback", ros.InteractiveMarkerFeedback), GOAL.pose
    wait_matched(hand)
    time.sleep(0.2)  # The server must have matched the writer too, which nothing here can see.
    pose.position.z += 0.05
    for event in 4, 1, 5:  # down, dragged, up
        hand.write(ros.InteractiveMarkerFeedback(ros.Header(frame_id="base_link"), "rviz", "goal", "move_z", event, pose))
    sent = wait("the goal on goal_pose", lambda: last(heard))
    assert sent.pose == pose and sent.header.frame_id == "base_link", sent
    wait("the arm at the dragged goal", lambda: (p := last(poses)) and distance(p) < 1.1e-3)
    del goals


def solid(ns, id, kind, x, y, z, size, **fields):
    """A marker with its centre at the given position."""
    pose = ros.Pose(ros.Point(x, y, z), ros.Quaternion(0.0, 0.0, 0.0, 1.0))
    fields.setdefault("header", ros.Header(frame_id="base_link"))
    return ros.Marker(ns=ns, id=id, type=kind, pose=pose, scale=ros.Vector3(*size), **fields)


def case_keep_out():
    """Markers of two publishers are used, also in TF frames. Only invalid markers are rejected. The arm waits until all markers are
    gone."""
    markers, statuses = reader("dq_servo/markers", ros.MarkerArray), reader("dq_servo/status", ros.DiagnosticStatus)
    one, other = writer("dq_servo/keep_out", ros.MarkerArray), writer("dq_servo/keep_out", ros.MarkerArray)
    tf = writer("tf", ros.TFMessage)
    for entity in one, other, tf:
        wait_matched(entity)
    time.sleep(0.2)

    def obeyed():
        array = last(markers)
        return array and [m for m in array.markers if m.ns == "keep_out" and m.action == 0]

    def wait_obeyed(what, expected):
        """The type, the position of the centre and the length along z of each marker."""
        def seen():
            now = obeyed()
            places = now is not None and [(m.type, *(round(c, 3) for c in vars(m.pose.position).values()), m.scale.z) for m in now]
            return places == expected
        wait(what, seen)

    cube = solid("a table", 1, 1, 0.9, 0.0, 0.0, (0.2, 0.3, 0.4))
    bad = [
        solid("bad", 1, 1, 0.9, float("nan"), 0.0, (0.2, 0.3, 0.4)),
        solid("bad", 2, 9, 0.9, 0.0, 0.0, (0.2, 0.3, 0.4)),
        solid("bad", 3, 2, 0.9, 0.0, 0.0, (0.2, 0.3, 0.4)),
        solid("bad", 4, 1, 0.9, 0.0, 0.0, (0.2, -0.3, 0.4)),
        solid("bad", 5, 1, 0.9, 0.0, 0.0, (0.2, 0.3, 0.4), action=7),
        solid("bad", 6, 1, 0.9, 0.0, 0.0, (0.2, 0.3, 0.4), header=ros.Header(frame_id="nowhere")),
    ]
    one.write(ros.MarkerArray(bad + [cube]))
    wait_obeyed("the table", [(1, 0.9, 0.0, 0.0, 0.4)])
    # In a frame that becomes known later, and moves.
    other.write(ros.MarkerArray([solid("hand", 1, 2, 0.1, 0.0, 0.0, (0.2, 0.2, 0.2), header=ros.Header(frame_id="hand"), frame_locked=True)]))
    tf.write(transform("hand", 0.8, 0.5, 0.5, as_time(time.time_ns())))
    wait_obeyed("the hand", [(1, 0.9, 0.0, 0.0, 0.4), (2, 0.9, 0.5, 0.5, 0.2)])
    tf.write(transform("hand", 0.8, 0.6, 0.5, as_time(time.time_ns())))
    wait_obeyed("the hand elsewhere", [(1, 0.9, 0.0, 0.0, 0.4), (2, 0.9, 0.6, 0.5, 0.2)])
    not_obeyed = lambda: (s := last(statuses)) and values(s).get("keep_outs_not_obeyed", "")
    wait("a silent hand", lambda: "frame \"hand\"" in (not_obeyed() or ""))
    # Setting all parameters does not remove drawn keep-outs.
    set_parameter("dq_servo", "controller", "logc")
    corners = [ros.Point(*c) for c in [(0.0, 0.0, 0.0), (0.2, 0.0, 0.0), (0.0, 0.2, 0.0), (0.0, 0.0, 0.2)]]
    faces = [corners[i] for i in (0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3)]
    one.write(ros.MarkerArray([solid("tent", 1, 11, 0.9, -0.5, 0.0, (1.0, 1.0, 2.0), points=faces)]))
    table_and_hand = [(1, 0.9, 0.0, 0.0, 0.4), (2, 0.9, 0.6, 0.5, 0.2)]
    tent = wait("the tent", lambda: (now := obeyed()) and len(now) == 3 and now[2])
    drawn = {(round(p.x, 3), round(p.y, 3), round(p.z, 3)) for p in tent.points}
    assert tent.type == 11 and len(tent.points) == 12 and drawn == {(0.9, -0.5, 0.0), (1.1, -0.5, 0.0), (0.9, -0.3, 0.0), (0.9, -0.5, 0.4)}, drawn
    one.write(ros.MarkerArray([solid("tent", 1, 0, 0.0, 0.0, 0.0, (0.0, 0.0, 0.0), action=2)]))
    wait_obeyed("no tent", table_and_hand)
    other.write(ros.MarkerArray([solid("a table", 1, 0, 0.0, 0.0, 0.0, (0.0, 0.0, 0.0), action=2)]))
    wait_obeyed("the hand alone", [(2, 0.9, 0.6, 0.5, 0.2)])
    brief = solid("brief", 1, 3, 0.9, 0.0, 0.0, (0.2, 0.2, 0.4), lifetime=ros.Duration(4, 0))
    one.write(ros.MarkerArray([brief]))
    wait_obeyed("a cylinder", [(2, 0.9, 0.6, 0.5, 0.2), (3, 0.9, 0.0, 0.0, 0.4)])
    wait_obeyed("its end", [(2, 0.9, 0.6, 0.5, 0.2)])
    one.write(ros.MarkerArray([solid("many", i, 2, 0.9, 0.01 * i, 0.0, (0.1, 0.1, 0.1)) for i in range(5000)]))
    wait("as many as may be", lambda: (now := obeyed()) and len(now) == 64)
    # The goal is inside a ball.
    p = GOAL.pose.position
    one.write(ros.MarkerArray([ros.Marker(action=3), solid("ball", 1, 2, p.x, p.y, p.z, (0.1, 0.1, 0.1))]))
    wait_obeyed("the ball", [(2, round(p.x, 3), round(p.y, 3), round(p.z, 3), 0.1)])
    set_parameter("dq_servo", "constraints", False)
    wait("idle", lambda: "constraints is false" in (not_obeyed() or ""))
    set_parameter("dq_servo", "constraints", True)
    wait("not idle", lambda: not_obeyed() == "")
    goals = send_goal()
    status = wait("constrained", lambda: (s := last(statuses)) and s.message == "constrained" and s)
    assert "ball/1" in values(status)["reason"], status
    other.write(ros.MarkerArray([ros.Marker(action=3)]))
    wait("settled", lambda: (s := last(statuses)) and s.message == "settled")
    del goals


def case_serve():
    """A node of another vendor with one parameter. Answers as rmw_cyclonedds does, until it is ended."""
    request, response = ros.GET_PARAMETERS[2:]
    calls = DataReader(PARTICIPANT, Topic(PARTICIPANT, "rq/other/get_parametersRequest", request), qos=RELIABLE)
    replies = DataWriter(PARTICIPANT, Topic(PARTICIPANT, "rr/other/get_parametersReply", response), qos=RELIABLE)
    while True:
        call_ = wait("a call", lambda: last(calls))
        values = [ros.ParameterValue(type=3, double_value=1.5) for _ in call_.names]
        replies.write(response(client=call_.client, sequence_number=call_.sequence_number, values=values))


def case_record_me():
    """Publishes for a recorder that starts later, until it is ended: best effort, transient local, and with an unknown type."""
    best_effort = Qos(Policy.Reliability.BestEffort, Policy.Durability.Volatile)
    lossy = DataWriter(PARTICIPANT, Topic(PARTICIPANT, "rt/lossy", ros.String), qos=best_effort)
    latched = DataWriter(PARTICIPANT, Topic(PARTICIPANT, "rt/latched", ros.String), qos=LATCHED)
    kind = ros.make_idl_struct("Strange", "geometry_msgs.msg.dds_.Strange_", {"x": ros.uint8})
    strange = DataWriter(PARTICIPANT, Topic(PARTICIPANT, "rt/strange", kind), qos=RELIABLE)
    latched.write(ros.String("before"))
    while True:
        lossy.write(ros.String("x"))
        strange.write(kind(1))
        time.sleep(0.05)


def case_large():
    """Sends five hundred messages of 1 MB to a running recorder."""
    large = DataWriter(PARTICIPANT, Topic(PARTICIPANT, "rt/large", ros.String), qos=RELIABLE)
    wait("a recorder", large.get_matched_subscriptions)
    text = ros.String("x" * (1 << 20))
    for _ in range(500):
        large.write(text)
        time.sleep(0.03)


def case_type(kind):
    """Publishes under one name with the first or the second type."""
    kind, value = [(ros.String, ros.String("x")), (ros.Float64MultiArray, ros.Float64MultiArray(data=[1.0]))][kind]
    writer = DataWriter(PARTICIPANT, Topic(PARTICIPANT, "rt/changing", kind), qos=RELIABLE)
    for _ in range(40):
        writer.write(value)
        time.sleep(0.05)


def case_hear_goal():
    """Subscribes before a goal is sent, and receives it."""
    goals = reader("goal_pose", ros.PoseStamped)
    print("listening", flush=True)
    goal = wait("a goal", lambda: last(goals))
    assert goal.pose.position.x == -0.125, goal


def case_as_rclcpp():
    """Writers of logs and of parameter changes have the settings of rclcpp. Beside the latter ros2-client creates a latched one."""
    found = BuiltinDataReader(PARTICIPANT, BuiltinTopicDcpsPublication)
    subscriptions = BuiltinDataReader(PARTICIPANT, BuiltinTopicDcpsSubscription)
    publications = {}

    def complete():
        publications.update((str(p.key), p) for p in found.take(1000) if p.topic_name in ("rt/parameter_events", "rt/rosout"))
        return len(publications) >= 6
    wait("servo's and plant's writers", complete)
    time.sleep(1.0)
    complete()
    of = lambda topic: [p.qos for p in publications.values() if p.topic_name == topic]
    assert sorted(qos[Policy.Durability] == Policy.Durability.Volatile for qos in of("rt/parameter_events")) == [False, False, True, True]
    for qos in of("rt/parameter_events"):
        assert isinstance(qos[Policy.Reliability], type(RELIABLE[Policy.Reliability])), qos
    for qos in of("rt/rosout"):
        assert qos[Policy.Durability] == Policy.Durability.TransientLocal and qos[Policy.Lifespan].lifespan == duration(seconds=10), qos
    assert [len(of("rt/parameter_events")), len(of("rt/rosout"))] == [4, 2], publications
    # If each node subscribed, all nodes would be matched with each other, for messages that none of them reads.
    subscribed = {s.topic_name: s.qos for s in subscriptions.take(1000)}
    assert "rt/goal_pose" in subscribed and "rt/parameter_events" not in subscribed, subscribed
    # Every servo receives every arm's /tf: acknowledging it overloaded a host with 16 of them.
    assert subscribed["rt/tf"][Policy.Reliability] == Policy.Reliability.BestEffort, subscribed["rt/tf"]
    assert subscribed["rt/tf_static"][Policy.Reliability] != Policy.Reliability.BestEffort, subscribed["rt/tf_static"]
    assert set_controller("diffc", True).successful
    states = reader("dq_servo/parameters", ros.ParameterEvent, LATCHED)
    state = wait("parameters", lambda: last(states))
    value = {p.name: p.value.string_value for p in state.new_parameters}
    assert value["controller"] == "diffc" and len(value) > 30 and state.node == "/dq_servo", state
    assert [p.name for p in state.changed_parameters] == ["controller"], state
    assert set_controller("logc", True).successful
    later = wait("parameters", lambda: last(states))
    stamp = lambda event: (event.stamp.sec, event.stamp.nanosec)
    assert {p.name: p.value.string_value for p in later.new_parameters}["controller"] == "logc" and stamp(later) > stamp(state), later


def describe(cyclone, kind="sensor_msgs/msg/JointState", sources=True):
    hashes = {
        "sensor_msgs/msg/JointState": "RIHS01_a13ee3a330e346c9d87b5aa18d24e11690752bd33a0350f11c5882bc9179260e",
        "visualization_msgs/msg/MarkerArray": "RIHS01_86cb8800b6fb05b5eff1abd7a56f62a5641d3ae9a1c29e78e67e704f1d067dcf",
    }
    return call(
        "dq_servo", "get_type_description", ros.GET_TYPE_DESCRIPTION, cyclone,
        type_name=kind, type_hash=hashes[kind], include_type_sources=sources,
    )


def case_describe_types():
    """Types are described to the clients of both vendors, with their sources."""
    for cyclone in (True, False):
        answer = describe(cyclone)
        assert answer.successful, answer
        of = answer.type_description.type_description
        assert of.type_name == "sensor_msgs/msg/JointState" and [f.name for f in of.fields][1:3] == ["name", "position"], of
        assert [f.type.type_id for f in of.fields] == [1, 161, 155, 155, 155], of
        assert [s.type_name for s in answer.type_sources][0] == "sensor_msgs/msg/JointState", answer.type_sources


def case_describe_types_over_ethernet():
    """A description that is larger than a packet reaches the clients of both vendors."""
    for cyclone in (True, False):
        answer = describe(cyclone, "visualization_msgs/msg/MarkerArray")
        assert answer.successful and len(answer.type_sources) > 5, answer


def case_best_effort_robot():
    """A robot that publishes with best effort, until it is ended."""
    best_effort = Qos(Policy.Reliability.BestEffort, Policy.Durability.Volatile)
    states = DataWriter(PARTICIPANT, Topic(PARTICIPANT, "rt/joint_states", ros.JointState), qos=best_effort)
    position = [0.7853981633974483, 1.0471975511965976, 2.356194490192345, 0.5235987755982988, -0.7853981633974483, 2.0943951023931953]
    while True:
        stamp = time.time_ns()
        header = ros.Header(stamp=ros.Time(stamp // 10**9, stamp % 10**9))
        states.write(ros.JointState(header, [f"joint{i}" for i in range(1, 7)], position, [0.0] * 6))
        time.sleep(0.005)



def case_bulk_goals(count, length):
    """Sends the given number of goals as fast as they are accepted, in a frame whose name has the given length (0: the frame of the
    servo)."""
    goals = writer("goal_pose", ros.PoseStamped)
    wait_matched(goals)
    for number in range(count):
        point = ros.Point(-0.125, 0.2 + 1e-6 * (number % 1000), 0.2)
        header = ros.Header(frame_id="x" * length if length else "base_link")
        goals.write(ros.PoseStamped(header, ros.Pose(point, GOAL.pose.orientation)))
        # The servo takes at most a thousand messages per cycle; long ones arrive in many packets.
        if number % 20 == 0 or length:
            time.sleep(0.002)
    time.sleep(1.0)


def case_odd_description():
    """A robot description that only the lenient reader can parse."""
    topic = Topic(PARTICIPANT, "rt/robot_description", ros.String)
    descriptions = DataWriter(PARTICIPANT, topic, qos=LATCHED)
    wait_matched(descriptions)
    descriptions.write(ros.String("<robot>" + "&" * 4_100_000 + "</robot>"))
    time.sleep(1.0)


reader_of_description = reader("robot_description", ros.String, LATCHED)

if __name__ == "__main__":
    globals()[f"case_{sys.argv[1]}"](*map(int, sys.argv[2:]))
