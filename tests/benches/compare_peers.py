#!/usr/bin/env python3
"""Runs other programs on the tasks of `dq_servo compare`: DQ Robotics, pink, and the law logc written with Pinocchio, with two inverses.

    tests/benches/peers.sh --install
    dq_servo compare --out DIR
    target/peers/venv/bin/python tests/benches/compare_peers.py DIR [TASKS]
    dq_servo compare --out DIR      # once more: its page has them now

Runs the first TASKS (400) tasks of each arm in DIR/tasks.jsonl with fresh joint states. Writes DIR/peers.jsonl with one line for each
run, as in compare.jsonl: without limits, and under the arm's limits of speed, acceleration and position for the programs that support
them. The gains are chosen for each arm on the 100 tasks after these, so that the median settling time without limits equals that of logc
with gain 2. If a quadratic program has no solution, the joints brake with their acceleration limits. Fails if a pose differs from this
program's. At the end it prints a paired comparison of logc with the damped inverse and with J-PARSE, on the tasks in which it passes a
singularity with either of them.
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
import scipy.stats
import yaml
from dqrobotics import DQ, E_, translation, vec8
from dqrobotics.robot_control import ControlObjective, DQ_ClassicQPController, DQ_PseudoinverseController
from dqrobotics.robot_modeling import DQ_SerialManipulatorDH, DQ_SerialManipulatorMDH
from dqrobotics.solvers import DQ_QuadprogSolver
from jparse_robotics import JParseCore

PERIOD, HORIZON, DWELL, GAIN = 0.005, 10.0, 0.5, 2.0
# The number of tasks of an arm on which a gain is chosen, and the number of steps of the search.
PILOTS, STEPS = 100, 4
# An arm passes a singularity if the smallest singular value of the Jacobian is below this.
THRESHOLD = 0.05
TOLERANCE = {"position": 0.001, "rotation": 0.01}
CONFIG = pathlib.Path(__file__).parents[2] / "msg_config"


@functools.cache
class Arm:
    """One of our arms as a model of both libraries."""

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
        bounds = {"speed": "joint_velocity", "acceleration": "joint_acceleration", "lower": "joint_position_lower", "upper": "joint_position_upper"}
        ends = {"speed": None, "acceleration": None, "lower": -math.inf, "upper": math.inf}
        limit = {key: numpy.array(limits.get(name) or [ends[key]] * len(a), float) for key, name in bounds.items()}
        self.speed, self.acceleration, self.lower, self.upper = limit.values()
        self.model.velocityLimit = self.speed
        self.model.lowerPositionLimit, self.model.upperPositionLimit = self.lower, self.upper

    def pose(self, theta):
        pinocchio.framesForwardKinematics(self.model, self.data, theta)
        return self.data.oMf[self.tool].copy()

    def jacobian(self, theta):
        return pinocchio.computeFrameJacobian(self.model, self.data, theta, self.tool, pinocchio.LOCAL)


def damped(jacobian, error):
    """The damped inverse of this program, which damps below a singular value of 0.05."""
    damping = THRESHOLD**2 * max(0.0, 1.0 - (least_singular_value(jacobian) / THRESHOLD) ** 2)
    return jacobian.T @ numpy.linalg.solve(jacobian @ jacobian.T + damping * numpy.eye(6), error)


def jparse(jacobian, error):
    """J-PARSE (Guptasarma et al. 2025, arXiv 2505.00306) with its default parameters."""
    return JParseCore(gamma=0.1).compute(jacobian, position_dimensions=3, angular_dimensions=3) @ error


def logc(inverse, arm, goal, limits, gain):
    """The law logc with the logarithm and Jacobian of Pinocchio."""

    def velocity(theta, before):
        error = pinocchio.log6(goal.actInv(arm.pose(theta))).vector
        return -gain * inverse(arm.jacobian(theta), error)

    return velocity


def least_singular_value(jacobian):
    return numpy.linalg.svd(jacobian, compute_uv=False)[-1]


def braking(arm, before):
    return before - numpy.clip(before, -arm.acceleration * PERIOD, arm.acceleration * PERIOD)


def dq_robotics(arm, goal, limits, gain):
    """The pseudoinverse controller of DQ Robotics. Under limits, its quadratic program with the same bounds as pink."""
    # The controller does not keep its solver alive.
    solver = DQ_QuadprogSolver()
    controller = DQ_ClassicQPController(arm.dq, solver) if limits else DQ_PseudoinverseController(arm.dq)
    controller.set_control_objective(ControlObjective.Pose)
    controller.set_gain(gain)
    # The quadratic program adds the damping to the matrix, the pseudoinverse its square.
    controller.set_damping(0.05**2 if limits else 0.05)
    quaternion = pinocchio.Quaternion(goal.rotation)
    r = DQ([quaternion.w, quaternion.x, quaternion.y, quaternion.z])
    target = r + E_ * 0.5 * DQ([0, *goal.translation]) * r
    sign, both = None, numpy.vstack([numpy.eye(len(arm.speed)), -numpy.eye(len(arm.speed))])

    def bounds(to_limit, before):
        reach = numpy.maximum(to_limit, 0.0)
        ends = [arm.speed, 0.5 * to_limit / PERIOD, numpy.sqrt(2.0 * arm.acceleration * reach), before + arm.acceleration * PERIOD]
        return numpy.minimum.reduce(ends)

    def velocity(theta, before):
        nonlocal sign
        if sign is None and solver is not None:
            near = numpy.dot(vec8(arm.dq.fkm(theta))[:4], vec8(target)[:4]) >= 0.0
            sign = 1.0 if near else -1.0
        if limits:
            theta = numpy.clip(theta, arm.lower, arm.upper)
            up, down = bounds(arm.upper - theta, before), bounds(theta - arm.lower, -before)
            if numpy.any(up < -down):
                return braking(arm, before)
            controller.set_inequality_constraint(both, numpy.concatenate([up, down]))
        return controller.compute_setpoint_control_signal(theta, sign * vec8(target))

    return velocity


def pink_frame_task(arm, goal, limits, gain):
    """A frame task of pink with the limits of speed, position and acceleration."""
    task = pink.tasks.FrameTask("tool", position_cost=1.0, orientation_cost=1.0, gain=gain * PERIOD, lm_damping=0.0)
    task.set_target(goal)
    acceleration = pink.limits.AccelerationLimit(arm.model, arm.acceleration)
    bounds = [pink.limits.VelocityLimit(arm.model), pink.limits.ConfigurationLimit(arm.model), acceleration] if limits else []

    def velocity(theta, before):
        # Braking may end slightly beyond a limit, where pink's bounds are NaN.
        theta = numpy.clip(theta, arm.lower, arm.upper) if limits else theta
        configuration = pink.Configuration(arm.model, arm.data, theta)
        acceleration.set_last_integration(before, PERIOD)
        try:
            return pink.solve_ik(configuration, [task], PERIOD, solver="quadprog", damping=1e-6, limits=bounds, safety_break=False)
        except pink.exceptions.NoSolutionFound:
            return braking(arm, before)

    return velocity


def run(arm, goal, start, velocity):
    """The closed loop of src/studies/compare/closed_loop.rs for the ideal plant."""
    theta, length, peak, effort, speeds = numpy.array(start), 0.0, 0.0, 0.0, 0.0
    command = numpy.zeros(len(theta))
    first = point = arm.pose(theta).translation
    ahead = goal.translation - first
    ahead = ahead / max(numpy.linalg.norm(ahead), 1e-12)
    least, jolt = math.inf, 0.0
    bands, outside, inside, overshoot = None, {"position": 0.0, "rotation": 0.0}, False, 0.0
    for cycle in range(round(HORIZON / PERIOD) + 1):
        now = cycle * PERIOD
        if inside and now - max(outside.values()) >= DWELL - 1e-9:
            break
        try:
            before, command = command, numpy.array(velocity(theta, command))
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
        jolt = max(jolt, numpy.abs(command - before).max() / PERIOD) if cycle else 0.0
        least = min(least, least_singular_value(arm.jacobian(theta)))
        theta = theta + PERIOD * command
        # An arm at rest stays there.
        if not inside and numpy.all(numpy.abs(command) < 1e-9):
            break
    straight = numpy.linalg.norm(point - first)
    return {
        "outcome": "settled" if inside else "failed",
        "settling_s": six_digits(max(outside.values())) if inside else None,
        "path_ratio": six_digits(length / straight) if straight >= 1e-3 else None,
        "overshoot_mm": six_digits(1e3 * overshoot),
        "effort": six_digits(effort),
        "peak_rad_s": six_digits(peak),
    }, {"least": least, "jolt": jolt}


def six_digits(value):
    """Rounds numbers as compare.jsonl does: values that are equal there must be equal here, for the sign test."""
    return float(f"{value:.5e}")


DAMPED, JPARSE = "logc_by_pinocchio", "logc_by_jparse"
# Pinocchio alone has no limits.
PEERS = [
    (DAMPED, False, functools.partial(logc, damped)),
    (JPARSE, False, functools.partial(logc, jparse)),
    ("dq_robotics", False, dq_robotics),
    ("dq_robotics", True, dq_robotics),
    ("pink", False, pink_frame_task),
    ("pink", True, pink_frame_task),
]


def seen(task):
    """The arm of a task, its start and its goal."""
    arm, start = Arm(task["arm"]), numpy.array(task["start"])
    x, y, z, w = task["goal_orientation"]
    goal = pinocchio.SE3(pinocchio.Quaternion(w, x, y, z).matrix(), numpy.array(task["goal_position"]))
    for position in (arm.pose(start).translation, translation(arm.dq.fkm(start)).vec3()):
        assert numpy.linalg.norm(position - task["start_position"]) < 1e-9, f"another pose of {task}"
    return arm, start, goal


def settling(job):
    """When a pilot task settles without limits [s]."""
    peer, task, gain = job
    arm, start, goal = seen(task)
    ended, _ = run(arm, goal, start, peer(arm, goal, False, gain))
    return ended["settling_s"] or math.inf


def lines(job):
    """The lines of a task, and the results of the two inverses in it."""
    task, gains = job
    arm, start, goal = seen(task)
    lines, inverses = [], {}
    for law, limits, peer in PEERS:
        which = {"matched": "settling_time", "law": law, "arm": task["arm"], "limits": limits, "plant": "ideal"}
        gain = gains[law, task["arm"]]
        ended, more = run(arm, goal, start, peer(arm, goal, limits, gain))
        if law in (DAMPED, JPARSE):
            inverses[law] = ended | more
        lines.append(json.dumps(which | {"task": task["task"], "gain": gain} | ended) + "\n")
    return "".join(lines), inverses


def choose(pool, pilots):
    """The gain of each program for each arm. The gain of logc is given."""
    gains = {}
    for name in dict.fromkeys(task["arm"] for task in pilots):
        tasks = [task for task in pilots if task["arm"] == name]
        median = lambda peer, gain: numpy.median(pool.map(settling, [(peer, task, gain) for task in tasks]))
        each = {law: peer for law, _, peer in PEERS}
        target = median(each[DAMPED], GAIN)
        for law, peer in each.items():
            gain = GAIN
            for _ in range(STEPS if law != DAMPED else 0):
                gain = float(gain * median(peer, gain) / target)
            gains[law, name] = six_digits(gain)
    return gains


def past_singularities(both):
    """Compares the two inverses on the tasks in which the arm passes a singularity with either of them."""
    both = [[of[DAMPED], of[JPARSE]] for of in both if min(of[DAMPED]["least"], of[JPARSE]["least"]) < THRESHOLD]
    settled = [[of["outcome"] == "settled" for of in pair] for pair in both]
    only = [settled.count([True, False]), settled.count([False, True])]
    chance = scipy.stats.binomtest(only[1], max(sum(only), 1)).pvalue
    print(f"{len(both)} tasks pass a singularity: {DAMPED} settles alone in {only[0]}, {JPARSE} in {only[1]} (p = {chance:.2g})")
    kept = [pair for pair, ends in zip(both, settled) if all(ends)]
    for figure, unit in (("settling_s", "s"), ("peak_rad_s", "rad/s"), ("jolt", "rad/s^2"), ("path_ratio", "path / straight")):
        pairs = [[of[figure] for of in pair] for pair in kept if None not in (pair[0][figure], pair[1][figure])]
        first, second = numpy.median(pairs, axis=0)
        chance = scipy.stats.wilcoxon(*numpy.transpose(pairs)).pvalue
        print(f"  where both settle ({len(pairs)}): {first:.3g} and {second:.3g} {unit} in the median (p = {chance:.2g})")


def main():
    folder, count = pathlib.Path(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else 400
    every = [json.loads(line) for line in (folder / "tasks.jsonl").open()]
    tasks = [task for task in every if task["task"] < count]
    pilots = [task for task in every if count <= task["task"] < count + PILOTS]
    # Without limits pink warns in each cycle that an arm is beyond them.
    logging.disable(logging.WARNING)
    with multiprocessing.Pool() as pool:
        gains = choose(pool, pilots)
        written = list(pool.imap(lines, [(task, gains) for task in tasks]))
    (folder / "peers.jsonl").write_text("".join(text for text, _ in written))
    print(f"{len(tasks) * len(PEERS)} runs are in {folder / 'peers.jsonl'}")
    past_singularities([inverses for _, inverses in written])


if __name__ == "__main__":
    main()
