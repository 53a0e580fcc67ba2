#!/usr/bin/env python3
"""Other programs on the tasks of `dq_servo compare`: DQ Robotics, pink, and logc once more, written with Pinocchio.

    tests/benches/peers.sh --install
    dq_servo compare --out DIR
    target/peers/venv/bin/python tests/benches/compare_peers.py DIR [TASKS]
    dq_servo compare --out DIR      # once more: its page has them now

Runs the first TASKS (100) tasks of each arm in DIR/tasks.jsonl, with the gain of logc and fresh joint states, and writes DIR/peers.jsonl, a line
a run as in compare.jsonl: without limits, and under the arm's limits of speed and position those that can have them. Fails where a pose is not
ours.
"""

import functools
import json
import logging
import math
import multiprocessing
import pathlib
import sys

import numpy
import pinocchio
import pink
import pink.limits
import pink.tasks
import yaml
from dqrobotics import DQ, E_, translation, vec8
from dqrobotics.robot_control import ControlObjective, DQ_ClassicQPController, DQ_PseudoinverseController
from dqrobotics.robot_modeling import DQ_SerialManipulatorDH, DQ_SerialManipulatorMDH
from dqrobotics.solvers import DQ_QuadprogSolver

PERIOD, HORIZON, DWELL, GAIN = 0.005, 10.0, 0.5, 2.0
TOLERANCE = {"position": 0.001, "rotation": 0.01}
CONFIG = pathlib.Path(__file__).parents[2] / "msg_config"


@functools.cache
class Arm:
    """An arm of ours as both of theirs."""

    def __init__(self, name):
        path = CONFIG / "puma560.yaml" if name == "puma560" else CONFIG / "arms" / f"{name}.yaml"
        parameters = yaml.safe_load(path.read_text())["/**"]["ros__parameters"]
        rows, limits = parameters["arm"], parameters["limits"]
        modified = rows["convention"] == "modified_dh"
        alpha, a, d, offset = (numpy.array(rows[key]) for key in ("alpha", "a", "d", "theta_offset"))
        kind = DQ_SerialManipulatorMDH if modified else DQ_SerialManipulatorDH
        self.dq = kind(numpy.array([offset, d, a, alpha, numpy.zeros(len(a))]))
        self.model = pinocchio.Model()
        parent, before = 0, pinocchio.SE3.Identity()
        for i in range(len(a)):
            link = pinocchio.SE3(pinocchio.utils.rotate("x", alpha[i]), numpy.zeros(3))
            shift = pinocchio.SE3(numpy.eye(3), numpy.array([a[i], 0.0, d[i]]))
            turn = pinocchio.SE3(pinocchio.utils.rotate("z", offset[i]), numpy.zeros(3))
            before = before * link * shift * turn if modified else before * turn
            parent = self.model.addJoint(parent, pinocchio.JointModelRZ(), before, f"joint{i}")
            before = pinocchio.SE3.Identity() if modified else shift * link
        self.model.addFrame(pinocchio.Frame("tool", parent, before, pinocchio.FrameType.OP_FRAME))
        self.tool = self.model.getFrameId("tool")
        self.data = self.model.createData()
        bounds = {"speed": "joint_velocity", "lower": "joint_position_lower", "upper": "joint_position_upper"}
        ends = {"speed": None, "lower": -math.inf, "upper": math.inf}
        limit = {key: numpy.array(limits.get(name) or [ends[key]] * len(a), float) for key, name in bounds.items()}
        self.speed, self.lower, self.upper = limit["speed"], limit["lower"], limit["upper"]
        self.model.velocityLimit = self.speed
        self.model.lowerPositionLimit, self.model.upperPositionLimit = self.lower, self.upper

    def pose(self, theta):
        pinocchio.framesForwardKinematics(self.model, self.data, theta)
        return self.data.oMf[self.tool].copy()


def logc(arm, goal, limits):
    """Our law by another's logarithm and Jacobian; damped as ours is, below a singular value of 0.05."""

    def velocity(theta):
        error = pinocchio.log6(goal.actInv(arm.pose(theta))).vector
        jacobian = pinocchio.computeFrameJacobian(arm.model, arm.data, theta, arm.tool, pinocchio.LOCAL)
        least = numpy.linalg.svd(jacobian, compute_uv=False)[-1]
        damping = 0.05**2 * max(0.0, 1.0 - (least / 0.05) ** 2)
        return -GAIN * jacobian.T @ numpy.linalg.solve(jacobian @ jacobian.T + damping * numpy.eye(6), error)

    return velocity


def dq_robotics(arm, goal, limits):
    """Its pseudoinverse controller; under limits its quadratic program, with the same bounds as pink's."""
    # The controller does not keep its solver alive.
    solver = DQ_QuadprogSolver()
    controller = DQ_ClassicQPController(arm.dq, solver) if limits else DQ_PseudoinverseController(arm.dq)
    controller.set_control_objective(ControlObjective.Pose)
    controller.set_gain(GAIN)
    controller.set_damping(0.05)
    quaternion = pinocchio.Quaternion(goal.rotation)
    r = DQ([quaternion.w, quaternion.x, quaternion.y, quaternion.z])
    target = r + E_ * 0.5 * DQ([0, *goal.translation]) * r
    sign, both = None, numpy.vstack([numpy.eye(len(arm.speed)), -numpy.eye(len(arm.speed))])

    def velocity(theta):
        nonlocal sign
        if sign is None and solver is not None:
            near = numpy.dot(vec8(arm.dq.fkm(theta))[:4], vec8(target)[:4]) >= 0.0
            sign = 1.0 if near else -1.0
        if limits:
            up = numpy.minimum(arm.speed, 0.5 * (arm.upper - theta) / PERIOD)
            down = numpy.minimum(arm.speed, 0.5 * (theta - arm.lower) / PERIOD)
            controller.set_inequality_constraint(both, numpy.concatenate([up, down]))
        return controller.compute_setpoint_control_signal(theta, sign * vec8(target))

    return velocity


def pink_frame_task(arm, goal, limits):
    task = pink.tasks.FrameTask("tool", position_cost=1.0, orientation_cost=1.0, gain=GAIN * PERIOD, lm_damping=0.0)
    task.set_target(goal)
    bounds = [pink.limits.VelocityLimit(arm.model), pink.limits.ConfigurationLimit(arm.model)] if limits else []

    def velocity(theta):
        configuration = pink.Configuration(arm.model, arm.data, theta)
        return pink.solve_ik(configuration, [task], PERIOD, solver="quadprog", damping=1e-6, limits=bounds, safety_break=False)

    return velocity


def run(arm, goal, start, velocity):
    """The closed loop of src/compare/closed_loop.rs, for the ideal plant."""
    theta, length, peak, effort, speeds = numpy.array(start), 0.0, 0.0, 0.0, 0.0
    first = point = arm.pose(theta).translation
    ahead = goal.translation - first
    ahead = ahead / max(numpy.linalg.norm(ahead), 1e-12)
    bands, outside, inside, overshoot = None, {"position": 0.0, "rotation": 0.0}, False, 0.0
    for cycle in range(round(HORIZON / PERIOD) + 1):
        now = cycle * PERIOD
        if inside and now - max(outside.values()) >= DWELL - 1e-9:
            break
        try:
            command = numpy.array(velocity(theta))
        except Exception:  # a solver that gives up has failed its task
            inside = False
            break
        if not numpy.all(numpy.abs(command) < 1e4):
            inside = False
            break
        pose = arm.pose(theta)
        error = goal.actInv(pose)
        errors = {"position": numpy.linalg.norm(error.translation), "rotation": numpy.linalg.norm(pinocchio.log3(error.rotation))}
        bands = bands or {key: max(0.02 * errors[key], TOLERANCE[key]) for key in errors}
        inside = all(errors[key] <= bands[key] for key in errors)
        outside = {key: outside[key] if errors[key] <= bands[key] else now for key in errors}
        length += numpy.linalg.norm(pose.translation - point)
        effort += PERIOD * speeds if cycle else 0.0
        point, speeds = pose.translation, command @ command
        overshoot = max(overshoot, (point - goal.translation) @ ahead)
        peak = max(peak, numpy.abs(command).max())
        theta = theta + PERIOD * command
    straight = numpy.linalg.norm(point - first)
    return {
        "outcome": "settled" if inside else "failed",
        "settling_s": max(outside.values()) if inside else None,
        "path_ratio": length / straight if straight >= 1e-3 else None,
        "overshoot_mm": 1e3 * overshoot,
        "effort": effort,
        "peak_rad_s": peak,
    }


# Pinocchio by itself has no limits.
PEERS = [
    ("logc_by_pinocchio", False, logc),
    ("dq_robotics", False, dq_robotics),
    ("dq_robotics", True, dq_robotics),
    ("pink", False, pink_frame_task),
    ("pink", True, pink_frame_task),
]


def run_all(task):
    """The lines of a task."""
    arm, start = Arm(task["arm"]), numpy.array(task["start"])
    x, y, z, w = task["goal_orientation"]
    goal = pinocchio.SE3(pinocchio.Quaternion(w, x, y, z).matrix(), numpy.array(task["goal_position"]))
    for position in (arm.pose(start).translation, translation(arm.dq.fkm(start)).vec3()):
        assert numpy.linalg.norm(position - task["start_position"]) < 1e-9, f"another pose of {task}"
    lines = []
    for law, limits, peer in PEERS:
        which = {"matched": "settling_time", "law": law, "arm": task["arm"], "limits": limits, "plant": "ideal"}
        ended = run(arm, goal, start, peer(arm, goal, limits))
        lines.append(json.dumps(which | {"task": task["task"], "gain": GAIN} | ended) + "\n")
    return "".join(lines)


def main():
    folder, count = pathlib.Path(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else 100
    tasks = [json.loads(line) for line in (folder / "tasks.jsonl").open()]
    tasks = [task for task in tasks if task["task"] < count]
    # Without limits pink says in each cycle that an arm is beyond them.
    logging.disable(logging.WARNING)
    with multiprocessing.Pool() as pool:
        lines = list(pool.imap(run_all, tasks))
    (folder / "peers.jsonl").write_text("".join(lines))
    print(f"{len(tasks) * len(PEERS)} runs are in {folder / 'peers.jsonl'}")


if __name__ == "__main__":
    main()
