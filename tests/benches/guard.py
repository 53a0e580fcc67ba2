"""Measures how long an arm without a timeout of its own continues to move when its servo is killed and a guard is running.

    unshare -r -n target/venv/bin/python tests/benches/guard.py PROGRAM [ROUNDS]

Measured with the clock of the robot, from `kill -9` to the first joint state at rest.
"""
import os
import signal
import statistics
import subprocess
import sys
import time

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path[:0] = [os.path.join(HERE, "..", "faults"), os.path.join(HERE, "..", "dds")]
PROGRAM = sys.argv[1]
ROUNDS = int(sys.argv[2]) if len(sys.argv) > 2 else 30
GOALS = ["-0.125 0.2 0.2 0 0 0 1".split(), "0.1 0.4 -0.1 0 0.38268343236509 0 0.92387953251129".split()]

for command in "ip link set lo up", "ip link set lo multicast on", "ip route add 224.0.0.0/4 dev lo":
    subprocess.run(command.split(), check=True)
os.environ["ROS_DOMAIN_ID"] = "54"

# Import this in the domain that was just set.
from watch import FOLLOWED, STATUS, States, run, wait


def start(*arguments):
    return subprocess.Popen([PROGRAM, *arguments], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


def killed(states, goal):
    """How long the arm continues to move when the servo is killed during a motion to the goal [s]."""
    STATUS.newest = None
    servo = start("servo")
    try:
        wait("the servo and its guard", lambda: STATUS.is_("holding") and STATUS.values()["guard"] == "watching")
        sender = start("goal", "--keep-going", *goal)
        wait("motion", lambda: states.speed() > 0.3)
        run(0.2)
        begin = time.time_ns()
    finally:
        servo.send_signal(signal.SIGKILL)
    wait("a standstill", lambda: states.speed() == 0.0)
    for process in servo, sender:
        process.kill()
        process.wait()
    return (states.stood - begin) * 1e-9


def main():
    nodes = [start("puma560", "--ros-args", "-p", "command_timeout:=10.0"), start("guard")]
    states = States()
    FOLLOWED.append(states)
    try:
        took = sorted(killed(states, GOALS[number % 2]) for number in range(ROUNDS))
    finally:
        for node in nodes:
            node.terminate()
            node.wait()
    within = sum(time <= 0.15 for time in took)
    print(f"{ROUNDS} servos killed in motion: median {statistics.median(took):.3f} s, 90 % {took[int(0.9 * ROUNDS)]:.3f} s, "
          f"worst {took[-1]:.3f} s; {within} within 0.15 s; load {os.getloadavg()[0]:.1f}")


main()
