"""Arms with mass, simulated by MuJoCo in lockstep with the servo. The models come from the robosuite wheel, without their meshes.

Time is simulated: a step is 1 ms, and a cycle of the servo 2 ms. The system clock is not used, unless the servo uses it.
"""

from dataclasses import dataclass, field
from importlib.util import find_spec
from pathlib import Path

import dq_servo as dq
import mujoco
import numpy as np

STEP, PERIOD = 0.001, 0.002
STARTS = {
    "ur5e": np.array([0.0, -1.2, 1.6, -1.9, -1.57, 0.3]),
    "panda": np.array([0.0, -0.5, 0.0, -2.1, 0.0, 1.6, 0.8]),
}
# A velocity error of this size [rad/s] uses a servo's whole torque. In an integrating servo, a position error decays at this rate [1/s],
# the ratio kp/kv.
SATURATION, RATE = 0.2, 10.0


@dataclass
class Plant:
    """The properties of the robot."""

    arm: str = "ur5e"
    integrates: bool = False  # its joints are servoed to the integral of the velocities that are commanded, else to these
    compensation: float = 1.0  # the part of the arm's weight that the joints' servos know of
    payload: float = 0.0  # [kg], of which they do not
    delay: float = 0.0  # of the joint states [s]
    state_period: float = PERIOD  # [s]
    slider: float = 1.0  # the part of the commanded speed at which it moves
    table: float | None = None  # height of a table [m]

    def equip(self, spec):
        """Adds more to the model."""


def model(plant: Plant) -> mujoco.MjModel:
    """The arm with its actuators. The payload is attached at the tool mount."""
    root = Path(find_spec("robosuite").submodule_search_locations[0])
    spec = mujoco.MjSpec.from_file(str(root / f"models/assets/robots/{plant.arm}/robot.xml"))
    for geom in list(spec.geoms):
        if geom.type == mujoco.mjtGeom.mjGEOM_MESH:
            spec.delete(geom)
    for mesh in list(spec.meshes):
        spec.delete(mesh)
    spec.option.timestep = STEP
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    for body in spec.bodies[1:]:
        body.gravcomp = plant.compensation
    for motor in spec.actuators:
        torque = motor.ctrlrange[1]
        kv = torque / SATURATION
        motor.forcelimited, motor.forcerange = True, [-torque, torque]
        motor.ctrllimited = False
        if plant.integrates:
            motor.set_to_intvelocity(kp=RATE * kv, kv=kv)
        else:
            motor.set_to_velocity(kv=kv)
    hand = spec.body("right_hand")
    hand.add_geom(type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[0.03, 0, 0], mass=1e-3)
    load = hand.add_body(name="payload")
    load.add_geom(type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[0.04, 0, 0], mass=max(plant.payload, 1e-6), contype=0, conaffinity=0)
    if plant.table is not None:
        spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_PLANE, size=[2, 2, 0.1], pos=[0, 0, plant.table])
    plant.equip(spec)
    return spec.compile()


@dataclass
class Run:
    """The recorded values, one row for each cycle."""

    times: list = field(default_factory=list)
    states: list = field(default_factory=list)
    errors: list = field(default_factory=list)  # of the tool's position, as the servo's chain has it [m]
    positions: list = field(default_factory=list)
    velocities: list = field(default_factory=list)
    torques: list = field(default_factory=list)
    reasons: list = field(default_factory=list)  # each new one

    def array(self, name):
        return np.array(getattr(self, name))

    def first(self, state):
        """When it was first in the given state [s], or None."""
        return next((time for time, it in zip(self.times, self.states) if it == state), None)


class Robot:
    """An arm and its servo, by default the one of the Python package."""

    def __init__(self, plant: Plant, parameters=None, servo=None):
        self.plant, self.start = plant, STARTS[plant.arm]
        self.chain = dq.Chain.builtin(plant.arm)
        self.servo = servo or dq.Servo(plant.arm, parameters)
        self.model = model(plant)
        self.data = mujoco.MjData(self.model)
        self.data.qpos[:] = self.start
        if plant.integrates:
            self.data.act[:] = self.start
        mujoco.mj_forward(self.model, self.data)
        self.hand = self.model.body("right_hand").id
        self.now, self.due, self.goal = 0.0, 0.0, None
        self.underway = []  # joint states that have not come yet
        self.stopped = False  # by its emergency stop: brakes hold, states go on
        self.command = np.zeros(self.model.nu)

    def random_goal(self, number):
        """The goal with the given number. Its joints are up to 0.6 rad from the start."""
        rng = np.random.default_rng(1000 + number)
        return self.chain.forward_kinematics(self.start + rng.uniform(-0.6, 0.6, len(self.start)))

    def load(self, payload):
        """Changes the payload [kg] at once."""
        body = self.model.body("payload").id
        mass = max(payload, 1e-6)
        self.model.body_inertia[body] *= mass / self.model.body_mass[body]
        self.model.body_mass[body] = mass
        mujoco.mj_setConst(self.model, mujoco.MjData(self.model))

    def go(self, goal):
        self.goal = goal
        self.servo.set_goal(goal)

    def error(self):
        """The distance of the tool from the goal [m], with the joint positions of the simulator."""
        if self.goal is None:
            return 0.0
        here = self.chain.forward_kinematics(self.data.qpos)
        return float(np.linalg.norm(here.translation - self.goal.translation))

    def run(self, seconds, until=None, each=None, linger=0.0):
        """Runs for the given time, or until it has been in the given state for `linger`, or has stalled. `each` is called with the robot
        before each cycle."""
        run, inside = Run(), 0.0
        end = self.now + seconds
        while self.now < end:
            if each is not None:
                each(self)
            self.cycle()
            self.note(run)
            inside = inside + PERIOD if self.servo.state == until else 0.0
            if until is not None and (inside > linger or self.servo.state == "stalled"):
                break
        return run

    def cycle(self):
        if self.now >= self.due - 1e-9:
            self.due += self.plant.state_period
            self.underway.append((self.now, self.data.qpos.copy(), self.data.qvel.copy(), self.wrench()))
        came = {}
        while self.underway and self.underway[0][0] + self.plant.delay <= self.now + 1e-9:
            stamp, positions, velocities, wrench = self.underway.pop(0)
            came = {"positions": positions, "velocities": velocities, "stamp": stamp, "wrench": wrench}
        output = self.servo.cycle(self.now, **came)
        if output is not None:
            self.command = output
        for _ in range(round(PERIOD / STEP)):
            self.step()
        self.now += PERIOD

    def wrench(self):
        """The six numbers of the wrist sensor in the tool frame, or None without one."""
        return None

    def step(self):
        self.data.ctrl[:] = 0.0 if self.stopped else self.plant.slider * self.command
        if self.stopped:
            # Brakes: the joints stand still, and an integrating servo begins at their positions.
            self.data.qvel[:] = 0.0
            if self.plant.integrates:
                self.data.act[:] = self.data.qpos
            self.data.time += STEP
            return
        mujoco.mj_step(self.model, self.data)

    def note(self, run):
        run.times.append(self.now)
        run.states.append(self.servo.state)
        run.errors.append(self.error())
        run.positions.append(self.data.qpos.copy())
        run.velocities.append(self.data.qvel.copy())
        run.torques.append(self.data.actuator_force.copy())
        if len(run.times) % 10:
            return
        reason = self.servo.status.get("reason")
        if reason is not None and (not run.reasons or run.reasons[-1] != reason):
            run.reasons.append(reason)
