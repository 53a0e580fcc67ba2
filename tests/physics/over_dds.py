"""One motion of an arm with mass in real time: `dq_servo servo` is connected over DDS with MuJoCo, which uses a DDS implementation of
another vendor. Runs in a network namespace of its own, see `test_over_dds`. Usage: over_dds.py ARM velocity|integrating GOAL. Prints the
result as JSON.
"""

import json
import subprocess
import sys
import time
from dataclasses import asdict
from pathlib import Path

import dq_servo as dq
import numpy as np

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "tests/dds"))
import rows  # noqa: E402
from peer import EVERY, last, reader, ros, take, wait_matched, writer  # noqa: E402
from robot import Plant  # noqa: E402


class ServoOverDds:
    """The program as the servo of a `Robot`, whose time then follows the system clock."""

    def __init__(self, arm, parameters):
        servo = dq.Servo(arm, parameters)
        self.joints, self.parameters = servo.joints, servo.parameters
        # In alphabetical order, like joint_state_broadcaster.
        self.order = sorted(range(len(self.joints)), key=self.joints.__getitem__)
        given = [word for name, value in parameters.items() for word in ("-p", f"{name}:={value}")]
        program = [ROOT / "target/debug/dq_servo", "servo", "--arm", arm, "--ros-args", *given]
        self.process = subprocess.Popen(["timeout", "60", *program])
        self.states, self.goals = writer("joint_states", ros.JointState), writer("goal_pose", ros.PoseStamped)
        self.commands = reader("forward_velocity_controller/commands", ros.Float64MultiArray)
        self.statuses = reader("dq_servo/status", ros.DiagnosticStatus, EVERY)
        for entity in self.states, self.goals, self.commands, self.statuses:
            wait_matched(entity)
        self.began, self.said = None, []  # said: each status since the goal

    def cycle(self, now, positions=None, velocities=None, stamp=None, wrench=None):
        """At the clock time `now`: sends the joint state and takes the latest command. A late call does not wait, because the robot keeps
        moving."""
        self.began = self.began or (time.monotonic() - now, time.time() - now)
        time.sleep(max(0.0, self.began[0] + now - time.monotonic()))
        if positions is not None:
            self.states.write(self.joint_state(positions, velocities, round((self.began[1] + stamp) * 1e9)))
        self.said += take(self.statuses)
        command = last(self.commands)
        return None if command is None else np.array(command.data)

    def joint_state(self, positions, velocities, stamp):
        header = ros.Header(ros.Time(stamp // 10**9, stamp % 10**9))
        names, *numbers = ([values[i] for i in self.order] for values in (self.joints, positions, velocities))
        return ros.JointState(header, names, *numbers)

    def set_goal(self, goal):
        self.said = self.said[-1:]
        (x, y, z), (w, *axis) = goal.translation, goal.rotation
        self.goals.write(ros.PoseStamped(pose=ros.Pose(ros.Point(x, y, z), ros.Quaternion(*axis, w))))

    @property
    def state(self):
        return self.said[-1].message if self.said else ""

    @property
    def status(self):
        return {pair.key: pair.value for pair in self.said[-1].values} if self.said else {}

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.terminate()
        self.process.wait()


def main(arm, servos, goal):
    row = rows.Row("", Plant(arm, integrates=servos == "integrating"))
    with ServoOverDds(arm, row.parameters) as servo:
        result, _ = rows.run(row, int(goal), servo)
    result.states = sorted({status.message for status in servo.said})
    print(json.dumps(asdict(result)))


if __name__ == "__main__":
    main(*sys.argv[1:])
