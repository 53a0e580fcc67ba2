"""A tool on a wrist force sensor, and what it touches: a wall of springs, a hole, a hand. `contact.py` prints the tables of the page "Contact"."""

import argparse
from dataclasses import dataclass

import mujoco
import numpy as np
from robot import PERIOD, Plant, Robot

import dq_servo as dq

# From the base frame of the servo's chain to that of the model.
BASES = {"ur5e": np.diag([-1.0, -1.0, 1.0]), "panda": np.eye(3)}
LENGTH, RADIUS = 0.12, 0.01  # of the tool, a cylinder along z [m]
SOFT = {"contact.compliance": True}
DELAYS = [0.0, 0.008, 0.02, 0.05]  # of joint states and wrench [s]
LATE = 0.006  # what the cycle and the arm add to the delay [s], about


@dataclass
class Equipped(Plant):
    """A robot with a tool on a wrist force sensor."""

    tool: float = 0.2  # its mass [kg]
    noise: float = 0.0  # standard deviation of the force [N]
    hole: tuple | None = None  # center of the hole's rim, and the direction into it, in the model's base frame

    def equip(self, spec):
        hand = spec.body("right_hand")
        tool = hand.add_body(name="tool")
        tool.add_site(name="wrist")
        tool.gravcomp = 0.0  # the joints' servos do not know of it
        tool.add_geom(
            name="peg",
            type=mujoco.mjtGeom.mjGEOM_CYLINDER,
            size=[RADIUS, LENGTH / 2, 0],
            pos=[0, 0, LENGTH / 2],
            mass=self.tool,
            contype=2,
            conaffinity=2,
            friction=[0.2, 0, 0],
        )
        for kind, name in [(mujoco.mjtSensor.mjSENS_FORCE, "force"), (mujoco.mjtSensor.mjSENS_TORQUE, "torque")]:
            spec.add_sensor(name=name, type=kind, objtype=mujoco.mjtObj.mjOBJ_SITE, objname="wrist")
        if self.hole is not None:
            drill(spec, *self.hole)


def drill(spec, center, into, play=0.0005, depth=0.04, chamfer=0.003, sides=16):
    """Builds a hole for the tool from boxes around it, with a chamfer of 45°."""
    across = np.cross(into, [1.0, 0.0, 0.0] if abs(into[0]) < 0.9 else [0.0, 1.0, 0.0])
    across /= np.linalg.norm(across)
    other = np.cross(into, across)
    for side in range(sides):
        angle = 2 * np.pi * side / sides
        out = np.cos(angle) * across + np.sin(angle) * other
        along = np.cross(into, out)
        width = 0.02
        for lean, radius, at in [(0.0, RADIUS + play / 2, depth / 2 + chamfer), (np.pi / 4, None, None)]:
            normal = np.cos(lean) * out - np.sin(lean) * into
            if lean:
                # Its face goes through the middle of the chamfer.
                middle = center + (RADIUS + play / 2 + chamfer / 2) * out + chamfer / 2 * into
                normal = np.cos(lean) * out + np.sin(lean) * into
                half, place = [0.004, width, chamfer * 0.75], middle + 0.004 * normal
            else:
                half, place = [0.01, width, depth / 2], center + (radius + 0.01) * out + at * into
            axes = np.column_stack([normal, along, np.cross(normal, along)])
            quaternion = np.zeros(4)
            mujoco.mju_mat2Quat(quaternion, axes.flatten())
            spec.worldbody.add_geom(
                type=mujoco.mjtGeom.mjGEOM_BOX, size=half, pos=place, quat=quaternion, contype=2, conaffinity=2, friction=[0.2, 0, 0]
            )


class Touching(Robot):
    """A robot with a tool, in front of a wall of springs if `stiffness` [N/m] is given."""

    def __init__(self, plant=None, parameters=None, stiffness=0.0, sign=1.0):
        plant = plant or Equipped()
        super().__init__(plant, {"tool_offset": [0.0, 0.0, LENGTH, 0.0, 0.0, 0.0, 1.0], "contact.tool_mass": plant.tool}
                         | {"contact.tool_center": [0.0, 0.0, LENGTH / 2]} | (parameters or {}))
        self.tool, self.base, self.sign = self.model.body("tool").id, BASES[plant.arm], sign
        self.stiffness, self.force, self.random = stiffness, 0.0, np.random.default_rng(7)
        self.home = self.pose()
        # The wall begins 1 cm before the tool, along the tool's z axis.
        self.into = self.data.xmat[self.tool].reshape(3, 3)[:, 2].copy()
        self.surface = self.tip() + 0.01 * self.into
        self.pull = np.zeros(3)  # of a hand, in the model's base frame [N]

    def tip(self):
        """Where the tool's end is, in the model's base frame."""
        return self.data.xpos[self.tool] + LENGTH * self.data.xmat[self.tool].reshape(3, 3)[:, 2]

    def pose(self):
        """The pose of the tool's end, by the servo's chain."""
        flange = self.chain.forward_kinematics(self.data.qpos)
        return flange @ dq.Pose([0.0, 0.0, LENGTH], [1.0, 0.0, 0.0, 0.0])

    def wrench(self):
        rotation = self.chain.forward_kinematics(self.data.qpos).inverse().rotation
        to_tool = matrix(rotation) @ self.base @ self.data.xmat[self.tool].reshape(3, 3)
        # MuJoCo's wrench is what the hand exerts on the tool. What everything else exerts on the tool is its opposite.
        force = to_tool @ self.data.sensor("force").data + self.random.normal(0.0, self.plant.noise, 3) * (self.plant.noise > 0)
        return -self.sign * np.concatenate([force, to_tool @ self.data.sensor("torque").data])

    def step(self):
        depth = (self.tip() - self.surface) @ self.into
        self.force = self.stiffness * max(depth, 0.0)
        push = self.pull - self.force * self.into
        lever = self.tip() - self.data.xipos[self.tool]
        self.data.xfrc_applied[self.tool] = np.concatenate([push, np.cross(lever, push)])
        super().step()

    def at(self, forward=0.0, aside=0.0, of=None):
        """The pose at home, moved along the tool's z and x axes [m]."""
        return (of or self.home) @ dq.Pose([aside, 0.0, forward], [1.0, 0.0, 0.0, 0.0])


def matrix(rotation):
    return dq.Pose([0.0, 0.0, 0.0], rotation).matrix()[:3, :3]


def forward(way, speed):
    """A function of the robot that moves the goal this way [m] along the tool's z axis, or until the servo refuses it."""
    gone = 0.0

    def advance(robot):
        nonlocal gone
        if gone < way and robot.servo.status["consent"] in (gone > 0.0, True):
            gone += speed * PERIOD
            robot.go(robot.at(gone))

    return advance


def press(robot, depth=0.02, speed=0.05, seconds=6.0):
    """Moves the goal into the wall. Returns the forces, one for each cycle."""
    forces, advance = [], forward(depth + 0.01, speed)

    def each(robot):
        advance(robot)
        forces.append(robot.force)

    robot.run(0.5)
    robot.run(seconds, each=each)
    return np.array(forces)


def bounces(forces):
    """How often the tool left the wall after it had touched it."""
    touches = forces > 0.1
    return int(np.sum(touches[:-1] & ~touches[1:]))


def slide(robot, slope=np.radians(10.0), way=0.2, speed=0.0125):
    """Presses with 10 N along the tool's z axis, and slides along the wall, which is tilted. Returns the forces while it slides."""
    robot.run(0.5)
    robot.go(robot.at(0.0))
    robot.run(3.0)
    aside = robot.data.xmat[robot.tool].reshape(3, 3)[:, 0].copy()
    robot.surface = robot.tip() - 1e-3 * robot.into  # the tool presses already
    robot.into = np.cos(slope) * robot.into + np.sin(slope) * aside
    forces, moved = [], 0.0

    def each(robot):
        nonlocal moved
        moved += speed * PERIOD
        robot.go(robot.at(0.0, moved))
        forces.append(robot.force)

    robot.run(way / speed, each=each)
    return np.array(forces[500:])


PRESSING = SOFT | {
    "contact.stiffness": [500.0, 500.0, 0.0, 30.0, 30.0, 30.0],
    "contact.force_goal": [0.0, 0.0, 10.0, 0.0, 0.0, 0.0],
    "contact.dead_band": [0.0, 0.0],
    "contact.largest_offset": [0.3, 0.5],
}
INSERTING = SOFT | {
    "contact.stiffness": [300.0, 300.0, 300.0, 10.0, 10.0, 10.0],
    "contact.stiffest": [1e4, 50.0],
    "contact.largest_wrench": [100.0, 20.0],
}


def insert(number):
    """Inserts the tool into a hole that is 2 mm from where it is expected. Returns how deep the tool is at the end [m]."""
    free = Touching()
    across = free.data.xmat[free.tool].reshape(3, 3)
    angle = 2 * np.pi * number / 20
    miss = 0.002 * (np.cos(angle) * across[:, 0] + np.sin(angle) * across[:, 1])
    rim = free.surface + miss
    robot = Touching(Equipped(hole=(rim, free.into)), INSERTING)
    robot.run(0.5)
    robot.run(9.0, each=forward(0.06, 0.01))
    return (robot.tip() - rim) @ robot.into, robot.servo.status.get("reason")


def guide(robot, stiffness=200.0, way=0.2):
    """Leads the tool by a hand, which holds it with a spring [N/m] and moves sideways. Returns how far the tool has come [m]."""
    robot.run(0.5)
    robot.go(robot.at(0.0))
    robot.run(1.0)
    start = robot.tip()
    aside = robot.data.xmat[robot.tool].reshape(3, 3)[:, 1].copy()
    moved = 0.0

    def each(robot):
        nonlocal moved
        moved = min(moved + 0.05 * PERIOD, way)
        robot.pull = stiffness * (start + moved * aside - robot.tip())

    robot.run(way / 0.05 + 3.0, each=each)
    robot.pull = np.zeros(3)
    robot.run(2.0)
    return (robot.tip() - start) @ aside


def swings(delay, damping, stiffness=1e4):
    """By how much the force swings at the end, relative to its mean, if the tool presses with 10 N at this damping [N s/m]."""
    given = PRESSING | {"contact.damping": [damping] * 3 + [50.0] * 3, "contact.stiffest": [0.0, 0.0], "contact.cutoff": 1000.0}
    given |= {"contact.largest_wrench": [1000.0, 100.0], "progress_timeout": 0.0}
    robot = Touching(Equipped(delay=delay), given, stiffness)
    robot.run(0.5)
    robot.go(robot.at(0.0))
    robot.run(3.0)
    forces = []
    robot.run(2.0, each=lambda robot: forces.append(robot.force))
    # A servo that has stopped presses no more.
    return np.ptp(forces) / np.mean(forces) if np.mean(forces) > 1.0 else np.inf


def border(delay):
    """The least damping down to which the contact does not swing [N s/m], in steps of a sixth below the one by theory."""
    damping = 1.5 * theory(delay + LATE)
    while damping > 10.0 and swings(delay, damping / 1.2) < 0.3:
        damping /= 1.2
    return damping


def theory(delay, stiffness=1e4, mass=5.0):
    """The same by theory: d = k sin(wT)/w with m w² = k cos(wT)."""
    low, high = 0.0, np.pi / delay
    for _ in range(60):
        w = (low + high) / 2
        low, high = (low, w) if mass * w * w > stiffness * np.cos(w * delay) else (w, high)
    return stiffness * np.sin(low * delay) / low


def told(stiffness):
    """The parameters for a wall of this stiffness [N/m], which may be pressed hard."""
    return {"contact.stiffest": [stiffness, 100.0], "contact.largest_wrench": [1000.0, 100.0]}


def figure(path, stiffness=1e4):
    import matplotlib.pyplot as plt

    plots, axes = plt.subplots(figsize=(8, 4))
    for number, delay in enumerate(DELAYS):
        plant, color = Equipped(delay=delay), f"C{number}"
        soft = press(Touching(plant, SOFT | told(stiffness), stiffness), seconds=3.0)
        hard = press(Touching(plant, {}, stiffness), seconds=3.0)
        times = PERIOD * np.arange(len(soft))
        axes.plot(times, soft, color=color, label=f"compliant, {1e3 * delay:.0f} ms late")
        axes.plot(times[: len(hard)], hard, color=color, linestyle="--", linewidth=0.9)
    axes.set(xlabel="time [s]", ylabel="force on the wall [N]", title="UR5e at 5 cm/s, 2 cm into a wall of 1e4 N/m (dashed: without compliance)")
    axes.legend()
    plots.tight_layout()
    plots.savefig(path, dpi=110)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--figure", help="a PNG to write in place of the tables; needs matplotlib")
    if path := parser.parse_args().figure:
        return figure(path)
    print("| arm, wall [N/m] | peak [N], 0/8/20/50 ms late | at rest [N] | bounces | peak without compliance [N] |\n|---|---|---|---:|---|")
    for arm in ["ur5e", "panda"]:
        for stiffness in [1e3, 1e4, 1e5]:
            plants = [Equipped(arm=arm, delay=delay) for delay in DELAYS]
            soft = [press(Touching(plant, SOFT | told(stiffness), stiffness)) for plant in plants]
            hard = [press(Touching(plant, {}, stiffness), seconds=3.0) for plant in plants]
            peaks, rigid = ("/".join(f"{max(forces):.0f}" for forces in some) for some in (soft, hard))
            rest, left = "/".join(f"{forces[-1]:.1f}" for forces in soft), sum(bounces(forces) for forces in soft)
            print(f"| {arm}, 1e{np.log10(stiffness):.0f} | {peaks} | {rest} | {left} | {rigid} |", flush=True)
    print("\n| delay [ms] | least damping that is stable [N s/m] | by theory |\n|---:|---:|---:|")
    for delay in DELAYS:
        print(f"| {1e3 * delay:.0f} | {border(delay):.0f} | {theory(delay + LATE):.0f} |", flush=True)


if __name__ == "__main__":
    main()
