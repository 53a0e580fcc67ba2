"""Joint states from a robot of ours, spoilt."""
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
    """Spoilt so that nothing can be taken: stale_state, at rest within the timeout and as long again; then it arrives."""
    robot, goals = robot_in_motion()
    robot.spoil = getattr(spoilt, spoil)
    begin = time.monotonic()
    wait("stale_state", lambda: STATUS.is_("stale_state"), 1.0)
    standing()
    assert time.monotonic() - begin < 0.6, "state_timeout 0.1 s, deceleration 0.1 s, and a machine that others use too"
    # Soon, because after a longer absence the goal would have to be sent again.
    robot.spoil = spoilt.honest
    settled()
    if reason:
        assert STATUS.number("rejected") > 0 and reason in STATUS.values().get("last_rejection", ""), STATUS.told()
        wait("the count", lambda: DIAGNOSTICS.number(SERVO, "rejected.non_finite") > 0, 3.0)
    del goals


def case_odd():
    """In any order of joints and of stamps, by a clock that was set back, among others' joints: nothing is rejected, and it arrives."""
    robot, goals = robot_in_motion()
    reordered = spoilt.Reordered()
    robot.spoil = lambda state: reordered(spoilt.odd(state))
    settled()
    assert STATUS.number("rejected") == 0, STATUS.told()
    del goals


def case_never_change():
    """Fresh stamps but frozen angles, as after an emergency stop: not_following, then revoked; it goes on when the goal comes again."""
    robot, goals = robot_in_motion()
    robot.spoil = spoilt.Frozen()
    wait("not_following", lambda: STATUS.is_("not_following"), 1.0)
    assert "does not follow: contact?" in STATUS.values()["reason"], STATUS.told()
    standing()
    wait("not_obeyed", lambda: STATUS.values().get("revoked_by") == "not_obeyed", 3.0)
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
    """A gripper's joint states on the same topic, at another rate: nothing but rejected messages, and it arrives."""
    robot, goals = robot_in_motion()
    gripper = spoilt.Gripper()
    FOLLOWED.append(gripper)
    STATUS.states.clear()
    settled()
    assert STATUS.states[:2] in (["tracking", "settled"], ["settled"]), STATUS.told()
    assert STATUS.number("rejected") > 20 and "finger" in STATUS.values().get("last_rejection", ""), STATUS.told()
    del goals


def case_two_robots():
    """Another publisher of the arm's joints: it stands, names both, and goes on when that has gone and the goal comes again."""
    robot, goals = robot_in_motion()
    other = spoilt.Robot(SENT)
    other.position = [0.3] * 6
    other.commands = Still()
    FOLLOWED.append(other)
    wait("holding", lambda: STATUS.is_("holding") and "two publishers" in STATUS.values().get("reason", ""), 3.0)
    standing()
    reason = STATUS.values()["reason"]
    # These participants are not ROS 2 nodes, so only their GUIDs name them.
    assert reason.count("an unknown node (") == 2 and "/joint_states" in reason and STATUS.newest.level == 1, reason
    wait("the diagnostics", lambda: "two publishers" in DIAGNOSTICS.message(SERVO), 3.0)
    FOLLOWED.remove(other)
    run(1.5)
    assert STATUS.is_("holding") and SENT.speed() == 0.0 and "send a goal again" in STATUS.values()["reason"], STATUS.told()
    goals.write(GOAL)
    settled()


class Still:
    """No commands for a robot that stands."""

    def newest(self):
        return [0.0] * 6


def case_million():
    """A state of 10⁶ joints, the arm's among them: refused as malformed; the next goal is arrived at."""
    robot, goals = robot_in_motion()
    # With another writer: the robot's keeps only ten states, fewer than it sends until this one has arrived.
    stranger = writer("joint_states", ros.JointState)
    wait_matched(stranger)
    names = [f"j{i}" for i in range(10**6)] + spoilt.JOINTS
    stranger.write(ros.JointState(ros.Header(), names, [0.0] * len(names), []))
    wait("the count", lambda: DIAGNOSTICS.number(SERVO, "rejected.malformed") == 1, 10.0)
    wait("the reason", lambda: "more than 100000" in STATUS.values().get("last_rejection", ""), 3.0)
    del stranger
    # Meanwhile the robot was absent: writing this state takes seconds here.
    again(goals)
    settled()
    del goals


def case_huge():
    """States of 10⁵ joints between honest ones: those with the arm's joints are taken, the others rejected; it arrives."""
    robot, goals = robot_in_motion()
    robot.spoil = spoilt.Huge()
    run(4.0)
    taken, others = robot.spoil.sent
    assert taken >= 2 and others >= 2, robot.spoil.sent
    robot.spoil = spoilt.honest
    settled()
    assert 0 < STATUS.number("rejected") <= others, (others, STATUS.told())
    del goals
