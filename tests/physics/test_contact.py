"""Contact in MuJoCo: checks the page "Contact"."""

import unittest

import contact as c
import dq_servo as dq
import numpy as np


class Contact(unittest.TestCase):
    def test_a_wall_is_touched_softly_and_without_compliance_it_is_not(self):
        for arm in ["ur5e", "panda"]:
            for stiffness in [1e3, 1e4, 1e5]:
                for delay in [0.0, 0.02]:
                    with self.subTest(arm, stiffness=stiffness, delay=delay):
                        forces = c.press(c.Touching(c.Equipped(arm=arm, delay=delay), c.SOFT | c.told(stiffness), stiffness))
                        # The speed times the damping, then the spring; the wall stiffens while the tool is late.
                        late = delay + 0.02
                        bound = 1.0 + 500.0 * 0.02 + 0.05 * (max(300.0, 1.5 * stiffness * late) + stiffness * late)
                        self.assertLess(max(forces), bound)
                        self.assertEqual(c.bounces(forces), 0)
                        # At rest, 500 N/m press 20 mm, but for what the wall gives way, beyond the dead band of 1 N.
                        rest = (500.0 * 0.02 + 1.0) / (1.0 + 500.0 / stiffness)
                        self.assertLess(abs(forces[-1] - rest), 0.3 * rest)
        rigid = c.press(c.Touching(c.Equipped(), {}, 1e4), seconds=3.0)
        self.assertGreater(max(rigid), 80.0)

    def test_ten_newtons_are_kept_along_a_tilted_plane(self):
        for slope in [10.0, -10.0]:
            forces = c.slide(c.Touching(c.Equipped(), c.PRESSING, 1e4), np.radians(slope))
            self.assertLess(np.max(np.abs(forces - 10.0)), 1.0, slope)

    def test_a_peg_goes_into_its_hole_from_two_millimetres_aside(self):
        deep = [c.insert(number)[0] > 0.04 for number in range(20)]
        self.assertEqual(sum(deep), 20)

    def test_a_hand_guides_the_tool_and_it_stays(self):
        free = {"contact.stiffness": [0.0] * 6, "contact.largest_offset": [0.3, 1.0]}
        robot = c.Touching(c.Equipped(), c.SOFT | free)
        self.assertAlmostEqual(c.guide(robot), 0.2, delta=0.03)
        self.assertEqual(robot.servo.state, "settled")

    def test_the_weight_of_two_kilograms_is_found_and_taken_away_in_every_orientation(self):
        unknown = {"contact.tool_mass": 0.0, "contact.tool_center": [0.0, 0.0, 0.0], "contact.compliance": True}
        robot = c.Touching(c.Equipped(tool=2.0), unknown | {"contact.stiffness": [np.inf] * 6})
        robot.run(0.3)
        turn = lambda angle, axis: robot.home @ dq.Pose.from_angle_axis([0.0, 0.0, 0.0], angle, axis)
        robot.servo.identify_tool()
        for angle, axis in [(0.5, [1.0, 0.0, 0.0]), (-0.5, [1.0, 0.0, 0.0]), (0.5, [0.0, 1.0, 0.0]), (-0.5, [0.0, 1.0, 0.0])]:
            robot.go(turn(angle, axis))
            robot.run(8.0, until="settled", linger=0.5)
        mass, center = robot.servo.identified_tool()
        self.assertAlmostEqual(mass, 2.0, delta=0.02)
        self.assertLess(np.max(np.abs(center - [0.0, 0.0, c.LENGTH / 2])), 2e-3)
        robot.servo.configure({"contact.tool_mass": mass, "contact.tool_center": list(center)})
        robot.run(1.5)
        robot.servo.tare()
        for angle, axis in [(0.8, [1.0, 1.0, 0.0]), (-0.8, [1.0, 1.0, 0.0]), (0.9, [0.0, 1.0, 0.0]), (-0.9, [1.0, 0.0, 0.0])]:
            robot.go(turn(angle, axis / np.linalg.norm(axis)))
            robot.run(10.0, until="settled", linger=0.5)
            self.assertLess(robot.servo.status["contact_force_n"], 0.5)

    def test_noise_at_the_rates_of_sensors_moves_nothing(self):
        for period in [0.002, 0.008]:
            robot = c.Touching(c.Equipped(noise=2.0, state_period=period), c.SOFT)
            robot.run(0.5)
            robot.go(robot.at(0.0))
            robot.run(1.0)
            far = []
            robot.run(3.0, each=lambda robot: far.append(robot.servo.status["yielded_m"]))
            self.assertLess(max(far), 2e-3, period)
            self.assertEqual(robot.servo.state, "settled")

    def test_an_inverted_sensor_is_named_before_the_force_is_large(self):
        robot = c.Touching(c.Equipped(), c.SOFT, 1e4, sign=-1.0)
        forces = c.press(robot)
        self.assertIn("is the sign of wrench right", robot.servo.status["reason"])
        self.assertLess(max(forces), 60.0)


if __name__ == "__main__":
    unittest.main()
