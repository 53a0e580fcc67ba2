"""Faults that another vendor's DDS brings over the wire, and what servo and plant must do about each.
Usage: faults.py CASE OUT [ARGUMENT …]. Fails by an exception; leaves in OUT every command that the servo sent meanwhile."""
import os
import random
import signal
import struct
import subprocess
import sys
import time

sys.path.insert(0, os.path.join(os.path.dirname(__file__), "..", "dds"))
import peer
from peer import GOAL, PARTICIPANT, RELIABLE, last, reader, ros, send_goal, take, wait_matched, writer
from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration
import robot as spoilt
from robot import COMMANDS, Commands, Robot

FOLLOWED = []  # What is polled while a case waits.


def poll():
    for each in FOLLOWED:
        each.poll()


def wait(what, condition, seconds=20.0):
    """As the peer's, but everything that is followed is polled meanwhile. How long it took [s]."""
    begin = time.monotonic()
    while not condition():
        assert time.monotonic() < begin + seconds, f"{what}: not within {seconds} s; {STATUS.told()}"
        poll()
        time.sleep(0.001)
    return time.monotonic() - begin


def run(seconds):
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        poll()
        time.sleep(0.001)


class Status:
    """The newest ~/status, and how often each state was told of since `forget`."""

    def __init__(self):
        self.source, self.newest, self.states = reader("dq_servo/status", ros.DiagnosticStatus), None, []

    def poll(self):
        for self.newest in take(self.source):
            if self.states[-1:] != [self.newest.message]:
                self.states.append(self.newest.message)

    def values(self):
        return {pair.key: pair.value for pair in self.newest.values} if self.newest else {}

    def number(self, key):
        return float(self.values().get(key, "nan"))

    def told(self):
        return f"states {self.states}, {self.values()}"

    def is_(self, state):
        return self.newest is not None and self.newest.message == state


class Diagnostics:
    """The newest /diagnostics by name."""

    def __init__(self):
        self.source, self.by_name = reader("diagnostics", ros.DiagnosticArray), {}

    def poll(self):
        for array in take(self.source):
            self.by_name.update({status.name: status for status in array.status})

    def message(self, name):
        return self.by_name[name].message if name in self.by_name else ""

    def number(self, name, key):
        status = self.by_name.get(name)
        values = {pair.key: pair.value for pair in status.values} if status else {}
        return float(values.get(key, 0))


class States:
    """The newest joint state."""

    def __init__(self):
        self.source, self.newest = reader("joint_states", ros.JointState), None

    def poll(self):
        self.newest = last(self.source) or self.newest

    def speed(self):
        return max(map(abs, self.newest.velocity)) if self.newest else 0.0


SERVO, PLANT = "dq_servo: cycle", "puma560: commands"
SENT, STATUS, DIAGNOSTICS = Commands(), Status(), Diagnostics()
FOLLOWED += [SENT, STATUS, DIAGNOSTICS]


def moving():
    wait("motion", lambda: SENT.speed() > 0.3)


def standing(seconds=1.0):
    return wait("a command of zero", lambda: SENT.speed() == 0.0, seconds)


def settled(seconds=30.0):
    """Settled at GOAL, and told after this call began."""
    STATUS.newest = None
    wait("settled", lambda: STATUS.is_("settled") and at_goal(), seconds)


def at_goal():
    goal = STATUS.values().get("goal", "").split()
    return goal and abs(float(goal[0]) - GOAL.pose.position.x) < 1e-9


def robot_in_motion():
    robot = Robot(SENT)
    FOLLOWED.append(robot)
    goals = send_goal()
    moving()
    return robot, goals


def set_parameter(name, **value):
    parameter = ros.Parameter(name, ros.ParameterValue(**value))
    result = peer.call("dq_servo", "set_parameters", ros.SET_PARAMETERS, True, parameters=[parameter]).results[0]
    assert result.successful, result


# --- joint states, from a robot of ours ---


def case_stale(spoil, reason=""):
    """Spoilt so that nothing can be taken: stale_state, at rest within the timeout and as long again; then it arrives."""
    robot, goals = robot_in_motion()
    robot.spoil = getattr(spoilt, spoil)
    begin = time.monotonic()
    wait("stale_state", lambda: STATUS.is_("stale_state"), 1.0)
    standing()
    assert time.monotonic() - begin < 0.6, "state_timeout 0.1 s, deceleration 0.1 s, and a machine that others use too"
    if reason:
        assert STATUS.number("rejected") > 0 and reason in STATUS.values()["last_rejection"], STATUS.told()
        wait("the count", lambda: DIAGNOSTICS.number(SERVO, f"rejected.{LABELS[reason]}") > 0, 3.0)
    robot.spoil = spoilt.honest
    settled()
    del goals


# The word that /diagnostics counts under, for what ~/status says.
LABELS = {"not in the joint state": "missing_joint", "finite": "non_finite", "with 0 positions": "wrong_length"}


def case_taken(spoil, *arguments):
    """Odd, but no reason to stop: nothing is rejected and it arrives."""
    robot, goals = robot_in_motion()
    kind = getattr(spoilt, spoil)
    robot.spoil = kind(*arguments) if isinstance(kind, type) else kind
    settled()
    assert STATUS.number("rejected") == 0, STATUS.told()
    del goals


def case_never_change():
    """Fresh stamps but frozen angles: the servo stalls and holds; after the robot is mended, the same goal again goes on."""
    robot, goals = robot_in_motion()
    set_parameter("progress_timeout", type=3, double_value=1.0)
    robot.spoil = spoilt.Frozen()
    wait("stalled", lambda: STATUS.is_("stalled"), 3.0)
    standing()
    robot.spoil = spoilt.honest
    run(0.5)
    assert STATUS.is_("stalled") and SENT.speed() == 0.0, STATUS.told()
    goals.write(GOAL)
    settled()


def case_huge(with_ours):
    """States of 10⁵ joints between honest ones: those with the arm's joints are taken, the others rejected; it arrives."""
    robot, goals = robot_in_motion()
    robot.spoil = spoilt.Huge(bool(with_ours))
    run(3.0)
    sent = robot.spoil.count // 50
    assert sent >= 3
    robot.spoil = spoilt.honest
    settled()
    rejected = STATUS.number("rejected")
    # Of several that come in one cycle only the newest is looked at.
    assert rejected == 0 if with_ours else 0 < rejected <= sent, STATUS.told()
    del goals


# --- goals ---

BAD_GOALS = {
    "zero": (ros.PoseStamped(ros.Header(), ros.Pose(ros.Point(0.1, 0.2, 0.3), ros.Quaternion(0.0, 0.0, 0.0, 0.0))), "not_unit"),
    "not_unit": (ros.PoseStamped(ros.Header(), ros.Pose(ros.Point(0.1, 0.2, 0.3), ros.Quaternion(0.0, 0.0, 0.0, 1.1))), "not_unit"),
    "nan": (ros.PoseStamped(ros.Header(), ros.Pose(ros.Point(0.1, 0.2, 0.3), ros.Quaternion(0.0, float("nan"), 0.0, 1.0))), "non_finite"),
    "infinite": (ros.PoseStamped(ros.Header(), ros.Pose(ros.Point(0.1, float("inf"), 0.3), ros.Quaternion())), "non_finite"),
    "frame": (ros.PoseStamped(ros.Header(frame_id="map"), ros.Pose(ros.Point(0.1, 0.2, 0.3), ros.Quaternion())), "unknown_frame"),
}


def case_bad_goal(kind):
    """Rejected and counted under its reason; the arm goes on to the last good one."""
    goals = send_goal()
    moving()
    bad, label = BAD_GOALS[kind]
    for _ in range(5):
        goals.write(bad)
        run(0.02)
    # Of several that come in one cycle only the newest is looked at.
    wait("the count", lambda: 0 < DIAGNOSTICS.number(SERVO, f"rejected.{label}") <= 5, 3.0)
    assert STATUS.number("goal_count") == 1, STATUS.told()
    settled()


def case_beyond_reach():
    """Taken and reported as such; the arm comes near and stalls; a good one then arrives."""
    set_parameter("progress_timeout", type=3, double_value=1.0)
    goals = writer("goal_pose", ros.PoseStamped)
    wait_matched(goals)
    goals.write(ros.PoseStamped(ros.Header(), ros.Pose(ros.Point(3.0, 0.0, 0.0), ros.Quaternion())))
    wait("stalled", lambda: STATUS.is_("stalled"), 30.0)
    assert STATUS.values()["goal_beyond_reach"] == "true" and STATUS.newest.level == 1, STATUS.told()
    standing()
    goals.write(GOAL)
    wait("motion", lambda: STATUS.is_("tracking"))
    assert STATUS.values()["goal_beyond_reach"] == "false", STATUS.told()


def case_goal_flood():
    """A thousand random goals a second: the limits hold, and the next goal that stays is arrived at."""
    goals, chance = send_goal(), random.Random(2)
    moving()
    begin, count = time.monotonic(), 0
    while time.monotonic() < begin + 3.0:
        while count < 1000 * (time.monotonic() - begin):
            q = [chance.gauss(0, 1) for _ in range(4)]
            norm = sum(x * x for x in q) ** 0.5
            point = ros.Point(*[chance.uniform(-0.6, 0.6) for _ in range(3)])
            goals.write(ros.PoseStamped(ros.Header(), ros.Pose(point, ros.Quaternion(*[x / norm for x in q]))))
            count += 1
        poll()
        time.sleep(0.0005)
    assert count >= 2900, count
    # Back to the start first: from where the flood has left the arm a law may well not arrive.
    assert peer.call("puma560", "reset", ros.TRIGGER, False, structure_needs_at_least_one_member=0).success
    goals.write(GOAL)
    settled()
    assert STATUS.number("goal_count") > 300 and STATUS.number("rejected") == 0, STATUS.told()


# --- processes ---


def case_kill(servo):
    """The servo killed: the plant goes on at the last command until its command_timeout (0.1 s), then stands."""
    states = States()
    FOLLOWED.append(states)
    goals = send_goal()
    wait("motion", lambda: states.speed() > 0.3)
    os.kill(int(servo), signal.SIGKILL)
    assert 0.05 < wait("a standstill", lambda: states.speed() == 0.0, 2.0) < 0.6
    before = states.newest.position
    run(0.3)
    assert states.newest.position == before
    del goals


def case_plant_gone(plant):
    """The plant killed: stale_state, and zeros within the timeout and as long again."""
    goals = send_goal()
    moving()
    os.kill(int(plant), signal.SIGKILL)
    begin = time.monotonic()
    wait("stale_state", lambda: STATUS.is_("stale_state"), 1.0)
    standing()
    assert time.monotonic() - begin < 0.6
    del goals


def case_plant_back():
    """Another plant, elsewhere than the old one was: the servo goes on from the measured state. No goal is sent again."""
    settled()


def case_frozen_servo(servo):
    """The servo frozen in motion: the plant stands by its own timeout. Thawed, it must not go on as if nothing had been."""
    states = States()
    FOLLOWED.append(states)
    goals = send_goal()
    wait("motion", lambda: states.speed() > 0.3)
    os.kill(int(servo), signal.SIGSTOP)
    assert 0.05 < wait("a standstill", lambda: states.speed() == 0.0, 2.0) < 0.6
    run(0.5)
    os.kill(int(servo), signal.SIGCONT)
    run(1.0)
    assert states.speed() == 0.0
    del goals


def case_frozen_plant(plant):
    """The plant frozen in motion: stale_state, and zeros within the timeout and as long again."""
    goals = send_goal()
    moving()
    os.kill(int(plant), signal.SIGSTOP)
    wait("stale_state", lambda: STATUS.is_("stale_state"), 1.0)
    standing()
    run(0.5)
    os.kill(int(plant), signal.SIGCONT)
    del goals


def case_reset_in_motion():
    """The plant jumps back to its start: the servo goes on from there, without a step."""
    goals = send_goal()
    moving()
    run(1.0)
    assert peer.call("puma560", "reset", ros.TRIGGER, False, structure_needs_at_least_one_member=0).success
    settled()
    del goals


def case_stop_in_motion():
    """~/stop in motion: zeros soon, and none but zeros until another goal."""
    goals = send_goal()
    moving()
    assert peer.call("dq_servo", "stop", ros.TRIGGER, True, structure_needs_at_least_one_member=0).success
    wait("holding", lambda: STATUS.is_("holding"))
    run(1.0)
    assert SENT.speed() == 0.0
    goals.write(GOAL)
    settled()


def case_pause_in_motion():
    """~/pause in motion: zeros until it ends, then it arrives."""
    goals = send_goal()
    moving()
    pause = lambda data: peer.call("dq_servo", "pause", ros.SET_BOOL, True, data=data)
    assert pause(True).success
    wait("paused", lambda: STATUS.is_("paused"))
    standing()
    run(1.0)
    assert SENT.speed() == 0.0
    assert pause(False).success
    settled()
    del goals


# --- others on the topics ---


def case_rival():
    """Another publisher of commands: servo and plant both say so, and no more once it has gone."""
    said = lambda name: "2 publishers on /forward_velocity_controller/commands" in DIAGNOSTICS.message(name)
    wait("diagnostics", lambda: DIAGNOSTICS.message(SERVO) and DIAGNOSTICS.message(PLANT), 5.0)
    assert not said(SERVO) and not said(PLANT)
    stranger = DomainParticipant(int(os.environ["ROS_DOMAIN_ID"]))
    rival = DataWriter(stranger, Topic(stranger, f"rt/{COMMANDS}", ros.Float64MultiArray), qos=RELIABLE)
    wait_matched(rival)
    rival.write(ros.Float64MultiArray(data=[0.0] * 6))
    wait("the servo's report", lambda: said(SERVO), 5.0)
    wait("the plant's report", lambda: said(PLANT), 5.0)
    assert DIAGNOSTICS.by_name[SERVO].level == 1 and DIAGNOSTICS.by_name[PLANT].level == 1
    del rival, stranger
    wait("the end of it", lambda: not said(SERVO) and not said(PLANT), 15.0)


def listener(case):
    """Another process that subscribes to the commands."""
    child = subprocess.Popen([sys.executable, __file__, case, os.devnull], stdout=subprocess.PIPE)
    assert child.stdout.readline() == b"matched\n"
    return child


def case_listen():
    """A subscriber of commands, until it is killed."""
    wait("commands", lambda: SENT.kept)
    print("matched", flush=True)
    while True:
        poll()
        time.sleep(0.01)


def case_never_read():
    """A subscriber that has room for a hundred commands and never takes one, until it is killed."""
    full = Qos(
        Policy.Reliability.Reliable(duration(seconds=1)), Policy.History.KeepAll, Policy.ResourceLimits(max_samples=100)
    )
    source = reader(COMMANDS, ros.Float64MultiArray, full)
    wait_matched(source)
    print("matched", flush=True)
    while True:
        time.sleep(1.0)


def case_bad_subscriber(kind):
    """Frozen, or never reading: the plant gets its commands all the same, and nothing is dropped."""
    child = listener("listen" if kind == "frozen" else "never_read")
    try:
        if kind == "frozen":
            child.send_signal(signal.SIGSTOP)
        goals = send_goal()
        settled()
        run(1.5)
        assert DIAGNOSTICS.number(SERVO, "commands_dropped") == 0
        goals.write(ros.PoseStamped(ros.Header(), ros.Pose(ros.Point(-0.1, 0.2, 0.25), GOAL.pose.orientation)))
        wait("the next motion", lambda: STATUS.is_("settled") and not at_goal(), 30.0)
    finally:
        child.kill()
        child.wait()


def case_parameters():
    """A hundred changes of parameters a second in motion, laws among them: all answered, no step, and it arrives."""
    request, response = ros.SET_PARAMETERS[2:]
    out = DataWriter(PARTICIPANT, Topic(PARTICIPANT, "rq/dq_servo/set_parametersRequest", request), qos=peer.EVERY)
    back = DataReader(PARTICIPANT, Topic(PARTICIPANT, "rr/dq_servo/set_parametersReply", response), qos=peer.EVERY)
    wait_matched(out)
    wait_matched(back)
    run(0.3)  # The server must have matched our reader too, which nothing here can see.
    goals, results, number = send_goal(), [], 0
    moving()
    begin = time.monotonic()
    while time.monotonic() < begin + 3.0:
        while number < 100 * (time.monotonic() - begin):
            law = ("logc", "double_geodesic", "diffc")[number // 10 % 3]
            changes = [
                ros.Parameter("controller", ros.ParameterValue(type=4, string_value=law)),
                ros.Parameter("logc.gain_linear", ros.ParameterValue(type=3, double_value=1.0 + number % 3)),
                ros.Parameter("limits.linear_speed", ros.ParameterValue(type=3, double_value=0.2 + number % 7 / 4)),
            ]
            out.write(request(client=1, sequence_number=number, parameters=changes))
            number += 1
        poll()
        results += [result for reply in take(back) for result in reply.results]
        time.sleep(0.0005)
    wait("the last answers", lambda: results.extend(r for reply in take(back) for r in reply.results) or len(results) == 3 * number, 5.0)
    assert number >= 290 and all(result.successful for result in results), (number, results[:3])
    set_parameter("controller", type=4, string_value="logc")
    settled()
    del goals


# --- bytes that are no message ---


def spoilt_bytes(good, lengths):
    """What no decoder should trust: cut short, with lengths beyond all memory at `lengths`, in other encodings, random."""
    chance = random.Random(3)
    for keep in range(8, len(good), max(4, len(good) // 16 // 4 * 4)):
        yield good[:keep]
    for at in lengths:
        for length in (2**32 - 1, 2**31 - 1, 2**31, 2**24):
            yield good[:at] + struct.pack("<I", length) + good[at + 4 :]
    for encapsulation in (b"\x00\x00", b"\x00\x02", b"\x00\x03", b"\x00\x06", b"\x00\x0b", b"\xff\xff"):
        yield encapsulation + good[2:]
    for _ in range(32):
        yield b"\x00\x01\x00\x00" + bytes(chance.randrange(256) for _ in range(4 * chance.randrange(1, 40)))


MALFORMED = {
    # Topic, a good sample, and where in its bytes lengths are, behind the encapsulation header and the stamp.
    "goal": ("rt/goal_pose", GOAL, [12]),
    "joint_state": ("rt/joint_states", ros.JointState(ros.Header(), ["a"], [1.0], [2.0]), [12, 20, 24, 32]),
    "command": (f"rt/{COMMANDS}", ros.Float64MultiArray(data=[0.0] * 6), [4, 12]),
    "parameters": ("rq/dq_servo/set_parametersRequest", ros.SET_PARAMETERS[0](parameters=[ros.Parameter("a")]), [4, 8]),
    "stop": ("rq/dq_servo/stopRequest", ros.TRIGGER[0](structure_needs_at_least_one_member=0), [4]),
}


def case_malformed(kind):
    """Bytes that are no message, from another writer: nothing ends, and the next good message works."""
    topic, sample, lengths = MALFORMED[kind]
    stranger = DomainParticipant(int(os.environ["ROS_DOMAIN_ID"]))
    # Cyclone looks through what it writes, so it is told of one byte only, under the name of the type.
    byte = ros.make_idl_struct("Byte", type(sample).__idl_typename__, {"x": ros.uint8})
    out = DataWriter(stranger, Topic(stranger, topic, byte), qos=RELIABLE)
    wait_matched(out)
    good = bytes(sample.serialize())
    for number, data in enumerate(spoilt_bytes(good, lengths)):
        carrier = byte(0)
        carrier.serialize = lambda *_, data=data, **__: data
        out.write(carrier)
        if number % 8 == 0:
            run(0.01)
    run(1.2)
    if kind in ("goal", "joint_state"):
        assert STATUS.number("rejected") > 20, STATUS.told()
        assert DIAGNOSTICS.number(SERVO, "rejected.malformed") > 10, DIAGNOSTICS.by_name
    if kind == "command":
        assert DIAGNOSTICS.number(PLANT, "rejected") > 10, DIAGNOSTICS.by_name
    del out, stranger
    set_parameter("controller", type=4, string_value="logc")
    goals = send_goal()
    settled()
    del goals


# --- network and clock ---


def case_arrive():
    """It arrives, whatever the network does."""
    goals = send_goal()
    settled(40.0)
    del goals


def case_partition(relay_pid):
    """The network is cut for three seconds in motion: stale_state and zeros; mended, it arrives by itself."""
    goals = send_goal()
    moving()
    os.kill(int(relay_pid), signal.SIGUSR1)
    wait("stale_state", lambda: STATUS.is_("stale_state"), 2.0)
    standing()
    run(3.0)
    assert STATUS.is_("stale_state"), STATUS.told()
    os.kill(int(relay_pid), signal.SIGUSR1)
    settled(40.0)
    del goals


def case_clock_back(file):
    """The wall clock of the servo is set back by an hour in motion: it goes on and arrives."""
    poses = reader("dq_servo/current_pose", ros.PoseStamped)
    goals = send_goal()
    moving()
    stamp = lambda: (pose := last(poses)) and pose.header.stamp.sec - time.time()
    wait("the right time", lambda: (offset := stamp()) is not None and abs(offset) < 5)
    with open(file, "w", encoding="utf-8") as out:
        out.write("-3600\n")
    wait("an hour ago", lambda: (offset := stamp()) is not None and -3700 < offset < -3500, 5.0)
    settled()
    goals.write(ros.PoseStamped(ros.Header(), ros.Pose(ros.Point(-0.1, 0.2, 0.25), GOAL.pose.orientation)))
    wait("the next motion", lambda: STATUS.is_("settled") and not at_goal(), 30.0)


if __name__ == "__main__":
    globals()[f"case_{sys.argv[1]}"](*sys.argv[3:])
    SENT.write(sys.argv[2])
