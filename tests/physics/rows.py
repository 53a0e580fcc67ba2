"""The test conditions for the arms with mass: the rows of the page "What happens on a real arm"."""

from dataclasses import dataclass, field, replace

import numpy as np
from robot import PERIOD, Plant, Robot

# How long an arm that has settled is watched [s], also if its payload changes, and the longest time of a motion [s].
WATCHED, LOADED, LONGEST = 2.0, 4.0, 20.0


@dataclass
class Row:
    """A robot, the parameters of its servo, and the expected state if the robot does not arrive (none if it must arrive)."""

    name: str
    plant: Plant = field(default_factory=Plant)
    parameters: dict = field(default_factory=dict)
    says: str | None = None
    push: float | None = None  # [N], for 0.1 s: at rest where it is below 0, else in motion
    load: float | None = None  # the payload [kg] from 1 s after the arm has settled


@dataclass
class Result:
    """The result of one goal."""

    settled: float | None  # [s]
    stays: bool  # from then on
    last: str  # the state at the end
    error: float  # at the end [m]
    overshoot: float  # [m]
    torque: float  # the largest part of a joint's limit
    speed: float  # the largest part of a joint's limit
    states: set
    reasons: list


def laws(arm, integrates):
    servos = "integrating" if integrates else "velocity"
    for law in ["logc", "logc_pd", "diffc", "unit_quaternion", "double_geodesic"]:
        yield Row(f"{arm}, {servos} servos, {law}", Plant(arm, integrates=integrates), {"controller": law})


UR5E, PANDA = Plant("ur5e"), Plant("panda")
HELD = {"integral": 5.0}
SAGS = "stands .* mm and .*° off, because .* sags by .* rad/s: payload or gravity"
ROWS = [
    *(row for arm in ["ur5e", "panda"] for integrates in [False, True] for row in laws(arm, integrates)),
    Row("joint states 8 ms late", replace(UR5E, delay=0.008)),
    Row("joint states 20 ms late", replace(UR5E, delay=0.02)),
    Row("joint states at 125 Hz", replace(UR5E, state_period=0.008)),
    Row("a push of 100 N at rest", UR5E, push=-100.0),
    Row("a push of 100 N in motion", UR5E, push=100.0),
    Row("speed slider at 0.2", replace(UR5E, slider=0.2)),
    Row("3 kg, integrating servos", replace(UR5E, integrates=True, payload=3.0)),
    Row("3 kg, integrating servos, integral", replace(UR5E, integrates=True, payload=3.0), HELD),
    Row("integral without a load", UR5E, HELD),
    Row("2 kg", replace(UR5E, payload=2.0), says=SAGS),
    Row("2 kg, integral", replace(UR5E, payload=2.0), HELD),
    Row("2 kg, integral, diffc", replace(UR5E, payload=2.0), HELD | {"controller": "diffc"}),
    Row("2 kg, integral, 20 ms late", replace(UR5E, payload=2.0, delay=0.02), HELD),
    Row("gravity not compensated", replace(UR5E, compensation=0.0), says=SAGS),
    Row("gravity not compensated, integral", replace(UR5E, compensation=0.0), HELD),
    Row("0.9 of gravity compensated", replace(UR5E, compensation=0.9)),
    Row("0.9 of gravity compensated, integral", replace(UR5E, compensation=0.9), HELD),
    Row("2 kg put down at rest, integral", replace(UR5E, payload=2.0), HELD, load=0.0),
    Row("5 kg taken up at rest, integral", UR5E, HELD, load=5.0),
    Row("5 kg taken up at rest", UR5E, says=SAGS, load=5.0),
    Row("panda, 2 kg", replace(PANDA, payload=2.0), says=SAGS),
    Row("panda, 2 kg, integral", replace(PANDA, payload=2.0), HELD),
]


def after_settling():
    """A function of the robot: the time since the arm first settled [s], negative infinity before."""
    since = [None]

    def elapsed(robot):
        since[0] = since[0] or (robot.now if robot.servo.state == "settled" else None)
        return -np.inf if since[0] is None else robot.now - since[0]

    return elapsed


def pushed(push, began):
    """A lateral push for 0.1 s: after the arm has been at rest for 1 s, or 0.3 s after `began`."""
    settled = after_settling()

    def push_now(robot):
        elapsed = settled(robot) - 1.0 if push < 0 else robot.now - (began + 0.3)
        robot.data.xfrc_applied[robot.hand, 1] = abs(push) if 0.0 <= elapsed < 0.1 else 0.0

    return push_now


def loaded(load):
    """Another payload from 1 s after the arm has settled."""
    settled = after_settling()

    def load_now(robot):
        if 0.0 <= settled(robot) - 1.0 < PERIOD:
            robot.load(load)

    return load_now


def run(row, number, servo=None):
    """Runs the given row with the given goal. Returns the result and the recorded values."""
    robot = Robot(row.plant, row.parameters, servo)
    robot.run(LONGEST, until="holding", linger=0.5)
    robot.go(robot.random_goal(number))
    began = robot.now
    each, watched = None, WATCHED
    if row.push is not None:
        each = pushed(row.push, began)
    if row.load is not None:
        each, watched = loaded(row.load), LOADED
    seen = robot.run(LONGEST, until="settled", each=each, linger=watched)
    return result(robot, seen, began), seen


def result(robot, seen, began):
    settled, status, parameters = seen.first("settled"), robot.servo.status, robot.servo.parameters
    torques, speeds = np.abs(seen.array("torques")), np.abs(seen.array("velocities"))
    after = [state for time, state in zip(seen.times, seen.states) if settled is not None and time >= settled]
    return Result(
        settled=None if settled is None else settled - began - PERIOD,
        stays=bool(after) and set(after) == {"settled"},
        last=seen.states[-1],
        error=seen.errors[-1],
        overshoot=float(status["overshoot_m"]),
        torque=float(np.max(torques / robot.model.actuator_forcerange[:, 1])),
        speed=float(np.max(speeds / np.array(parameters["limits.joint_velocity"]))),
        states=set(seen.states),
        reasons=seen.reasons + [status.get("reason", "")],
    )
