"""The types and functions of the Rust part. A test checks that its documents are those of `help()`."""

from collections.abc import Callable, Mapping
from os import PathLike
from typing import Any, Literal, Protocol

from numpy import float64
from numpy.typing import ArrayLike, NDArray

Array = NDArray[float64]
Curve = tuple[Array, Array]
Parameter = bool | int | float | str | list[bool] | list[int] | list[float] | list[str]
Parameters = Mapping[str, Parameter | Array]

__version__: str

class Pose:
    """A pose as a unit dual quaternion. `a * b` and `a @ b` compose two poses. `-a` is the same pose with all eight numbers negated."""

    def __init__(self, translation: ArrayLike, rotation: ArrayLike) -> None:
        """Creates a pose from the translation [m] and the unit quaternion (w, x, y, z), both in the base frame (eq. 13)."""

    @staticmethod
    def identity() -> Pose:
        """Returns the identity pose: no rotation, and no translation."""

    @staticmethod
    def from_angle_axis(translation: ArrayLike, angle: float, axis: ArrayLike) -> Pose:
        """Creates a pose that rotates by `angle` [rad] about `axis`, then translates (the paper's unitdq)."""

    @staticmethod
    def from_matrix(homogeneous: ArrayLike) -> Pose:
        """Creates a pose from a homogeneous 4×4 matrix."""

    @staticmethod
    def from_dual_quaternion(numbers: ArrayLike) -> Pose:
        """Returns the pose nearest to eight numbers (the paper's R82dual)."""

    @staticmethod
    def screw_exp(twist: ArrayLike) -> Pose:
        """Returns the pose that a constant twist (angular, linear) reaches in unit time: the exponential of SE(3)."""

    @staticmethod
    def half_exp(log: ArrayLike) -> Pose:
        """Returns the pose with this `half_log` (the paper's explogdq)."""

    @property
    def translation(self) -> Array:
        """The translation x, y, z [m] in the base frame."""

    @property
    def rotation(self) -> Array:
        """The unit quaternion (w, x, y, z)."""

    @property
    def dual_quaternion(self) -> Array:
        """The eight numbers: real part, then dual part."""

    def matrix(self) -> Array:
        """Returns the homogeneous 4×4 matrix."""

    def adjoint(self) -> Array:
        """Returns the 6×6 matrix that maps twists in the frame of this pose to twists in the base frame."""

    def screw_log(self) -> Array:
        """Returns the logarithm of SE(3): the twist (angular, linear) that reaches this pose in unit time."""

    def half_log(self) -> Array:
        """Returns half the rotation vector, then half the translation (eq. 32, the paper's logdq)."""

    def conjugate(self) -> Pose:
        """Returns the inverse pose (the paper's cdualq)."""

    def inverse(self) -> Pose:
        """Returns the inverse pose, like `conjugate`."""

    def sclerp(self, other: Pose, t: float) -> Pose:
        """Returns the pose at the fraction `t` of the screw motion from this pose to `other` (ScLERP), by the shorter way."""

    def __mul__(self, right: Pose) -> Pose: ...
    def __matmul__(self, right: Pose) -> Pose: ...
    def __neg__(self) -> Pose: ...

class Chain:
    """A serial arm of revolute and prismatic joints."""

    @staticmethod
    def builtin(name: str) -> Chain:
        """Returns the chain of the built-in arm `name`, one of `arms()`."""

    @staticmethod
    def from_dh(table: ArrayLike, convention: Literal["modified_dh", "standard_dh"] = "modified_dh") -> Chain:
        """Creates a chain from rows (alpha [rad], a [m], d [m], theta_offset [rad]) of revolute joints, base first."""

    @staticmethod
    def from_urdf(text: str, base_frame: str, tool_frame: str) -> Chain:
        """Creates a chain from the part of a robot description between two links."""

    @property
    def joint_count(self) -> int:
        """The number of joints."""

    def forward_kinematics(self, theta: ArrayLike) -> Pose:
        """Returns the tool pose in the base frame (eq. 14) at joint positions `theta` [rad, prismatic: m]."""

    def link_poses(self, theta: ArrayLike) -> list[Pose]:
        """Returns the pose of each link's frame in the base frame. The frame moves with the link, and its z axis is the joint's axis."""

    def jacobian(self, theta: ArrayLike) -> Array:
        """Returns the 6×n Jacobian of the twist (angular, linear) of the tool point, along the base's axes."""

    def body_jacobian(self, theta: ArrayLike) -> Array:
        """Returns the 6×n Jacobian of the tool's twist (angular, linear) in the tool frame."""

    def pose_jacobian(self, theta: ArrayLike) -> Array:
        """Returns the 8×n Jacobian of the pose's dual quaternion (eq. 16–20)."""

    def twist(self, theta: ArrayLike, theta_dot: ArrayLike) -> Array:
        """Returns `jacobian(theta) @ theta_dot` without computing the matrix."""

    def forward_kinematics_batch(self, thetas: ArrayLike) -> Array:
        """Returns the tool poses at N×n joint positions, as N×8 dual quaternions."""

    def jacobian_batch(self, thetas: ArrayLike) -> NDArray[float64]:
        """Returns the N×6×n Jacobians at N×n joint positions, like `jacobian`."""

class OwnLaw(Protocol):
    """A law with a memory: an object with these two members. It may also have a method `begin(body_twist, memory)`, which sets the
    memory at the beginning of a motion."""

    memory: int
    """How many numbers the law remembers during a motion, at most 24."""

    def twist(self, goal: Pose, body_twist: Array, dt: float, memory: Array) -> ArrayLike:
        """Returns the twist (angular, linear) that moves the tool to the goal at gain 1, and updates `memory`.

        `goal` is the goal relative to the tool, and `body_twist` is the twist that the last command gives the tool. `dt` [s] is the
        time since the previous cycle. All twists are along the tool's axes.

        The servo may call this method several times in a cycle. So store everything that must last in `memory`, and nothing in `self`.
        At the beginning of each motion, `memory` has zeros, unless `begin` sets it.
        """

class Law:
    """A control law with its gains: one of `laws()`, or your own function or object.

    A function takes the pose of the goal relative to the tool. It returns the twist (angular, linear) that moves the tool to the goal at
    gain 1. Pose and twist are along the base's axes. For example, `Law(lambda goal: goal.screw_log())` is logc.

    A law that remembers values from cycle to cycle is an object: see `OwnLaw` in the stubs.
    """

    def __init__(
        self,
        law: str | Callable[[Pose], ArrayLike] | OwnLaw,
        gains: float | list[float] | None = None,
        *,
        aim: Literal["pose", "position", "position_and_axis", "orientation", "distance"] = "pose",
        map: Literal["damped_inverse", "transpose"] | None = None,
    ) -> None:
        """Creates a law. `gains` is one number for all gains, or a list with a number for each gain. `map` says how the twist of your own
        law becomes joint velocities; by default it is damped_inverse."""

    @property
    def name(self) -> str:
        """The name of the law. The name of your own law is `own`."""

    @property
    def gains(self) -> list[float]:
        """The gains of the law: one number, or two numbers if the law has two gains."""

    def step(self, chain: Chain, theta: ArrayLike, goal: Pose) -> Array:
        """Returns joint velocities [rad/s, prismatic: m/s] toward the goal. A goal q and its negative -q are the same pose; the law uses the
        nearer one.

        For a law with a memory, these are the velocities at the beginning of a motion. Use `Servo` for its whole motion."""

    def step_batch(self, chain: Chain, thetas: ArrayLike, goals: ArrayLike) -> Array:
        """Returns the N×n joint velocities for N×n joint positions and N×8 goals."""

    def twist(self, tool_from_goal: Pose) -> Array:
        """Returns the twist (angular, linear) that the law demands of the tool, in the tool frame: gain times error. How closely
        the tool follows depends on the arm's Jacobian."""

class Servo:
    """The servo with all safety rules. Time is simulated: your program advances it.

    Parameters are those of the node, by their ROS names: `{"controller": "diffc", "limits.linear_speed": 0.2}`. If the argument
    `right_base` is given, the servo moves two arms, and has the parameters of the node `dq_dual_servo`. Goals and `pose` are then poses
    of the right tool relative to the left tool.
    """

    def __init__(
        self,
        arm: str | None = None,
        parameters: Parameters | None = None,
        *,
        law: Law | None = None,
        right_base: Pose | None = None,
    ) -> None:
        """Creates a servo for `arm`, one of `arms()` or a parameter file. Without `arm`, the parameters describe the arm by DH rows or
        `robot_description`.

        A `law` of the library sets the parameters of that law. Your own law stays in force until another law, or the parameter
        `controller`, is set. `right_base` adds a second arm of the same kind: it is the pose of this arm's base in the first arm's base
        frame.
        """

    def set_goal(self, base_from_goal: Pose) -> None:
        """Sets the goal, which takes effect in the next cycle. If the goal moves, call this method before each cycle."""

    def set_joint_goal(self, positions: ArrayLike | Mapping[str, float]) -> None:
        """Sets a joint goal, which takes effect in the next cycle. `positions` [rad, prismatic: m] is a dict with names of `joints`,
        or a list for all joints. A joint that the dict does not name keeps its previous joint goal. If it has no joint goal, it stays
        where it is."""

    def cycle(
        self,
        now: float,
        positions: ArrayLike | None = None,
        velocities: ArrayLike | None = None,
        *,
        stamp: float | None = None,
        wrench: ArrayLike | None = None,
    ) -> Array | None:
        """Runs one cycle at `now` [s]. Returns the command for the robot, or None if nothing has to be sent.

        `positions` and `velocities` are the joint state that arrived since the previous cycle, or None. For two arms,
        the joints of the left arm come first. `stamp` [s] is the time at which the joint state was measured, by the same clock as
        `now`; by default it is `now`. `wrench` is the force [N] and the torque [N m] on the tool, measured at the same time: six
        numbers in the tool frame. It is None if no wrench arrived since the previous cycle.
        """

    def stop(self) -> None:
        """Decelerates and drops the goal, like `~/stop`."""

    def pause(self, paused: bool) -> None:
        """Pauses if `paused` is true, otherwise resumes, like `~/pause`."""

    def reconfigure(self) -> None:
        """Lets a stalled arm move to another configuration of its joints, from which it can reach the goal, like `~/reconfigure`. The
        servo must have found this configuration.
        """

    def tare(self) -> None:
        """Uses the present wrench as the zero of the wrench sensor, like `~/tare`. Nothing may touch the tool meanwhile."""

    def identify_tool(self) -> None:
        """Begins to identify the mass and the center of mass of the load on the force sensor, like `~/identify_tool` with true."""

    def identified_tool(self) -> tuple[float, Array]:
        """Ends the identification. Returns the load's mass [kg] and its center of mass in the tool frame [m]."""

    def configure(self, parameters: Parameters | None = None, *, law: Law | None = None) -> None:
        """Changes parameters and, if one is given, the law, from the next cycle on. If anything is invalid, changes nothing."""

    @property
    def parameters(self) -> dict[str, Parameter]:
        """The parameters with their values."""

    @property
    def joints(self) -> list[str]:
        """The names of the joints."""

    @property
    def state(self) -> str:
        """The name of the servo's state, such as `tracking` or `settled`."""

    @property
    def pose(self) -> Pose | None:
        """The controlled pose at the last joint positions; None until `cycle` has received joint positions."""

    @property
    def command(self) -> Array:
        """The last commanded joint velocities [rad/s, prismatic: m/s], even if the servo sends positions."""

    @property
    def status(self) -> dict[str, Any]:
        """The content of `~/status`: the state, its reason, who requested motion, what revoked the request, and the metrics of the motion."""

class Run:
    """The run of one servo in a bag. Times [s] count from its first motion."""

    @property
    def name(self) -> str:
        """The name of the bag. If the servo has a namespace other than `/`, the namespace follows."""

    @property
    def joints(self) -> list[str]:
        """The names of the joints."""

    @property
    def positions(self) -> Curve:
        """Times [s], and N×n joint positions [rad, prismatic: m]."""

    @property
    def velocities(self) -> Curve:
        """Times [s], and N×n joint velocities [rad/s, prismatic: m/s]."""

    @property
    def poses(self) -> Curve:
        """Times [s], and the controlled poses as N×8 dual quaternions."""

    @property
    def errors(self) -> Curve:
        """Times [s], and the N×2 errors that the servo reported: distance [m] and angle [rad] to the goal."""

    @property
    def commands(self) -> list[Curve]:
        """For each arm the times [s] and the N×n commands: velocities if the bag has them, otherwise positions."""

    @property
    def laws(self) -> list[tuple[float, str]]:
        """The laws, each with the time [s] from which it was in force."""

    @property
    def motions(self) -> list[dict[str, Any]]:
        """The motions to goals. Each has all metrics of the table of `dq_servo plot`."""

def arms() -> list[str]:
    """Returns the names of the built-in arms."""

def laws() -> list[str]:
    """Returns the names of the library's laws."""

def recorded(path: str | PathLike[str], arm: str = "puma560") -> list[Run]:
    """Returns the runs of a bag. Runs without recorded parameters get the parameters of the built-in `arm`."""

def replay(path: str | PathLike[str]) -> list[dict[str, Any]]:
    """Replays the runs of a bag through the servo. Returns for each servo how many commands were compared, and how many of these commands
    differ from the recorded ones in any bit."""

def tasks(arm: str, count: int, seed: int = 1, *, parameters: Parameters | None = None) -> list[Array]:
    """Returns the first `count` tasks of the comparison: the N×n joint positions at their starts, and their N×8 goals as dual quaternions.

    `arm` is one of `arms()`, or a parameter file.
    """

def settling_gain(law: Law, arm: str, *, parameters: Parameters | None = None) -> float:
    """Returns the gain with which the law settles as fast on this arm as logc with a gain of 2 [1/s]: the median settling times are
    equal. The tasks of this search differ from the tasks of `compare`.

    Raises a ValueError if the law settles in fewer than half of the tasks at every gain."""

def compare(
    law: Law,
    arm: str,
    count: int = 200,
    *,
    seed: int = 1,
    limits: bool = True,
    plant: Literal["ideal", "latency_5ms", "latency_20ms", "encoder_noise"] = "ideal",
    parameters: Parameters | None = None,
) -> dict[str, Any]:
    """Runs a law on the first `count` tasks of an arm. Returns a dict with an array for each metric; missing values are NaN. The item
    `outcome` of the dict is a list with the outcome of each task.

    `parameters` are additional parameters of the servo, by their ROS names. They change the arm, but not the law or its gains.
    """

def hamilton_plus(a: ArrayLike) -> Array:
    """Returns H⁺(a), 4×4: `ab = H⁺(a) b` (eq. 9, the paper's Hp)."""

def hamilton_minus(b: ArrayLike) -> Array:
    """Returns H⁻(b), 4×4: `ab = H⁻(b) a` (eq. 10, the paper's Hn)."""

def dual_hamilton_plus(a: ArrayLike) -> Array:
    """Returns H⁺ of a dual quaternion, 8×8 (the paper's dHp)."""

def dual_hamilton_minus(b: ArrayLike) -> Array:
    """Returns H⁻ of a dual quaternion, 8×8 (the paper's dHn)."""

def multiply(a: ArrayLike, b: ArrayLike) -> Array:
    """Returns the product of two dual quaternions of any norm (the paper's dqmult)."""

def conjugate(a: ArrayLike) -> Array:
    """Returns the dual quaternion with both parts conjugated (eq. 6, the paper's cdualq)."""
