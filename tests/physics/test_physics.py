"""Arms with mass in MuJoCo: checks the page "What happens on a real arm". PHYSICS_GOALS=8 tests each row with eight goals."""

import os
import re
import unittest
from dataclasses import replace

import numpy as np
import rows
from robot import PERIOD, Plant, Robot

GOALS = int(os.environ.get("PHYSICS_GOALS", "2"))
TOLERANCE = 1e-3  # [m], the servo's


def check(test, row, result):
    """Checks that a motion of the given row had the result that the page states."""
    test.assertLess(result.speed, 1.05, "no joint is faster than its limit")
    if row.says and result.last != "settled":
        test.assertRegex(result.reasons[-1], row.says)
        return
    test.assertIsNotNone(result.settled, result.reasons)
    test.assertEqual(result.last, "settled", result.reasons)
    test.assertLess(result.error, TOLERANCE)
    # Under a push or another payload the arm may fail to follow for a moment, and passes its goal.
    undisturbed = row.push is None and row.load is None
    if undisturbed:
        test.assertTrue(result.stays, "what has settled stays settled")
        test.assertLessEqual(result.states, {"holding", "tracking", "settled"}, "no false alarm")
    if row.plant.slider == 1.0:
        test.assertFalse([reason for reason in result.reasons if "told to be slow" in reason])
    if undisturbed and "integral" in row.parameters and "controller" not in row.parameters:
        test.assertLess(result.overshoot, 1e-3)


class Rows(unittest.TestCase):
    def test_every_row_of_the_page(self):
        for row in rows.ROWS:
            for number in range(GOALS):
                with self.subTest(row.name, goal=number):
                    check(self, row, rows.run(row, number)[0])

    def test_the_integral_costs_nothing_where_nothing_pulls(self):
        for number in range(GOALS):
            without, _ = rows.run(rows.Row("", rows.UR5E), number)
            held, _ = rows.run(rows.Row("", rows.UR5E, rows.HELD), number)
            self.assertLess(held.settled, without.settled + 0.1)


class Standing(unittest.TestCase):
    """An arm that gets no commands any more."""

    def stopped(self, parameters):
        robot = Robot(replace(rows.UR5E, payload=2.0), parameters)
        robot.run(0.2)
        robot.go(robot.random_goal(0))
        robot.run(1.0)
        robot.servo.stop()
        robot.run(1.5)
        before = robot.data.qpos.copy()
        seen = robot.run(2.5)
        self.assertEqual(set(seen.states), {"holding"})
        return np.max(np.abs(robot.data.qpos - before)), robot.servo.status.get("reason", "")

    def test_one_that_sinks_says_so_with_joint_and_speed(self):
        way, reason = self.stopped({})
        self.assertGreater(way, 0.02)
        joint, speed = re.search(r"sagging: (\w+) moves at (-?[\d.]+) rad/s", reason).groups()
        self.assertIn(joint, Robot(rows.UR5E).servo.joints)
        self.assertAlmostEqual(abs(float(speed)), way / 2.5, delta=0.3 * way / 2.5)

    def test_with_the_integral_it_stays_where_it_was_stopped(self):
        way, reason = self.stopped(rows.HELD)
        self.assertLess(way, 1e-3)
        self.assertNotIn("sagging", reason)


class Faults(unittest.TestCase):
    def test_nothing_moves_when_an_emergency_stop_is_released(self):
        for integrates in [False, True]:
            for parameters in [{}, rows.HELD]:
                robot = Robot(replace(rows.UR5E, integrates=integrates), parameters)
                robot.run(0.2)
                robot.go(robot.random_goal(1))
                robot.run(0.6)
                robot.stopped = True
                robot.run(10.0)
                self.assertEqual(robot.servo.status["revoked_by"], "not_obeyed")
                before = robot.data.qpos.copy()
                robot.stopped = False
                seen = robot.run(3.0)
                self.assertLess(np.max(np.abs(robot.data.qpos - before)), 2e-3, (integrates, parameters))
                self.assertLess(np.max(np.abs(seen.array("velocities"))), 0.05)
                # A new request makes the arm go on.
                robot.servo.pause(False)
                robot.run(10.0, until="settled")
                self.assertEqual(robot.servo.state, "settled")

    def test_the_part_of_the_speed_at_which_a_slowed_robot_moves_is_found(self):
        robot = Robot(replace(rows.UR5E, slider=0.2))
        robot.run(0.2)
        robot.go(robot.random_goal(0))
        robot.run(20.0, until="settled")
        self.assertEqual(robot.servo.state, "settled")
        self.assertAlmostEqual(robot.servo.status["speed_factor"], 0.2, delta=0.02)

    def test_a_table_in_the_way_is_told_with_the_joint_and_the_arm_stops_pressing(self):
        robot = Robot(Plant(table=0.1))
        robot.run(0.2)
        start = robot.chain.forward_kinematics(robot.start)
        down = np.array([0.0, 0.0, 0.02 - start.translation[2]])
        robot.go(type(start)(start.translation + down, start.rotation))
        touched, loose = [None], [None]

        def watch(robot):
            if touched[0] is None and robot.data.ncon:
                touched[0] = robot.now
            if loose[0] is None and touched[0] is not None and not np.any(robot.command):
                loose[0] = robot.now

        seen = robot.run(8.0, each=watch)
        told = seen.first("not_following")
        self.assertIsNotNone(touched[0])
        self.assertLess(told - touched[0], 0.5)
        self.assertLess(loose[0] - touched[0], 0.7)
        reasons = " ".join(seen.reasons)
        self.assertRegex(reasons, r"\w+_joint does not follow: contact\?")
        self.assertEqual(robot.servo.status["revoked_by"], "not_obeyed")


if __name__ == "__main__":
    unittest.main()
