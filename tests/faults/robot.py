"""A robot whose joint states can be corrupted, and which follows the commands of the servo."""
import random
import time

from peer import EVERY, reader, ros, take, wait_matched, writer

COMMANDS = "forward_velocity_controller/commands"
JOINTS = [f"joint{i}" for i in range(1, 7)]
# theta_initial of the reference work [rad].
START = [0.7853981633974483, 1.0471975511965976, 2.356194490192345, 0.5235987755982988, -0.7853981633974483, 2.0943951023931953]
RATE = 250.0
# What marks the commands of a rival in these cases.
RIVAL = "rival"


class Commands:
    """Records every command of the servo or a guard with its source (the commands of a guard carry a mark), and the record of the servo's
    cycles."""

    def __init__(self):
        self.source, self.kept, self.senders = reader(COMMANDS, ros.Float64MultiArray, EVERY), [], set()
        self.events, self.records = reader("dq_servo/events", ros.UInt8MultiArray, EVERY), []

    def poll(self):
        samples = take(self.source)
        self.senders |= {c.sample_info.publication_handle for c in samples}
        commands = [(c.layout.dim[0].label if c.layout.dim else "", list(c.data)) for c in samples]
        self.kept += [(mark, data) for mark, data in commands if mark != RIVAL]
        self.records += [bytes(record.data) for record in take(self.events)]

    def wait_for_record(self, seconds):
        end = time.monotonic() + seconds
        while not self.records and time.monotonic() < end:
            self.poll()
            time.sleep(0.005)

    def newest(self):
        return self.kept[-1][1] if self.kept else [0.0] * 6

    def speed(self):
        return max(map(abs, self.newest()))

    def write(self, path):
        """Writes one record on each line. Rust code checks the invariants on these records."""
        self.poll()
        with open(path, "w", encoding="utf-8") as out:
            out.writelines(record.hex() + "\n" for record in self.records)


class Robot:
    """Follows the commands immediately, but slower by `pull` [rad/s], and publishes its joint states through `spoil`, which returns the state to send, or None."""

    def __init__(self, commands):
        self.commands, self.states = commands, writer("joint_states", ros.JointState)
        self.position, self.spoil, self.pull = list(START), honest, [0.0] * 6
        self.next = self.before = time.monotonic()
        wait_matched(self.states)

    def poll(self):
        now = time.monotonic()
        if now < self.next:
            return
        self.next = max(self.next + 1 / RATE, now - 1 / RATE)
        velocity = [command - pull for command, pull in zip(self.commands.newest(), self.pull)]
        self.position = [p + v * (now - self.before) for p, v in zip(self.position, velocity)]
        self.before = now
        stamp = time.time_ns()
        header = ros.Header(stamp=ros.Time(stamp // 10**9, stamp % 10**9))
        for state in self.spoil(ros.JointState(header, list(JOINTS), list(self.position), list(velocity))):
            self.states.write(state)


class Gripper:
    """Publishes six other joints on the topic of the arm."""

    def __init__(self):
        self.states, self.next = writer("joint_states", ros.JointState), 0.0
        wait_matched(self.states)

    def poll(self):
        now = time.monotonic()
        if now >= self.next:
            self.next = now + 0.004
            fingers = [f"finger{i}" for i in range(6)]
            self.states.write(ros.JointState(ros.Header(), fingers, [0.1] * 6, [0.0] * 6))


def honest(state):
    return [state]


def silent(_):
    return []


class Frozen:
    """Sends the same state repeatedly, with new stamps."""

    def __init__(self):
        self.position = None

    def __call__(self, state):
        self.position = self.position or state.position
        state.position, state.velocity = self.position, [0.0] * 6
        return [state]


class Reordered:
    """Sends four states at a time in random order, so that older stamps arrive after newer ones."""

    def __init__(self):
        self.queue, self.random = [], random.Random(1)

    def __call__(self, state):
        self.queue.append(state)
        if len(self.queue) < 4:
            return []
        self.random.shuffle(self.queue)
        out, self.queue = self.queue, []
        return out


def odd(state):
    """Sets the stamp one hour back, and puts the joints in another order and among other joints."""
    state.header.stamp.sec -= 3600
    return ros.JointState(state.header, ["gripper"] + state.name[::-1] + ["lid"], [float("nan")] + state.position[::-1] + [9.0], [])


def nan(state):
    state.position[2] = float("nan")
    return [state]


class Huge:
    """Sends a state with 10⁵ joints now and then between valid states. Every other one contains the joints of the arm at the end."""

    def __init__(self):
        self.count, self.sent = 0, [0, 0]
        self.names, self.zeros = [f"j{i}" for i in range(10**5 - 6)], [0.0] * (10**5 - 6)

    def __call__(self, state):
        self.count += 1
        if self.count % 50:
            return [state]
        others = self.count // 50 % 2
        self.sent[others] += 1
        ours = ([], []) if others else (state.name, state.position)
        return [ros.JointState(state.header, self.names + ours[0], self.zeros + ours[1], [])]
