"""Other nodes on the topics of the servo."""
import os
import signal
import subprocess
import sys

from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration
from peer import PARTICIPANT, RELIABLE
from robot import COMMANDS, RIVAL
from watch import *


def case_rival():
    """A second publisher of commands: servo and plant both report it, until it is gone."""
    said = lambda name: "2 publishers on /forward_velocity_controller/commands" in DIAGNOSTICS.message(name)
    wait("diagnostics", lambda: DIAGNOSTICS.message(SERVO) and DIAGNOSTICS.message(PLANT))
    assert not said(SERVO) and not said(PLANT)
    stranger = DomainParticipant(int(os.environ["ROS_DOMAIN_ID"]))
    rival = DataWriter(stranger, Topic(stranger, f"rt/{COMMANDS}", ros.Float64MultiArray), qos=RELIABLE)
    wait_matched(rival)
    rival.write(ros.Float64MultiArray(ros.MultiArrayLayout([ros.MultiArrayDimension(RIVAL)]), [0.0] * 6))
    wait("the servo's report", lambda: said(SERVO))
    wait("the plant's report", lambda: said(PLANT))
    assert DIAGNOSTICS.by_name[SERVO].level == 1 and DIAGNOSTICS.by_name[PLANT].level == 1
    del rival, stranger
    wait("the end of it", lambda: not said(SERVO) and not said(PLANT))


def case_two_servos():
    """Two servos get a goal: a servo that receives commands of the other holds the arm and names both. A servo that gets the goal later
    sends nothing, and the other moves the arm alone."""
    servos = (STATUS, Status("other"))
    FOLLOWED.append(servos[1])
    goals = writer("goal_pose", ros.PoseStamped)
    wait("both servos", lambda: goals.get_publication_matched_status().current_count == 2)
    goals.write(GOAL)
    named = lambda text: "command one arm" in text and all(f"/{name} (" in text for name in ("dq_servo", "other"))
    revoked = lambda told: told.get("revoked_by") == "two_publishers" and named(told.get("reason", ""))
    holds = lambda servo: servo.is_("holding") and servo.newest.level == 1 and revoked(servo.values())
    wait("the rivalry", lambda: any(map(holds, servos)))
    run(2.0)
    before = len(SENT.kept)
    run(1.5)
    told = f"{len(SENT.senders)} senders, {[servo.told() for servo in servos]}"
    assert [holds(servo) for servo in servos].count(True) == len(SENT.senders), told
    if len(SENT.senders) == 2:
        assert not any(any(velocities) for _, velocities in SENT.kept[before:]), told
    else:
        assert any(servo.is_(state) for servo in servos for state in ("tracking", "settled")), told
    del goals


def case_two_plants():
    """Two plants publish the states of the same joints: a goal moves neither, and both are named."""
    wait("both named", lambda: all(f"/{name} (" in STATUS.values().get("reason", "") for name in ("puma560", "forgotten")))
    goals = send_goal()
    # The servo refuses the goal, or takes it between two checks for other publishers, and holds.
    wait("the goal heard", lambda: STATUS.number("goal_count") + STATUS.number("rejected") > 0)
    run(1.0)
    assert STATUS.is_("holding") and STATUS.newest.level == 1, STATUS.told()
    assert not any(any(velocities) for _, velocities in SENT.kept)
    del goals


def listener(case):
    """Another process that subscribes to the commands."""
    child = subprocess.Popen([sys.executable, sys.argv[0], case, os.devnull], stdout=subprocess.PIPE)
    assert child.stdout.readline() == b"matched\n"
    return child


def case_listen():
    """Subscribes to the commands, until it is killed."""
    wait_matched(SENT.source)
    print("matched", flush=True)
    while True:
        poll()
        time.sleep(0.01)


def case_never_read():
    """Subscribes with room for a hundred commands and never takes one, until it is killed."""
    full = Qos(
        Policy.Reliability.Reliable(duration(seconds=1)), Policy.History.KeepAll, Policy.ResourceLimits(max_samples=100)
    )
    source = reader(COMMANDS, ros.Float64MultiArray, full)
    wait_matched(source)
    print("matched", flush=True)
    while True:
        time.sleep(1.0)


# The number of unacknowledged samples for which a writer of RustDDS has room by default.
ROOM = 8192


def case_bad_subscribers():
    """One subscriber is frozen, and one never reads, for more commands than a writer can store: the plant still gets its commands, and
    none is dropped."""
    children = [listener(case) for case in ("listen", "never_read")]
    try:
        children[0].send_signal(signal.SIGSTOP)
        before = len(SENT.kept)
        goals = send_goal()
        wait("more commands than there is room for", lambda: len(SENT.kept) > before + ROOM + 500)
        settled()
        run(1.5)
        assert DIAGNOSTICS.number(SERVO, "commands_dropped") == 0
        goals.write(ros.PoseStamped(ros.Header(), ros.Pose(ros.Point(-0.1, 0.2, 0.25), GOAL.pose.orientation)))
        wait("the next motion", lambda: STATUS.is_("settled") and not at_goal())
    finally:
        for child in children:
            child.kill()
            child.wait()


def case_parameters():
    """A hundred changes of parameters a second during a motion, including changes of the law: all are answered, the command has no step,
    and the arm arrives. The client waits for answers while 20 are due: a service keeps 32 requests."""
    request, response = ros.SET_PARAMETERS[2:]
    out = DataWriter(PARTICIPANT, Topic(PARTICIPANT, "rq/dq_servo/set_parametersRequest", request), qos=peer.EVERY)
    back = DataReader(PARTICIPANT, Topic(PARTICIPANT, "rr/dq_servo/set_parametersReply", response), qos=peer.EVERY)
    wait_matched(out)
    wait_matched(back)
    # The server must have matched our reader too, which nothing here can see until a request is answered. An empty one has no results.
    answered = lambda: out.write(request(client=1, sequence_number=0, parameters=[])) or time.sleep(0.1) or take(back)
    wait("a first answer", answered)
    goals, results, number = send_goal(), [], 0
    moving()
    begin = time.monotonic()
    while time.monotonic() < begin + 3.0:
        while number < min(100 * (time.monotonic() - begin), len(results) // 3 + 20):
            law = ("logc", "double_geodesic", "diffc")[number // 10 % 3]
            changes = [
                ros.Parameter("controller", ros.ParameterValue(type=4, string_value=law)),
                ros.Parameter("gains.logc", ros.ParameterValue(type=8, double_array_value=[1.0, 1.0 + number % 3])),
                ros.Parameter("limits.linear_speed", ros.ParameterValue(type=3, double_value=0.2 + number % 7 / 4)),
            ]
            out.write(request(client=1, sequence_number=number, parameters=changes))
            number += 1
        poll()
        results += [result for reply in take(back) for result in reply.results]
        time.sleep(0.0005)
    wait("the last answers", lambda: results.extend(r for reply in take(back) for r in reply.results) or len(results) == 3 * number)
    # A busy machine answers fewer.
    assert number >= 100 and all(result.successful for result in results), (number, results[:3])
    set_parameter("controller", type=4, string_value="logc")
    settled()
    del goals
