#!/usr/bin/env python3
"""DQ Robotics and pink on the tasks of `dq_servo compare`, through the same plant; and logc once more, written with Pinocchio.

    tests/benches/peers.sh --install
    dq_servo compare --out DIR --tasks 20
    target/peers/venv/bin/python tests/benches/compare_peers.py DIR [TASKS]

Reads DIR/tasks.jsonl and DIR/compare.jsonl, and prints a line for each law: ours from compare.jsonl, theirs from here, on the same tasks
(fresh joint states, no limits, the gain of logc). Fails where a pose or a run of logc is not ours.
"""

import json
import math
import pathlib
import sys
import time

import numpy
import pinocchio
import pink
import pink.tasks
import yaml
from dqrobotics import DQ, E_, translation, vec8
from dqrobotics.robot_control import ControlObjective, DQ_PseudoinverseController
from dqrobotics.robot_modeling import DQ_SerialManipulatorDH, DQ_SerialManipulatorMDH

PERIOD, HORIZON, DWELL, GAIN = 0.005, 10.0, 0.5, 2.0
TOLERANCE = {"position": 0.001, "rotation": 0.01}
CONFIG = pathlib.Path(__file__).parents[2] / "msg_config"


class Arm:
    """An arm of ours as both of theirs."""

    def __init__(self, name):
        path = CONFIG / "puma560.yaml" if name == "puma560" else CONFIG / "arms" / f"{name}.yaml"
        rows = yaml.safe_load(path.read_text())["/**"]["ros__parameters"]["arm"]
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

    def pose(self, theta):
        pinocchio.framesForwardKinematics(self.model, self.data, theta)
        return self.data.oMf[self.tool].copy()


def logc(arm, goal):
    """Our law by another's logarithm and Jacobian; damped as ours is, below a singular value of 0.05."""

    def velocity(theta):
        error = pinocchio.log6(goal.actInv(arm.pose(theta))).vector
        jacobian = pinocchio.computeFrameJacobian(arm.model, arm.data, theta, arm.tool, pinocchio.LOCAL)
        least = numpy.linalg.svd(jacobian, compute_uv=False)[-1]
        damping = 0.05**2 * max(0.0, 1.0 - (least / 0.05) ** 2)
        return -GAIN * jacobian.T @ numpy.linalg.solve(jacobian @ jacobian.T + damping * numpy.eye(6), error)

    return velocity


def dq_robotics(arm, goal):
    controller = DQ_PseudoinverseController(arm.dq)
    controller.set_control_objective(ControlObjective.Pose)
    controller.set_gain(GAIN)
    controller.set_damping(0.05)
    quaternion = pinocchio.Quaternion(goal.rotation)
    r = DQ([quaternion.w, quaternion.x, quaternion.y, quaternion.z])
    target = r + E_ * 0.5 * DQ([0, *goal.translation]) * r
    sign = None

    def velocity(theta):
        nonlocal sign
        if sign is None:
            near = numpy.dot(vec8(arm.dq.fkm(theta))[:4], vec8(target)[:4]) >= 0.0
            sign = 1.0 if near else -1.0
        return controller.compute_setpoint_control_signal(theta, sign * vec8(target))

    return velocity


def pink_frame_task(arm, goal):
    task = pink.tasks.FrameTask("tool", position_cost=1.0, orientation_cost=1.0, gain=GAIN * PERIOD, lm_damping=0.0)
    task.set_target(goal)

    def velocity(theta):
        configuration = pink.Configuration(arm.model, arm.data, theta)
        return pink.solve_ik(configuration, [task], PERIOD, solver="quadprog", damping=1e-6, limits=[])

    return velocity


def run(arm, goal, start, velocity):
    """The closed loop of src/compare/closed_loop.rs, for the ideal plant without limits."""
    theta, point, length, peak, spent, steps = numpy.array(start), None, 0.0, 0.0, 0.0, 0
    bands, outside, ahead, overshoot = None, {"position": 0.0, "rotation": 0.0}, None, 0.0
    for cycle in range(round(HORIZON / PERIOD) + 1):
        now, pose = cycle * PERIOD, arm.pose(theta)
        error = goal.actInv(pose)
        errors = {"position": numpy.linalg.norm(error.translation), "rotation": numpy.linalg.norm(pinocchio.log3(error.rotation))}
        if bands is None:
            bands = {key: max(0.02 * errors[key], TOLERANCE[key]) for key in errors}
            first, ahead = pose.translation, goal.translation - pose.translation
        else:
            length += numpy.linalg.norm(pose.translation - point)
        point = pose.translation
        overshoot = max(overshoot, (point - goal.translation) @ ahead / max(numpy.linalg.norm(ahead), 1e-12))
        inside = all(errors[key] <= bands[key] for key in errors)
        outside = {key: outside[key] if errors[key] <= bands[key] else now for key in errors}
        began = time.perf_counter_ns()
        try:
            command = numpy.array(velocity(theta))
        except Exception:  # a solver that gives up has failed its task
            return {"settling_s": None}
        spent, steps = spent + time.perf_counter_ns() - began, steps + 1
        peak = max(peak, numpy.abs(command).max())
        if inside and now - max(outside.values()) >= DWELL:
            return {
                "settling_s": max(outside.values()),
                "path_ratio": length / numpy.linalg.norm(goal.translation - first),
                "overshoot_mm": 1e3 * overshoot,
                "peak_rad_s": peak,
                "step_us": 1e-3 * spent / steps,
            }
        if not numpy.all(numpy.abs(command) < 1e4):
            return {"settling_s": None}
        theta = theta + PERIOD * command
    return {"settling_s": None}


def print_row(name, results):
    settled = [result for result in results if result["settling_s"] is not None]
    median = lambda key: numpy.median([result[key] for result in settled if key in result] or [math.nan])
    figures = [median(key) for key in ("settling_s", "path_ratio", "overshoot_mm", "peak_rad_s", "step_us")]
    print(f"| {name} | {100 * len(settled) / len(results):.1f} | " + " | ".join(f"{figure:.3g}" for figure in figures) + " |")


def main():
    folder, count = pathlib.Path(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else 10**9
    lines = lambda file: (json.loads(line) for line in (folder / file).open())
    tasks = [task for task in lines("tasks.jsonl") if task["task"] < count]
    arms = {name: Arm(name) for name in dict.fromkeys(task["arm"] for task in tasks)}
    ours = {}
    for record in lines("compare.jsonl"):
        itself = record["plant"] == "ideal" and not record["limits"] and record["matched"] == "settling_time"
        if itself and record["task"] < count:
            ours.setdefault(record["law"], {})[record["arm"], record["task"]] = record
    peers = {"logc, by Pinocchio": logc, "DQ Robotics": dq_robotics, "pink": pink_frame_task}
    results = {name: [] for name in peers}
    apart = 0
    for task in tasks:
        arm = arms[task["arm"]]
        pose = arm.pose(numpy.array(task["start"]))
        x, y, z, w = task["goal_orientation"]
        goal = pinocchio.SE3(pinocchio.Quaternion(w, x, y, z).matrix(), numpy.array(task["goal_position"]))
        seen = translation(arm.dq.fkm(numpy.array(task["start"]))).vec3()
        for position in (pose.translation, seen):
            assert numpy.linalg.norm(position - task["start_position"]) < 1e-9, f"another pose of {task}"
        for name, law in peers.items():
            results[name].append(run(arm, goal, task["start"], law(arm, goal)))
        theirs, record = results["logc, by Pinocchio"][-1], ours["logc"][task["arm"], task["task"]]
        same = (theirs["settling_s"] is None) == (record["settling_s"] is None)
        if same and record["settling_s"] is not None:
            same = abs(theirs["settling_s"] - record["settling_s"]) <= PERIOD + 1e-9
        apart += not same
    print("| law | settled [%] | settling [s] | path / straight | overshoot [mm] | peak [rad/s] | step [µs] |\n|---|---|---|---|---|---|---|")
    for law, records in ours.items():
        print_row(law, list(records.values()))
    for name, rows in results.items():
        print_row(name, rows)
    print(f"\n{len(tasks)} tasks; {apart} of them end otherwise by Pinocchio's logc than by ours")
    # Near a half turn or a singularity rounding decides.
    sys.exit(apart > 0.02 * len(tasks))


if __name__ == "__main__":
    main()
