"""What every case observes and polls while it waits."""
import time

import peer
from peer import PARTICIPANT, PATIENCE, RELIABLE

# The cases import some of these from here.
from peer import GOAL, last, reader, ros, send_goal, take, wait_matched, writer
from robot import Commands

# Within this time [s], an arm whose commands or states have ended is at rest. Timeout and deceleration are 0.1 s each; the rest is for
# processes of others, which may use the cores too. tests/benches/guard.py measures the actual time.
SOON = 2.0

FOLLOWED = []  # What is polled while a case waits.


def poll():
    for each in FOLLOWED:
        each.poll()


def wait(what, condition):
    """Waits like the function of the peer, and polls all observers in the meantime. Returns the elapsed time [s]."""
    begin = time.monotonic()
    while not condition():
        assert time.monotonic() < begin + PATIENCE, f"{what}: not within {PATIENCE} s; {STATUS.told()}"
        poll()
        time.sleep(0.001)
    return time.monotonic() - begin


def run(seconds):
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        poll()
        time.sleep(0.001)


class Status:
    """The latest ~/status of a servo, and the sequence of its states."""

    def __init__(self, servo="dq_servo"):
        self.source, self.newest, self.states = reader(f"{servo}/status", ros.DiagnosticStatus), None, []

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
    """The latest /diagnostics by name."""

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
    """The latest joint state, and when the robot came to rest by its own clock [ns]."""

    def __init__(self):
        self.source, self.newest, self.stood = reader("joint_states", ros.JointState, peer.EVERY), None, None

    def poll(self):
        for self.newest in take(self.source):
            stamp = self.newest.header.stamp
            self.stood = None if self.speed() else self.stood or stamp.sec * 10**9 + stamp.nanosec

    def speed(self):
        return max(map(abs, self.newest.velocity)) if self.newest else 0.0


SERVO, PLANT = "dq_servo: cycle", "puma560: commands"
SENT, STATUS, DIAGNOSTICS = Commands(), Status(), Diagnostics()
FOLLOWED += [SENT, STATUS, DIAGNOSTICS]


def moving():
    wait("motion", lambda: SENT.speed() > 0.3)


def again(goals):
    """Sends the goal again after a pause of its publisher. After a revoked goal, a publisher that never pauses is ignored."""
    run(1.6)
    goals.write(GOAL)


def standing():
    wait("a command of zero", lambda: SENT.speed() == 0.0)


def settled():
    """Whether the servo has settled at GOAL, in a status that arrived after this call began."""
    STATUS.newest = None
    wait("settled", lambda: STATUS.is_("settled") and at_goal())


def at_goal():
    goal = STATUS.values().get("goal", "").split()
    return goal and abs(float(goal[0]) - GOAL.pose.position.x) < 1e-9


def set_parameter(name, **value):
    parameter = ros.Parameter(name, ros.ParameterValue(**value))
    result = peer.call("dq_servo", "set_parameters", ros.SET_PARAMETERS, True, parameters=[parameter]).results[0]
    assert result.successful, result
