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


def case_million():
    """A state of 10⁶ joints, the arm's among them: refused as malformed; it arrives by the honest ones."""
    robot, goals = robot_in_motion()
    # By a writer of its own: the robot's keeps ten states only, fewer than it sends until this one is through.
    stranger = writer("joint_states", ros.JointState)
    wait_matched(stranger)
    names = [f"j{i}" for i in range(10**6)] + spoilt.JOINTS
    stranger.write(ros.JointState(ros.Header(), names, [0.0] * len(names), []))
    wait("the count", lambda: DIAGNOSTICS.number(SERVO, "rejected.malformed") == 1, 10.0)
    wait("the reason", lambda: "more than 100000" in STATUS.values()["last_rejection"], 3.0)
    del stranger
    settled()
    del goals


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
