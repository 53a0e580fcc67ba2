"""Faults of networks and clocks."""
import os
import signal

from watch import *


def case_arrive():
    """The arm arrives in spite of the bad network."""
    goals = send_goal()
    settled()
    del goals


def case_partition(relay_pid):
    """The network is cut for three seconds during a motion: stale_state and zeros. After that the arm waits until the goal is sent
    again."""
    goals = send_goal()
    moving()
    os.kill(int(relay_pid), signal.SIGUSR1)
    wait("stale_state", lambda: STATUS.is_("stale_state"))
    standing()
    run(3.0)
    assert STATUS.is_("stale_state"), STATUS.told()
    os.kill(int(relay_pid), signal.SIGUSR1)
    wait("holding", lambda: STATUS.is_("holding"))
    assert "away" in STATUS.values()["reason"] and SENT.speed() == 0.0, STATUS.told()
    goals.write(GOAL)
    settled()


def case_cable_out(relay_pid):
    """The sender is disconnected for 2 s while it sends a goal: the goal is rejected when it arrives, and the arm moves to the next
    one."""
    goals = writer("goal_pose", ros.PoseStamped)
    wait_matched(goals)
    wait("holding", lambda: STATUS.is_("holding"))
    os.kill(int(relay_pid), signal.SIGUSR1)
    run(0.1)
    goals.write(GOAL)
    run(2.0)
    os.kill(int(relay_pid), signal.SIGUSR1)
    wait("the late goal", lambda: DIAGNOSTICS.number(SERVO, "rejected.late") == 1)
    assert "by its sender's clock" in STATUS.values()["last_rejection"], STATUS.told()
    run(0.3)
    assert STATUS.values()["goal_count"] == "0" and STATUS.is_("holding"), STATUS.told()
    goals.write(GOAL)
    moving()
    run(0.2)  # The record comes 0.1 s later than the commands.


def case_clock_back(file):
    """The system clock of the servo is set back by an hour during a motion: the motion continues, and the arm arrives."""
    arrays = reader("diagnostics", ros.DiagnosticArray)
    goals = send_goal()
    moving()
    # Poses have the robot's time; the servo itself stamps the diagnostics.
    own = lambda: [array for array in take(arrays) if array.status[0].name == SERVO]
    stamp = lambda: (mine := own()) and mine[-1].header.stamp.sec - time.time() or None
    wait("the right time", lambda: (offset := stamp()) is not None and abs(offset) < 5)
    with open(file, "w", encoding="utf-8") as out:
        out.write("-3600\n")
    wait("an hour ago", lambda: (offset := stamp()) is not None and -3700 < offset < -3500)
    settled()
    goals.write(ros.PoseStamped(ros.Header(), ros.Pose(ros.Point(-0.1, 0.2, 0.25), GOAL.pose.orientation)))
    wait("the next motion", lambda: STATUS.is_("settled") and not at_goal())
