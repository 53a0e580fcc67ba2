"""Corrupted joint states from a robot."""
import time

import robot as spoilt
from robot import Robot
from watch import *


def robot_in_motion():
    robot = Robot(SENT)
    FOLLOWED.append(robot)
    goals = send_goal()
    moving()
    return robot, goals


def case_stale(spoil, reason=""):
    """Unusable joint states: the servo reports stale_state and the arm is at rest soon. Later it arrives."""
    robot, goals = robot_in_motion()
    robot.spoil = getattr(spoilt, spoil)
    begin = time.monotonic()
    wait("stale_state", lambda: STATUS.is_("stale_state"))
    standing()
    assert time.monotonic() - begin < SOON
    # Soon, because after a longer absence the goal would have to be sent again.
    robot.spoil = spoilt.honest
    settled()
    if reason:
        assert STATUS.number("rejected") > 0 and reason in STATUS.values().get("last_rejection", ""), STATUS.told()
        wait("the count", lambda: DIAGNOSTICS.number(SERVO, "rejected.non_finite") > 0)
    del goals


def case_held():
    """A joint that is pulled at 0.06 rad/s is held, with `integral`. Where joint states end, the hold ends too, within the limits."""
    set_parameter("integral", type=3, double_value=5.0)
    robot = Robot(SENT)
    robot.pull[1] = 0.06
    FOLLOWED.append(robot)
    goals = send_goal()
    settled()
    run(0.5)
    assert abs(SENT.newest()[1] - 0.06) < 0.01, SENT.newest()
    robot.spoil = spoilt.silent
    wait("stale_state", lambda: STATUS.is_("stale_state"))
    standing()
    del goals


def case_odd():
    """Joints and stamps in any order, a clock that was set back, and other joints in the message: nothing is rejected, and the arm
    arrives."""
    robot, goals = robot_in_motion()
    reordered = spoilt.Reordered()
    robot.spoil = lambda state: reordered(spoilt.odd(state))
    settled()
    assert STATUS.number("rejected") == 0, STATUS.told()
    del goals


def case_never_change():
    """New stamps but constant angles, as after an emergency stop: not_following, then revoked. The motion continues when the goal is sent
    again."""
    robot, goals = robot_in_motion()
    robot.spoil = spoilt.Frozen()
    wait("not_following", lambda: STATUS.is_("not_following"))
    assert "does not follow: contact?" in STATUS.values()["reason"], STATUS.told()
    standing()
    wait("not_obeyed", lambda: STATUS.values().get("revoked_by") == "not_obeyed")
    robot.position = list(robot.spoil.position)
    robot.spoil = spoilt.honest
    begin, fastest = time.monotonic(), 0.0
    while time.monotonic() < begin + 2.0:
        run(0.01)
        fastest = max(fastest, SENT.speed())
    assert STATUS.is_("holding") and fastest == 0.0, (fastest, STATUS.told())
    assert "has not obeyed" in STATUS.values()["reason"], STATUS.told()
    again(goals)
    settled()
    del goals


def case_gripper():
    """The joint states of a gripper on the same topic at another rate: only these messages are rejected, and the arm arrives."""
    robot, goals = robot_in_motion()
    gripper = spoilt.Gripper()
    FOLLOWED.append(gripper)
    STATUS.states.clear()
    settled()
    assert STATUS.states[:2] in (["tracking", "settled"], ["settled"]), STATUS.told()
    assert STATUS.number("rejected") > 20 and "finger" in STATUS.values().get("last_rejection", ""), STATUS.told()
    del goals


def case_two_robots():
    """A second publisher of the arm's joints: the arm stops, the servo names both, and continues after the second is gone and the goal is
    sent again."""
    robot, goals = robot_in_motion()
    other = spoilt.Robot(SENT)
    other.position = [0.3] * 6
    other.commands = Still()
    FOLLOWED.append(other)
    wait("holding", lambda: STATUS.is_("holding") and "two publishers" in STATUS.values().get("reason", ""))
    standing()
    reason = STATUS.values()["reason"]
    # These participants are not ROS 2 nodes, so only their GUIDs name them.
    assert reason.count("an unknown node (") == 2 and "/joint_states" in reason and STATUS.newest.level == 1, reason
    wait("the diagnostics", lambda: "two publishers" in DIAGNOSTICS.message(SERVO))
    FOLLOWED.remove(other)
    run(1.5)
    assert STATUS.is_("holding") and SENT.speed() == 0.0 and "send a goal again" in STATUS.values()["reason"], STATUS.told()
    goals.write(GOAL)
    settled()


class Still:
    """A robot at rest gets no commands."""

    def newest(self):
        return [0.0] * 6


def case_million():
    """A state with 10⁶ joints, including the arm's: it is rejected as malformed, and the arm arrives at the next goal."""
    robot, goals = robot_in_motion()
    # With another writer: the robot's keeps only ten states, fewer than it sends until this one has arrived.
    stranger = writer("joint_states", ros.JointState)
    wait_matched(stranger)
    names = [f"j{i}" for i in range(10**6)] + spoilt.JOINTS
    stranger.write(ros.JointState(ros.Header(), names, [0.0] * len(names), []))
    wait("the count", lambda: DIAGNOSTICS.number(SERVO, "rejected.malformed") == 1)
    wait("the reason", lambda: "more than 100000" in STATUS.values().get("last_rejection", ""))
    del stranger
    # Meanwhile the robot was absent: writing this state takes seconds here.
    again(goals)
    settled()
    del goals


def case_huge():
    """States with 10⁵ joints between valid ones: those with the arm's joints are accepted, the others are rejected, and the arm
    arrives."""
    robot, goals = robot_in_motion()
    robot.spoil = spoilt.Huge()
    run(4.0)
    taken, others = robot.spoil.sent
    assert taken >= 2 and others >= 2, robot.spoil.sent
    robot.spoil = spoilt.honest
    settled()
    assert 0 < STATUS.number("rejected") <= others, (others, STATUS.told())
    del goals
