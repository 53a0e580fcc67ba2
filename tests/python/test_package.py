"""Tests the Python package against itself, against Pinocchio, and against the data of the program."""

import ast
import copy
import inspect
import pickle
import tempfile
import unittest
import weakref
from pathlib import Path
from unittest import mock

import dq_servo as dq
import numpy as np
from dq_servo import _native

ROOT = Path(__file__).resolve().parents[2]
START = np.array([0.0, -1.57, 1.57, -1.57, -1.57, 0.0])
RANDOM = np.random.default_rng(7)


class Integral:
    """A law with a memory: the integral of the error."""

    memory = 6

    def twist(self, goal, body_twist, dt, memory):
        memory += dt * goal.screw_log()
        return goal.screw_log() + memory


class Beginning:
    """A law that notes when a motion begins."""

    memory = 1

    def __init__(self):
        self.begun = []

    def begin(self, body_twist, memory):
        self.begun.append(np.array(body_twist))
        memory[0] = 3.0

    def twist(self, goal, body_twist, dt, memory):
        return memory[0] * goal.screw_log()


def random_pose():
    return dq.Pose.screw_exp(RANDOM.uniform(-1.5, 1.5, 6))


class Algebra(unittest.TestCase):
    def test_products_are_those_of_matrices(self):
        for _ in range(100):
            a, b = random_pose(), random_pose()
            np.testing.assert_allclose((a * b).matrix(), a.matrix() @ b.matrix(), atol=1e-12)
            np.testing.assert_allclose((a * a.conjugate()).matrix(), np.eye(4), atol=1e-12)
            np.testing.assert_allclose((-a).matrix(), a.matrix())
            p, q = a.dual_quaternion + 0.1, b.dual_quaternion - 0.2
            np.testing.assert_allclose(dq.dual_hamilton_plus(p) @ q, dq.multiply(p, q), atol=1e-12)
            np.testing.assert_allclose(dq.dual_hamilton_minus(q) @ p, dq.multiply(p, q), atol=1e-12)
            np.testing.assert_allclose(dq.hamilton_plus(p[:4]) @ q[:4], dq.multiply(p, q)[:4], atol=1e-12)
            np.testing.assert_allclose(dq.hamilton_minus(q[:4]) @ p[:4], dq.multiply(p, q)[:4], atol=1e-12)
            np.testing.assert_allclose(dq.conjugate(p)[:4], p[:4] * [1, -1, -1, -1])

    def test_a_pose_comes_back_from_each_of_its_forms(self):
        for _ in range(100):
            pose = random_pose()
            for back in [
                dq.Pose(pose.translation, pose.rotation),
                dq.Pose.from_matrix(pose.matrix()),
                dq.Pose.from_dual_quaternion(3.0 * pose.dual_quaternion),
                dq.Pose.screw_exp(pose.screw_log()),
                dq.Pose.half_exp(pose.half_log()),
                eval(repr(pose), {"Pose": dq.Pose}),
            ]:
                np.testing.assert_allclose(back.matrix(), pose.matrix(), atol=1e-12)
        twist = RANDOM.uniform(-1, 1, 6)
        moved = dq.Pose.screw_exp(pose.adjoint() @ twist).matrix()
        np.testing.assert_allclose(moved, (pose * dq.Pose.screw_exp(twist) * pose.conjugate()).matrix(), atol=1e-12)
        turned = dq.Pose.from_angle_axis([1, 2, 3], 0.5, [0, 0, 2])
        np.testing.assert_allclose(turned.rotation, [np.cos(0.25), 0, 0, np.sin(0.25)])

    def test_poses_chains_and_laws_are_copied_and_pickled(self):
        chains = [dq.Chain.builtin("ur5e"), dq.Chain.from_dh([[0, 0.5, 0, 0], [0, 0.25, 0, 0]], "standard_dh")]
        for back in [lambda it: pickle.loads(pickle.dumps(it)), copy.copy, copy.deepcopy]:
            pose = random_pose()
            self.assertEqual(back(pose), pose)
            self.assertEqual(pose @ back(pose).inverse(), pose * pose.conjugate())
            for chain in chains:
                theta = RANDOM.uniform(-1, 1, chain.joint_count)
                self.assertEqual(back(chain).forward_kinematics(theta), chain.forward_kinematics(theta))
            law = back(dq.Law("logc", [2.0, 3.0], aim="position"))
            self.assertEqual(repr(law), repr(dq.Law("logc", [2.0, 3.0])))
            self.assertEqual(back(dq.Law(Integral(), 3.0, map="transpose")).gains, [3.0, 3.0])

    def test_a_screw_motion_is_between_its_ends(self):
        start, end = random_pose(), random_pose()
        half = start.sclerp(end, 0.5)
        np.testing.assert_allclose((start.inverse() @ half).matrix(), (half.inverse() @ end).matrix(), atol=1e-9)

    def test_what_is_no_pose_is_refused_with_what_was_expected(self):
        for make, words in [
            (lambda: dq.Pose([0, 0, 0], [2, 0, 0, 0]), "norm 2"),
            (lambda: dq.Pose([0, 0], [1, 0, 0, 0]), "translation has 2 numbers, expected 3"),
            (lambda: dq.Pose([0, 0, np.nan], [1, 0, 0, 0]), "finite"),
            (lambda: dq.Pose.from_matrix(2 * np.eye(4)), "does not rotate"),
            (lambda: dq.Pose.from_matrix(np.eye(3)), "3 numbers, expected 4"),
            (lambda: dq.Pose.from_dual_quaternion(np.zeros(8)), "real part is 0"),
            (lambda: dq.Pose.from_angle_axis([0, 0, 0], 1, [0, 0, 0]), "axis"),
            (lambda: dq.hamilton_plus([1, 2, 3]), "3 numbers, expected 4"),
        ]:
            with self.assertRaisesRegex(ValueError, words):
                make()


class Kinematics(unittest.TestCase):
    def test_pinocchio_agrees_on_poses_and_jacobians_of_a_robot_description(self):
        import pinocchio

        text = (ROOT / "tests/data/urdf/ur5.urdf").read_text()
        model = pinocchio.buildModelFromXML(text)
        data, frame = model.createData(), model.getFrameId("tool0")
        chain = dq.Chain.from_urdf(text, "base_link", "tool0")
        for _ in range(50):
            theta = RANDOM.uniform(-3, 3, 6)
            pinocchio.forwardKinematics(model, data, theta)
            pinocchio.updateFramePlacements(model, data)
            root = data.oMf[model.getFrameId("base_link")].homogeneous
            pose = np.linalg.inv(root) @ data.oMf[frame].homogeneous
            np.testing.assert_allclose(chain.forward_kinematics(theta).matrix(), pose, atol=1e-12)
            jacobian = pinocchio.computeFrameJacobian(model, data, theta, frame, pinocchio.LOCAL)
            ours = chain.body_jacobian(theta)
            np.testing.assert_allclose(ours, np.vstack([jacobian[3:], jacobian[:3]]), atol=1e-12)

    def test_jacobians_are_of_one_motion(self):
        chain = dq.Chain.builtin("panda")
        theta, theta_dot = RANDOM.uniform(-1, 1, 7), RANDOM.uniform(-1, 1, 7)
        pose, twist = chain.forward_kinematics(theta), chain.jacobian(theta) @ theta_dot
        np.testing.assert_allclose(chain.twist(theta, theta_dot), twist, atol=1e-12)
        turn = pose.matrix()[:3, :3]
        body = chain.body_jacobian(theta) @ theta_dot
        np.testing.assert_allclose(np.hstack([turn @ body[:3], turn @ body[3:]]), twist, atol=1e-12)
        step = 1e-7
        later = chain.forward_kinematics(theta + step * theta_dot).dual_quaternion
        rate = chain.pose_jacobian(theta) @ theta_dot
        np.testing.assert_allclose((later - pose.dual_quaternion) / step, rate, atol=1e-6)
        self.assertEqual(len(chain.link_poses(theta)), 7)

    def test_batches_are_the_same_calls_one_after_the_other(self):
        chain, law = dq.Chain.builtin("ur5e"), dq.Law("logc", [2.0, 3.0])
        thetas = RANDOM.uniform(-3, 3, (20, 6))
        goals = np.array([random_pose().dual_quaternion for _ in thetas])
        poses, jacobians = chain.forward_kinematics_batch(thetas), chain.jacobian_batch(thetas)
        speeds = law.step_batch(chain, thetas, goals)
        for i, theta in enumerate(thetas):
            np.testing.assert_array_equal(chain.jacobian(theta), jacobians[i])
            np.testing.assert_array_equal(chain.forward_kinematics(theta).dual_quaternion, poses[i])
            goal = dq.Pose.from_dual_quaternion(goals[i])
            np.testing.assert_allclose(law.step(chain, theta, goal), speeds[i], rtol=1e-9, atol=1e-12)
        # Neither the memory order nor the type matters.
        np.testing.assert_array_equal(chain.jacobian_batch(np.asfortranarray(thetas)), jacobians)
        whole = chain.forward_kinematics([0, -1, 1, -1, -1, 0]).matrix()
        np.testing.assert_array_equal(chain.forward_kinematics(np.array([0, -1, 1, -1, -1, 0])).matrix(), whole)

    def test_rows_of_both_conventions_make_a_chain(self):
        planar = dq.Chain.from_dh([[0, 0.5, 0, 0], [0, 0.25, 0, 0]], "standard_dh")
        np.testing.assert_allclose(planar.forward_kinematics([0, 0]).translation, [0.75, 0, 0])
        craig = dq.Chain.from_dh([[0, 0, 0, 0], [0, 0.5, 0, 0], [0, 0.25, 0, 0]])
        np.testing.assert_allclose(craig.forward_kinematics([0, 0, 0]).translation, [0.75, 0, 0])

    def test_bad_input_is_refused_with_what_was_expected(self):
        chain = dq.Chain.builtin("ur5e")
        for call, words in [
            (lambda: dq.Chain.builtin("ur6e"), "expected one of puma560"),
            (lambda: dq.Chain.from_dh([[0, 0, 0]]), "3 numbers, expected 4"),
            (lambda: dq.Chain.from_dh([[0, 0, 0, 0]], "craig"), "craig"),
            (lambda: dq.Chain.from_urdf("<robot", "a", "b"), "."),
            (lambda: chain.forward_kinematics([0, 0]), "6"),
            (lambda: chain.jacobian_batch(np.zeros((2, 5))), "5 numbers, expected 6"),
            (lambda: dq.Law("logc").step_batch(chain, np.zeros((2, 6)), np.zeros((3, 8))), "3 goals for 2"),
            (lambda: dq.Law("pid"), "pid"),
            (lambda: dq.Law("logc", [1.0, 2.0, 3.0]), "2 gains, got 3"),
            (lambda: dq.Law("logc", float("nan")), "gain NaN"),
            (lambda: dq.Law("logc", aim="there"), "there"),
        ]:
            with self.assertRaisesRegex(ValueError, words):
                call()
        with self.assertRaises(TypeError):
            dq.Law(3)


class Laws(unittest.TestCase):
    def test_every_law_of_the_table_leads_to_the_goal(self):
        chain = dq.Chain.builtin("ur5e")
        goal = chain.forward_kinematics(START + 0.2)
        before = np.linalg.norm((goal.conjugate() * chain.forward_kinematics(START)).screw_log())
        for name in dq.laws():
            law, theta = dq.Law(name), START
            for _ in range(300):
                theta = theta + 0.002 * law.step(chain, theta, goal)
            after = np.linalg.norm((goal.conjugate() * chain.forward_kinematics(theta)).screw_log())
            self.assertLess(after, 0.7 * before, name)
        self.assertEqual(len(dq.laws()), 12)

    def test_a_function_is_a_law_by_either_map(self):
        chain, goal = dq.Chain.builtin("ur5e"), random_pose()
        for name, error in [("logc", lambda goal: goal.screw_log()), ("logc_transpose", lambda goal: goal.screw_log())]:
            map = "transpose" if name.endswith("transpose") else "damped_inverse"
            own, known = dq.Law(error, [2.0, 3.0], map=map), dq.Law(name, [2.0, 3.0])
            for _ in range(20):
                theta = RANDOM.uniform(-3, 3, 6)
                ours, theirs = own.step(chain, theta, goal), known.step(chain, theta, goal)
                np.testing.assert_allclose(ours, theirs, rtol=1e-9, atol=1e-12)

    def test_the_memory_of_a_law_lasts_for_a_motion(self):
        drifts = {}
        for law in [dq.Law("logc", 2.0), dq.Law(Integral(), 2.0)]:
            servo, theta = dq.Servo("ur5e", {"progress_timeout": 0.0}, law=law), START
            servo.set_goal(dq.Chain.builtin("ur5e").forward_kinematics(START + 0.2))
            for cycle in range(1, 8000):
                output = servo.cycle(0.002 * cycle, theta)
                theta = theta + 0.002 * (0.01 + (output if output is not None else 0))
            drifts[law.name] = servo.status["position_error_m"]
        self.assertGreater(drifts["logc"], 3e-3)
        self.assertLess(drifts["own"], 1e-4)
        law, chain, theta = Beginning(), dq.Chain.builtin("ur5e"), START
        servo = dq.Servo("ur5e", law=dq.Law(law))
        for cycle in range(1, 2000):
            if cycle in (1, 1200):
                servo.set_goal(chain.forward_kinematics(START + 1e-4 * cycle))
            output = servo.cycle(0.002 * cycle, theta)
            theta = theta + 0.002 * (output if output is not None else 0)
        self.assertEqual(len(law.begun), 2)
        self.assertEqual(np.abs(law.begun[0]).max(), 0.0)
        self.assertLess(servo.status["position_error_m"], 0.02)

    def test_a_law_with_a_memory_gives_the_same_results_in_each_run(self):
        law = dq.Law(Integral(), 2.0)
        first, second = (dq.compare(law, "puma560", 12) for _ in range(2))
        for name, values in first.items():
            np.testing.assert_array_equal(values, second[name])

    def test_what_a_function_raises_is_raised(self):
        chain, goal = dq.Chain.builtin("ur5e"), random_pose()

        def broken(goal):
            raise ZeroDivisionError("of the law")

        law = dq.Law(broken)
        for call in [
            lambda: law.step(chain, START, goal),
            lambda: law.step_batch(chain, [START], [goal.dual_quaternion]),
            lambda: dq.compare(law, "ur5e", 2),
        ]:
            with self.assertRaisesRegex(ZeroDivisionError, "of the law"):
                call()
        with self.assertRaisesRegex(ValueError, "the law's twist has 2 numbers"):
            dq.Law(lambda goal: [1.0, 2.0]).step(chain, START, goal)
        servo = dq.Servo("ur5e", law=law)
        servo.set_goal(chain.forward_kinematics(START + 0.1))
        with self.assertRaises(ZeroDivisionError):
            for cycle in range(1, 50):
                servo.cycle(0.002 * cycle, START)
        self.assertFalse(np.any(servo.command), "no arm moves by a law that raises")


def drive(servo, goal, theta, seconds=20.0):
    """Moves to a goal: a pose, or joint positions. Returns the joint positions at which the arm settles."""
    theta, theta_dot = np.array(theta, dtype=float), np.zeros(len(theta))
    servo.set_goal(goal) if isinstance(goal, dq.Pose) else servo.set_joint_goal(goal)
    for cycle in range(1, int(seconds / 0.002)):
        output = servo.cycle(0.002 * cycle, theta, theta_dot)
        if output is not None:
            theta_dot = output
        theta = theta + 0.002 * theta_dot
        if servo.state == "settled":
            return theta
    raise AssertionError(servo.state)


class TheServo(unittest.TestCase):
    def test_an_arm_goes_to_its_goal_by_laws_of_both_kinds(self):
        chain = dq.Chain.builtin("ur5e")
        goal = dq.Pose([0.1, 0.05, -0.1], [1, 0, 0, 0]) * chain.forward_kinematics(START)
        ends = []
        for law in [dq.Law("logc", 2.0), dq.Law(lambda goal: goal.screw_log(), 2.0), None]:
            servo = dq.Servo("ur5e", law=law)
            self.assertIsNone(servo.pose)
            ends.append(drive(servo, goal, START))
            self.assertLess(servo.status["position_error_m"], 1e-3)
            self.assertLess(np.linalg.norm(servo.pose.translation - goal.translation), 1.1e-3)
        np.testing.assert_allclose(ends[1], ends[0], atol=1e-6)

    def test_an_arm_goes_to_joint_goals_of_all_joints_or_by_name(self):
        end = drive(dq.Servo("ur5e"), START + 0.3, START)
        np.testing.assert_allclose(end, START + 0.3, atol=5e-3)
        servo = dq.Servo("ur5e")
        servo.cycle(0.001, START, np.zeros(6))
        end = drive(servo, {servo.joints[5]: 0.5}, START)
        np.testing.assert_allclose(end, [*START[:5], 0.5], atol=5e-3)
        with self.assertRaisesRegex(ValueError, '"elbow" is not a joint, expected shoulder_pan_joint'):
            servo.set_joint_goal({"elbow": 1.0})
        # The goal that is set last counts.
        servo.set_joint_goal(START + 0.3)
        servo.set_goal(servo.pose)
        servo.cycle(20.0, end)
        self.assertLess(servo.status["position_error_m"], 1e-12)
        for positions, words in [(START[:5], "5 numbers, expected 6"), (START + 99.0, "limits"), ({}, "no positions")]:
            servo.set_joint_goal(positions)
            with self.assertRaisesRegex(ValueError, words):
                servo.cycle(20.0, end)

    def test_two_arms_move_relative_to_each_other(self):
        side_by_side, start = dq.Pose([0, 0.8, 0], [1, 0, 0, 0]), np.concatenate([START, START])
        for law, primitive in [(None, "relative_pose"), (None, "relative_position"), (dq.Law(lambda goal: goal.screw_log(), 2.0), None)]:
            parameters = {"primitive": primitive} if primitive else {}
            servo = dq.Servo("ur5e", parameters, law=law, right_base=side_by_side)
            self.assertEqual(len(servo.joints), 12)
            self.assertEqual([name[:5] for name in servo.joints[5:7]], ["left/", "right"])
            servo.cycle(0.001, start, np.zeros(12))
            apart = servo.pose.translation
            theta = drive(servo, dq.Pose(0.75 * apart, servo.pose.rotation), start)
            chain = dq.Chain.builtin("ur5e")
            left, right = chain.forward_kinematics(theta[:6]), side_by_side @ chain.forward_kinematics(theta[6:])
            np.testing.assert_allclose((left.inverse() @ right).translation, 0.75 * apart, atol=2e-3)
            self.assertFalse(np.allclose(theta[:6], START) or np.allclose(theta[6:], START), "both arms move")
        self.assertEqual(drive(servo, {"right/wrist_3_joint": 0.2}, theta).shape, (12,))
        for call, words in [
            (lambda: servo.cycle(90.0, theta[:6]), "6 numbers, expected 12"),
            (lambda: dq.Servo("ur5e", law=dq.Law("logc"), right_base=side_by_side), "logc"),
            (lambda: dq.Servo("ur5e", {"task": "position"}, right_base=side_by_side), "dual_servo has no parameter .task"),
            (lambda: dq.Servo("ur5e", {"primitive": "relative_pose"}), "dq_servo has no parameter .primitive"),
        ]:
            with self.assertRaisesRegex(ValueError, words):
                call()

    def test_an_own_law_is_freed_with_its_last_user(self):
        class Big(Integral):
            def __init__(self):
                self.data = bytearray(1_000_000)

        def resident():
            return int(Path("/proc/self/statm").read_text().split()[1]) * 4096

        for _ in range(20):
            dq.Law(Big())
        before = resident()
        for _ in range(200):
            dq.Law(Big(), 2.0)
        self.assertLess(resident() - before, 20e6)
        big = Big()
        alive, servo = weakref.ref(big), dq.Servo("ur5e", law=dq.Law(big))
        del big
        servo.set_goal(dq.Chain.builtin("ur5e").forward_kinematics(START + 0.2))
        for cycle in range(1, 100):
            servo.cycle(0.002 * cycle, START)
        self.assertIsNotNone(alive(), "the servo uses it")
        self.assertEqual(servo.status["law"], "own")
        servo.configure({"controller": "logc"})
        self.assertIsNone(alive())
        servo.cycle(0.2, START)

    def test_every_parameter_is_taken_by_its_ros_name(self):
        planar = {
            "joints": ["shoulder", "elbow"], "base_frame": "base", "tool_frame": "hand",
            "arm.convention": "standard_dh", "arm.alpha": [0, 0], "arm.a": np.array([0.5, 0.25]), "arm.d": [0.0, 0.0],
            "limits.joint_velocity": [1.0, 1.0], "limits.joint_acceleration": [5, 5],
        }
        servo = dq.Servo(None, planar, law=dq.Law("logc", 20.0, aim="position"))
        self.assertEqual(servo.joints, ["shoulder", "elbow"])
        self.assertEqual(servo.parameters["task"], "position")
        self.assertEqual(servo.parameters["gains.logc"], [20.0, 20.0])
        servo.configure({"limits.joint_velocity": [0.2, 0.2], "goal_tolerance.linear": 0.002, "limits.jerk": [50.0]})
        chain = dq.Chain.from_dh([[0, 0.5, 0, 0], [0, 0.25, 0, 0]], "standard_dh")
        drive(servo, chain.forward_kinematics([0.8, 0.9]), [0.1, 0.3])
        self.assertLessEqual(servo.status["peak_joint_speed_rad_s"], 0.2 + 1e-12)
        self.assertEqual(servo.status["task"], "position")
        before = servo.parameters
        for changes, words in [
            ({"limits.joint_velocity": [0.2]}, "limits.joint_velocity.*expected 2 numbers"),
            ({"limits.linear_speed": "fast"}, "limits.linear_speed"),
            ({"limits.linear_sped": 0.1}, "limits.linear_speed"),
            ({"update_rate": 100}, "update_rate"),
            ({"goal_tolerance.linear": 0.1, "controller": "pid"}, "controller"),
            ({"posture.gain": object()}, "posture.gain.*has no value"),
        ]:
            with self.assertRaisesRegex(ValueError, words):
                servo.configure(changes)
        self.assertEqual(servo.parameters, before, "all of them are set, or none")
        self.assertEqual(dq.Servo(str(ROOT / "src/config/msg_config/arms/panda.yaml")).joints, dq.Servo("panda").joints)

    def test_the_parameters_are_those_of_the_node(self):
        servo = dq.Servo("ur5e")
        in_file = ["joints", "arm.alpha", "gains.logc", "limits.joint_velocity", "limits.joint_position_upper"]
        live = ["controller", "constraints", "keep_out", "limits.jerk", "reconfigure", "latency", "posture.gain"]
        self.assertLessEqual({*in_file, *live}, set(servo.parameters))
        # Another servo accepts the parameters of a servo.
        self.assertEqual(dq.Servo(None, servo.parameters).parameters, servo.parameters)

    def test_constraints_keep_the_arm_out_and_the_status_says_so(self):
        chain = dq.Chain.builtin("ur5e")
        table = {"constraints": True, "keep_out": ["table half_space 0 0 1 0.1"], "progress_timeout": 1.0}
        servo, theta = dq.Servo("ur5e", table), START
        start = chain.forward_kinematics(START)
        goal = dq.Pose([0, 0, -start.translation[2]], [1, 0, 0, 0]) * start
        servo.set_goal(goal)
        for cycle in range(1, 5000):
            output = servo.cycle(0.002 * cycle, theta)
            theta = theta + 0.002 * (output if output is not None else 0)
            self.assertGreater(chain.forward_kinematics(theta).translation[2], 0.1)
        status = servo.status
        self.assertEqual((status["state"], status["stall"], status["keep_outs"]), ("stalled", "constrained", 1))
        self.assertIn("table", status["reason"])
        self.assertIs(status["consent"], True)
        self.assertEqual(len(status["goal"]), 7)
        servo.stop()
        servo.cycle(10.0, theta)
        self.assertEqual((servo.status["revoked_by"], servo.status["consent"]), ("stop", False))
        with self.assertWarnsRegex(UserWarning, "constraints is false"):
            dq.Servo("ur5e", {"keep_out": ["table half_space 0 0 1 0.1"]})

    def test_an_arm_that_has_stalled_goes_round_where_that_is_asked_for(self):
        chain = dq.Chain.builtin("ur5e")
        limits = {"limits.joint_position_upper": [6.28, 6.28, 2.0, 6.28, 6.28, 6.28], "progress_timeout": 1.0}
        servo, theta, now = dq.Servo("ur5e", limits), START, 0.0
        with self.assertRaisesRegex(ValueError, "no motion has stalled"):
            servo.reconfigure()
        servo.set_goal(chain.forward_kinematics([0.0, -1.57, 2.6, -1.57, -1.57, 0.0]))
        while servo.state != "settled" and now < 40.0:
            now += 0.002
            output = servo.cycle(now, theta)
            theta = theta + 0.002 * (output if output is not None else 0)
            if servo.status["reconfiguration"] == "found":
                self.assertIn("is reachable", servo.status["reason"])
                servo.reconfigure()
        self.assertEqual(servo.state, "settled")
        self.assertLess(theta[2], 2.0)

    def test_joint_states_come_when_they_come_with_their_stamps(self):
        chain = dq.Chain.builtin("ur5e")
        servo = dq.Servo("ur5e")
        servo.set_goal(chain.forward_kinematics(START + 0.2))
        late, theta = [START] * 11, START
        for cycle in range(1, 2000):
            now = 0.002 * cycle
            # At 125 Hz, each state 20 ms old.
            state = {"positions": late[-11], "stamp": now - 0.02} if cycle % 4 == 0 else {}
            output = servo.cycle(now, **state)
            theta = theta + 0.002 * (output if output is not None else 0)
            late.append(theta)
        self.assertEqual(servo.state, "settled")
        self.assertAlmostEqual(servo.status["latency_ms"], 20.0, delta=2.0)
        for cycle in range(2000, 2100):
            servo.cycle(0.002 * cycle)
        self.assertEqual(servo.state, "stale_state")

    def test_a_function_rules_until_another_law_does(self):
        servo = dq.Servo("ur5e", law=dq.Law(lambda goal: goal.screw_log(), 2.0))
        self.assertEqual(servo.status["law"], "own")
        servo.configure({"limits.linear_speed": 0.5})
        self.assertEqual(servo.status["law"], "own")
        servo.configure({"controller": "diffc"})
        self.assertEqual(servo.status["law"], "diffc")
        servo.configure(law=dq.Law("logc", 3.0))
        self.assertEqual((servo.status["law"], servo.parameters["gains.logc"]), ("logc", [3.0, 3.0]))

    def test_what_it_does_not_take_is_said(self):
        servo = dq.Servo("ur5e")
        for call, words in [
            (lambda: servo.cycle(0.1, np.zeros((2, 3))), "a list of numbers, got an array of the shape"),
            (lambda: servo.cycle(0.1, START, START * np.nan), "is NaN: expected a finite number"),
            (lambda: servo.cycle(0.1, START, stamp=np.nan), "stamp is NaN"),
            (lambda: servo.cycle(0.1, START, stamp=0.2), "in the future"),
            (lambda: dq.Law("logc", map="transpose"), "map is for your own laws only"),
            (lambda: dq.settling_gain(dq.Law(lambda goal: -goal.screw_log()), "puma560"), "does not settle"),
            (lambda: servo.cycle(0.1, START[:5]), "5 numbers, expected 6"),
            (lambda: servo.cycle(-1.0, START), "now is -1 s"),
            (lambda: dq.Servo("ur5e", {"update_rate": 0}), "update_rate"),
            (lambda: dq.Servo("ur5e", {"interface": "torque"}), "torque"),
            (lambda: dq.Servo("ur5e", {"kontroller": "logc"}), "controller"),
            (lambda: dq.Servo(None, {"joints": ["one"]}), "an arm"),
            (lambda: dq.Servo("ur6e"), "no built-in arm"),
        ]:
            with self.assertRaisesRegex(ValueError, words):
                call()
        servo.set_goal(dq.Pose([9, 0, 0], [1, 0, 0, 0]))
        with self.assertRaisesRegex(ValueError, "the goal is 9"):
            servo.cycle(0.002, START)


class Bags(unittest.TestCase):
    def test_a_bag_is_arrays_and_its_replay_is_the_run(self):
        (run,) = dq.recorded(ROOT / "tests/data/bag_demo")
        times, positions = run.positions
        self.assertEqual(positions.shape, (len(times), 6))
        self.assertTrue(np.all(np.diff(times) >= 0))
        self.assertEqual([motion["outcome"] for motion in run.motions], ["arrived", "arrived"])
        (sent_at, commands), = run.commands
        self.assertEqual(commands.shape, (len(sent_at), 6))
        self.assertEqual(run.errors[1].shape[1], 2)
        self.assertEqual(run.velocities[1].shape, positions.shape)
        # The bag has the tool's poses, and the chain computes the same.
        chain = dq.Chain.builtin("puma560")
        there = chain.forward_kinematics_batch(positions)
        poses = run.poses[1]
        apart = np.minimum(np.abs(there - poses).max(axis=1), np.abs(there + poses).max(axis=1))
        self.assertLess(apart.max(), 1e-9)
        self.assertEqual(dq.replay(ROOT / "tests/data/bag_demo")[0]["different"], 0)
        self.assertEqual([law for _, law in run.laws], ["logc", "diffc"])
        for call in [dq.recorded, dq.replay]:
            with self.assertRaises(ValueError):
                call(ROOT / "tests/data/urdf")

    def test_a_sqlite_bag_is_refused_with_a_remedy(self):
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "run.db3"
            path.write_bytes(b"SQLite format 3\0" + bytes(100))
            with self.assertRaisesRegex(ValueError, "reads only MCAP: convert it by ros2 bag convert"):
                dq.recorded(path)


class Comparison(unittest.TestCase):
    def test_a_function_fares_as_the_law_that_it_is(self):
        known = dq.compare(dq.Law("logc", 2.0), "puma560", 6)
        own = dq.compare(dq.Law(lambda goal: goal.screw_log(), 2.0), "puma560", 6)
        self.assertEqual(known["outcome"], own["outcome"])
        np.testing.assert_allclose(known["path_length_m"], own["path_length_m"], rtol=1e-6)
        self.assertIn("settled", known["outcome"])
        again = dq.compare(dq.Law("logc", 2.0), "puma560", 6)
        np.testing.assert_array_equal(known["settling_time_s"], again["settling_time_s"])
        with self.assertRaisesRegex(ValueError, "expected ideal"):
            dq.compare(dq.Law("logc"), "puma560", 1, plant="moon")
        with self.assertRaisesRegex(ValueError, "ur6e"):
            dq.compare(dq.Law("logc"), "ur6e", 1)

    def test_it_takes_parameters_too(self):
        law, slow = dq.Law("logc", 2.0), {"limits.linear_speed": 0.1}
        fast, slowed = dq.compare(law, "puma560", 4), dq.compare(law, "puma560", 4, parameters=slow)
        self.assertGreater(np.nanmin(slowed["elapsed_s"] - fast["elapsed_s"]), 0.0)
        with self.assertRaisesRegex(ValueError, "limits.linear_speed"):
            dq.compare(law, "puma560", 1, parameters={"limits.linear_sped": 0.1})

    def test_the_tasks_are_those_that_were_published(self):
        starts, goals = dq.tasks("puma560", 3)
        self.assertEqual((starts.shape, goals.shape), ((3, 6), (3, 8)))
        self.assertFalse(np.allclose(starts[0], starts[1]))

    def test_equal_settling_times_are_found_for_a_function_too(self):
        gain = dq.settling_gain(dq.Law(lambda goal: 0.5 * goal.screw_log()), "puma560")
        self.assertAlmostEqual(gain, 4.0, delta=0.2)


class Documents(unittest.TestCase):
    def test_the_stubs_have_what_the_module_has(self):
        tree = ast.parse((Path(dq.__file__).parent / "_native.pyi").read_text())
        items = [node for node in tree.body if isinstance(node, (ast.ClassDef, ast.FunctionDef))]
        # What an own law has is described in the stubs alone.
        items = [node for node in items if node.name != "OwnLaw"]
        public = {name for name in dir(_native) if not name.startswith("_")}
        self.assertEqual({node.name for node in items}, public)
        self.assertEqual(public, set(dq.__all__))
        for node in items:
            if isinstance(node, ast.ClassDef):
                functions = [item for item in node.body if isinstance(item, ast.FunctionDef)]
                stubs = {item.name for item in functions if not item.name.startswith("_")}
                there = {name for name in vars(getattr(_native, node.name)) if not name.startswith("_")}
                self.assertEqual(stubs, there, node.name)

    def test_help_says_what_the_stubs_say(self):
        tree = ast.parse((Path(dq.__file__).parent / "_native.pyi").read_text())
        count = 0
        for node in tree.body:
            there = getattr(_native, getattr(node, "name", ""), None)
            members = getattr(node, "body", []) if isinstance(node, ast.ClassDef) else []
            pairs = [(node, there)] + [(it, getattr(there, it.name, None)) for it in members if hasattr(it, "name")]
            for stub, item in pairs:
                if item is not None and not stub.name.startswith("_"):
                    self.assertEqual(inspect.getdoc(item), ast.get_docstring(stub), stub.name)
                    self.assertTrue(ast.get_docstring(stub), stub.name)
                    count += 1
        self.assertGreater(count, 50)

    def test_the_example_of_the_readme_runs(self):
        page = (ROOT / "src/python/README.md").read_text()
        exec(page.split("```python\n")[1].split("```")[0], {})

    def test_every_block_of_the_page_runs(self):
        page = (ROOT / "src/guide/python.md").read_text()
        blocks = [block.split("```")[0] for block in page.split("```python\n")[1:]]
        self.assertGreater(len(blocks), 5)
        names = {}
        with mock.patch.object(dq, "laws", lambda: ["logc", "diffc"]):
            for block in blocks:
                if "matplotlib" not in block:
                    exec(block.replace('arm, count = "ur5e", 200', 'arm, count = "ur5e", 3'), names)
        self.assertEqual(list(names["results"]), ["logc", "diffc", "boundary_layer"])
        self.assertEqual(len(names["results"]["boundary_layer"]["outcome"]), 3)


if __name__ == "__main__":
    unittest.main()
