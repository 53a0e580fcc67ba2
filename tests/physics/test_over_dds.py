"""Arms with mass driven by the program `dq_servo servo` over DDS in real time, once for each kind of actuator."""

import json
import subprocess
import sys
import unittest
from pathlib import Path

import rows
from test_physics import check

# A separate network with loopback only.
NETWORK = "ip link set lo up && ip link set lo multicast on && ip route add 224.0.0.0/4 dev lo"
# The number of attempts, for a busy machine.
ATTEMPTS = 3


def over_dds(*arguments):
    """The result of one motion, with robot and servo in a network namespace of their own, and their log."""
    program = [sys.executable, str(Path(__file__).with_name("over_dds.py")), *arguments]
    shell = ["sh", "-c", f'{NETWORK} && ROS_DOMAIN_ID=77 exec "$@"', "sh"]
    done = subprocess.run(["unshare", "--map-root-user", "--net", *shell, *program], capture_output=True, text=True, timeout=90)
    if done.returncode:
        raise AssertionError(done.stderr)
    result = rows.Result(**json.loads(done.stdout))
    result.states = set(result.states)
    return result, done.stderr


class OverDds(unittest.TestCase):
    def arrives_once(self, arm, servos):
        result, log = over_dds(arm, servos, "1")
        try:
            check(self, rows.Row("over DDS"), result)
            self.assertLess(result.settled, 3.0, "as in lockstep, or little later")
        except AssertionError as why:
            raise AssertionError(f"{why}\n{result}\n{log}") from None

    def arrives(self, *robot):
        for _ in range(ATTEMPTS - 1):
            try:
                return self.arrives_once(*robot)
            except AssertionError as why:
                print(f"{robot} is run again: {why}", file=sys.stderr)
        return self.arrives_once(*robot)

    def test_velocity_servos(self):
        self.arrives("ur5e", "velocity")

    def test_integrating_servos(self):
        self.arrives("panda", "integrating")


if __name__ == "__main__":
    unittest.main()
