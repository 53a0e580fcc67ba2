"""Servo and plant are killed, frozen, reset or stopped."""
import os
import signal
import subprocess
import sys

from watch import *


def case_kill(servo):
    """The servo is killed: the plant continues with the last command until its command_timeout (0.1 s), then stops."""
    states = States()
    FOLLOWED.append(states)
    goals = send_goal()
    wait("motion", lambda: states.speed() > 0.3)
    run(0.2)  # The record comes 0.1 s later than the commands.
    os.kill(int(servo), signal.SIGKILL)
    assert 0.05 < wait("a standstill", lambda: states.speed() == 0.0) < SOON
    before = states.newest.position
    run(0.3)
    assert states.newest.position == before
    del goals


def case_plant_gone(plant):
    """The plant is killed: stale_state, and zeros soon."""
    goals = send_goal()
    moving()
    os.kill(int(plant), signal.SIGKILL)
    begin = time.monotonic()
    wait("stale_state", lambda: STATUS.is_("stale_state"))
    standing()
    assert time.monotonic() - begin < SOON
    run(1.2)  # Longer than rearm_timeout.
    del goals


def case_plant_back():
    """Another plant starts long after the first one, at another position: the servo reports that and waits until the goal is sent
    again."""
    wait("holding", lambda: STATUS.is_("holding"))
    reason = STATUS.values()["reason"]
    assert "away" in reason and "~/pause" in reason and STATUS.newest.level == 1, STATUS.told()
    run(0.5)
    assert SENT.speed() == 0.0 and STATUS.is_("holding"), STATUS.told()
    goals = send_goal()
    settled()
    del goals


def case_left_over(servo, recorder):
    """The publisher of an earlier goal keeps it for a recorder that was killed. A restarted servo must not follow this goal."""
    goals = writer("goal_pose", ros.PoseStamped)
    wait("both subscribers", lambda: matched(goals) == 2)
    os.kill(int(recorder), signal.SIGKILL)
    run(0.5)
    goals.write(GOAL)
    settled()
    os.kill(int(servo), signal.SIGTERM)
    # A killed participant counts until its lease ends.
    wait("the servo's end", lambda: matched(goals) == 1)
    STATUS.newest = None
    wait("another servo", lambda: matched(goals) == 2 and STATUS.is_("holding"))
    wait("the goal of before", lambda: DIAGNOSTICS.number(SERVO, "rejected.late") == 1)
    run(0.5)
    assert STATUS.is_("holding") and STATUS.values()["goal_count"] == "0", STATUS.told()
    goals.write(GOAL)
    wait("settled", lambda: STATUS.is_("settled") and STATUS.values()["goal_count"] == "1")


def matched(goals):
    return goals.get_publication_matched_status().current_count


def case_frozen_servo(servo):
    """The servo is frozen during a motion: the plant stops by its own timeout. When the servo resumes, it must not continue the
    motion."""
    states = States()
    FOLLOWED.append(states)
    goals = send_goal()
    wait("motion", lambda: states.speed() > 0.3)
    run(0.2)  # The record comes 0.1 s later than the commands.
    os.kill(int(servo), signal.SIGSTOP)
    assert 0.05 < wait("a standstill", lambda: states.speed() == 0.0) < SOON
    run(0.5)
    os.kill(int(servo), signal.SIGCONT)
    run(1.0)
    assert states.speed() == 0.0
    del goals


def case_starved(servo):
    """Another process takes the servo's core for 0.5 s, twice in a motion: the plant stops by its own timeout, and the commands
    after that begin at rest. The motion goes on."""
    states = States()
    FOLLOWED.append(states)
    [core, *others] = sorted(os.sched_getaffinity(0))
    os.sched_setaffinity(0, others)
    for thread in os.listdir(f"/proc/{servo}/task"):
        os.sched_setaffinity(int(thread), [core])
    busy = [subprocess.Popen([sys.executable, "-c", BUSY, str(core)], stdin=subprocess.PIPE, stdout=subprocess.PIPE) for _ in range(2)]
    assert all(process.stdout.readline() == b"ready\n" for process in busy)
    goals = send_goal()
    for process in busy:
        wait("motion", lambda: states.speed() > 0.3)
        process.stdin.close()
        wait("a standstill", lambda: states.speed() == 0.0)
        sent = len(SENT.kept)
        # Commands that the servo gave to DDS before it lost the core may arrive first.
        wait("commands", lambda: len(SENT.kept) > sent + 20)
        slowest = min(max(map(abs, command)) for _, command in SENT.kept[sent:])
        assert slowest < 0.21, SENT.kept[sent:]  # 50 rad/s² in two periods of 2 ms
        assert process.wait() == 0
    settled()
    del goals


# Takes a core from all processes without a higher real-time priority, as soon as its input ends.
BUSY = """
import os, sys, time
os.sched_setaffinity(0, [int(sys.argv[1])])
print("ready", flush=True)
sys.stdin.read()
os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(50))
end = time.monotonic() + 0.5
while time.monotonic() < end: pass
"""


def case_frozen_plant(plant):
    """The plant is frozen during a motion: stale_state, and zeros soon."""
    goals = send_goal()
    moving()
    os.kill(int(plant), signal.SIGSTOP)
    wait("stale_state", lambda: STATUS.is_("stale_state"))
    standing()
    run(1.2)  # Longer than rearm_timeout.
    os.kill(int(plant), signal.SIGCONT)
    del goals


def case_reset_in_motion():
    """The plant jumps back to its start: the arm comes to rest, and continues from there when the goal is sent again."""
    goals = send_goal()
    moving()
    run(0.3)
    assert peer.call("puma560", "reset", ros.TRIGGER, False, structure_needs_at_least_one_member=0).success
    wait("holding", lambda: STATUS.is_("holding"))
    assert "elsewhere" in STATUS.values()["reason"], STATUS.told()
    standing()
    again(goals)
    settled()
    del goals


def case_stop_and_end(servo):
    """~/stop during a motion, then SIGTERM during a motion: zeros soon after each, and the robot stops."""
    states = States()
    FOLLOWED.append(states)
    wait("the robot", lambda: STATUS.is_("holding"))
    goals = send_goal()
    moving()
    assert peer.call("dq_servo", "stop", ros.TRIGGER, True, structure_needs_at_least_one_member=0).success
    standing()
    wait("holding", lambda: STATUS.is_("holding"))
    again(goals)
    moving()
    os.kill(int(servo), signal.SIGTERM)
    standing()
    wait("a standstill", lambda: states.speed() == 0.0)
    del goals


def guarded():
    """The servo detects its guard, and no node takes the guard for a second servo."""
    wait("the guard", lambda: STATUS.values().get("guard") == "watching")
    wait("diagnostics", lambda: SERVO in DIAGNOSTICS.by_name and PLANT in DIAGNOSTICS.by_name)
    run(1.2)
    for name in (SERVO, PLANT):
        assert "publishers" not in DIAGNOSTICS.message(name), DIAGNOSTICS.message(name)


def of_guards():
    return [command for label, command in SENT.kept if label == "guard"]


def case_guarded_kill(servo):
    """The servo is killed during a motion, and the plant keeps the last velocity: it stops after the guard's command_timeout of 0.1 s."""
    states = States()
    FOLLOWED.append(states)
    guarded()
    goals = send_goal()
    wait("motion", lambda: states.speed() > 0.3)
    assert not of_guards()
    killed = time.time_ns()
    os.kill(int(servo), signal.SIGKILL)
    wait("a standstill", lambda: states.speed() == 0.0)
    # The robot's clock counts: when the robot received the guard's command, not when that is observed here.
    took = (states.stood - killed) * 1e-9
    assert 0.05 < took < SOON, took
    before = states.newest.position
    run(1.5)
    assert states.newest.position == before
    zeros = of_guards()
    assert zeros and not any(any(command) for command in zeros)
    run(0.3)
    assert len(of_guards()) == len(zeros), "it does not go on for ever"
    del goals


def case_guarded_positions(servo):
    """The same for an arm that takes positions: it is held at its current position, which is the last one it was sent."""
    PLACES.start()
    guarded()
    goals = send_goal()
    wait("motion", lambda: PLACES.states.speed() > 0.3)
    os.kill(int(servo), signal.SIGKILL)
    wait("the guard", lambda: PLACES.of_guards())
    run(0.5)
    held = PLACES.of_guards()
    assert all(command == held[0] for command in held), "one place"
    assert PLACES.states.newest.position == held[0] and PLACES.states.speed() == 0.0
    assert held[0] == PLACES.of_servo()[-1]
    del goals


def case_guarded_reset():
    """An arm that takes positions jumps back to its start during a motion: it gets no command to return to the last commanded
    position."""
    PLACES.start()
    guarded()
    wait("the robot", lambda: PLACES.states.newest)
    start = PLACES.states.newest.position
    goals = send_goal()
    wait("motion", lambda: PLACES.states.speed() > 0.3)
    run(1.0)
    assert peer.call("puma560", "reset", ros.TRIGGER, False, structure_needs_at_least_one_member=0).success
    wait("holding", lambda: STATUS.is_("holding"))
    assert "elsewhere" in STATUS.values()["reason"], STATUS.told()
    for _ in range(20):
        run(0.1)
        assert PLACES.states.newest.position == start, (PLACES.states.newest.position, start)
    # The servo's commands cease in motion too. The guard holds an arm that was moved by others at its present position, or does nothing.
    assert all(command == list(start) for command in PLACES.of_guards()), PLACES.of_guards()
    goals.write(GOAL)
    settled()
    del goals


class Places:
    """The commands to an arm that takes positions, and its joint states."""

    def start(self):
        self.source, self.kept = reader("forward_position_controller/commands", ros.Float64MultiArray, peer.EVERY), []
        self.states = States()
        FOLLOWED.extend([self, self.states])

    def poll(self):
        self.kept += [(c.layout.dim[0].label if c.layout.dim else "", list(c.data)) for c in take(self.source)]

    def of_guards(self):
        return [command for label, command in self.kept if label == "guard"]

    def of_servo(self):
        return [command for label, command in self.kept if label != "guard"]


PLACES = Places()


def case_guarded_end(servo):
    """The servo ends normally during a motion: the guard sends nothing."""
    guarded()
    goals = send_goal()
    moving()
    os.kill(int(servo), signal.SIGTERM)
    standing()
    run(0.6)
    assert not of_guards()
    del goals


def case_guard_without_time():
    """The guard's core is busy with higher-priority work: messages that the guard receives late are no reason to stop the arm."""
    goals = send_goal()
    moving()
    run(4.0)
    assert not of_guards(), len(of_guards())
    del goals


def case_guard_killed(guard):
    """The guard is killed: the servo logs a warning and continues."""
    guarded()
    os.kill(int(guard), signal.SIGKILL)
    wait("the warning", lambda: "guard is gone" in DIAGNOSTICS.message(SERVO))
    assert STATUS.values()["guard"] == "gone" and DIAGNOSTICS.by_name[SERVO].level == 1
    goals = send_goal()
    settled()
    del goals
