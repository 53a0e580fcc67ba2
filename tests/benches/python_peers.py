"""Measures how long a call of the Python package takes, beside DQ Robotics, Pinocchio and Pink on the same UR5, as the median of seven
rounds.

    python3 -m venv peers && peers/bin/pip install ./src/python dqrobotics pin pin-pink qpsolvers[quadprog]
    peers/bin/python tests/benches/python_peers.py

Packages that are not installed are left out.
"""

import statistics
import time
from pathlib import Path

import dq_servo as dq
import numpy as np

URDF = (Path(__file__).resolve().parents[1] / "data/urdf/ur5.urdf").read_text()
THETAS = np.random.default_rng(1).uniform(-2.0, 2.0, (1000, 6))


def microseconds(call, per_call=1):
    """The median of seven rounds of 0.1 s each."""
    rounds, calls = [], 1
    while True:
        began = time.perf_counter()
        for _ in range(calls):
            call()
        took = time.perf_counter() - began
        if took < 0.1:
            calls *= 2
            continue
        rounds.append(1e6 * took / calls / per_call)
        if len(rounds) == 7:
            return statistics.median(rounds)


def show(what, call, per_call=1):
    print(f"{what:58} {microseconds(call, per_call):8.2f} µs", flush=True)


def ours():
    chain, theta = dq.Chain.from_urdf(URDF, "base_link", "tool0"), THETAS[0]
    goal = chain.forward_kinematics(THETAS[1])
    goals = np.tile(goal.dual_quaternion, (len(THETAS), 1))
    show("dq_servo: forward kinematics", lambda: chain.forward_kinematics(theta))
    show("dq_servo: Jacobian", lambda: chain.jacobian(theta))
    for name in ["logc", "diffc"]:
        law = dq.Law(name)
        show(f"dq_servo: {name}, a step", lambda: law.step(chain, theta, goal))
        show(f"dq_servo: {name}, each of a batch of 1000", lambda: law.step_batch(chain, THETAS, goals), len(THETAS))
    own = dq.Law(lambda goal: goal.screw_log())
    show("dq_servo: logc written in Python, a step", lambda: own.step(chain, theta, goal))
    show("dq_servo: forward kinematics, each of a batch of 1000", lambda: chain.forward_kinematics_batch(THETAS), len(THETAS))
    show("dq_servo: Jacobian, each of a batch of 1000", lambda: chain.jacobian_batch(THETAS), len(THETAS))
    servo, now, speeds = dq.Servo("ur5e"), [0.0], np.zeros(6)
    servo.set_goal(dq.Chain.builtin("ur5e").forward_kinematics(theta + 0.1))

    def cycle():
        now[0] += 0.002
        servo.cycle(now[0], theta, speeds)

    show("dq_servo: a cycle of the servo", cycle)


def dqrobotics():
    from dqrobotics.robot_control import ControlObjective, DQ_PseudoinverseController
    from dqrobotics.robot_modeling import DQ_SerialManipulatorDH

    # The UR5's rows from its vendor: they differ from the description in the last digits, but are as many numbers.
    table = np.array([
        [0, 0, 0, 0, 0, 0],
        [0.089159, 0, 0, 0.10915, 0.09465, 0.0823],
        [0, -0.425, -0.39225, 0, 0, 0],
        [np.pi / 2, 0, 0, np.pi / 2, -np.pi / 2, 0],
        [0, 0, 0, 0, 0, 0],
    ])
    robot, theta = DQ_SerialManipulatorDH(table), THETAS[0]
    show("dqrobotics: forward kinematics", lambda: robot.fkm(theta))
    show("dqrobotics: pose Jacobian", lambda: robot.pose_jacobian(theta))
    controller = DQ_PseudoinverseController(robot)
    controller.set_control_objective(ControlObjective.Pose)
    controller.set_gain(1.0)
    goal = robot.fkm(THETAS[1]).vec8()
    show("dqrobotics: pseudoinverse controller, a step", lambda: controller.compute_setpoint_control_signal(theta, goal))


def pinocchio():
    import pinocchio

    model = pinocchio.buildModelFromXML(URDF)
    data, frame, theta = model.createData(), model.getFrameId("tool0"), THETAS[0]
    goal = pinocchio.SE3.Random()

    def forward_kinematics():
        pinocchio.framesForwardKinematics(model, data, theta)
        return data.oMf[frame]

    def jacobian():
        return pinocchio.computeFrameJacobian(model, data, theta, frame, pinocchio.LOCAL)

    def logc():
        error = pinocchio.log6(forward_kinematics().actInv(goal)).vector
        J = jacobian()
        return J.T @ np.linalg.solve(J @ J.T + 1e-6 * np.eye(6), error)

    show("pin: forward kinematics", forward_kinematics)
    show("pin: Jacobian", jacobian)
    show("pin: the same law with numpy, a step", logc)


def pink():
    import pinocchio
    import pink

    model = pinocchio.buildModelFromXML(URDF)
    configuration = pink.Configuration(model, model.createData(), THETAS[0])
    task = pink.tasks.FrameTask("tool0", position_cost=1.0, orientation_cost=1.0)
    task.set_target(pinocchio.SE3.Random())

    def step():
        configuration.update(THETAS[0])
        return pink.solve_ik(configuration, [task], 0.002, solver="quadprog")

    show("pink: a step of its quadratic program", step)


if __name__ == "__main__":
    for library in [ours, dqrobotics, pinocchio, pink]:
        try:
            library()
        except ImportError as why:
            print(f"{library.__name__} is left out: {why}")
