"""What the Rust crate gives Python: the types, and what each thing is."""

from collections.abc import Callable, Mapping
from os import PathLike
from typing import Any, Literal

from numpy import float64
from numpy.typing import ArrayLike, NDArray

Array = NDArray[float64]
Curve = tuple[Array, Array]
Parameter = bool | int | float | str | list[bool] | list[int] | list[float] | list[str]
Parameters = Mapping[str, Parameter | Array]

class Pose:
    """A unit dual quaternion: `a * b` is one pose after the other, `-a` the same pose with the other sign."""

    def __init__(self, translation: ArrayLike, rotation: ArrayLike) -> None:
        """From the translation [m] and the unit quaternion (w, x, y, z), both in the base frame (eq. 13)."""

    @staticmethod
    def identity() -> Pose: ...
    @staticmethod
    def from_angle_axis(translation: ArrayLike, angle: float, axis: ArrayLike) -> Pose:
        """Rotated by `angle` [rad] about `axis`, then translated (the paper's unitdq)."""

    @staticmethod
    def from_matrix(homogeneous: ArrayLike) -> Pose:
        """From a homogeneous 4×4 matrix."""

    @staticmethod
    def from_dual_quaternion(numbers: ArrayLike) -> Pose:
        """The pose nearest to eight numbers (the paper's R82dual)."""

    @staticmethod
    def screw_exp(twist: ArrayLike) -> Pose:
        """The exponential of SE(3) of a twist (angular, linear)."""

    @staticmethod
    def half_exp(log: ArrayLike) -> Pose:
        """The inverse of `half_log` (the paper's explogdq)."""

    @property
    def translation(self) -> Array: ...
    @property
    def rotation(self) -> Array:
        """(w, x, y, z)."""

    @property
    def dual_quaternion(self) -> Array:
        """Eight numbers: real part, then dual part."""

    def matrix(self) -> Array:
        """The homogeneous 4×4 matrix."""

    def adjoint(self) -> Array:
        """6×6, from twists of the body to twists in the base frame."""

    def screw_log(self) -> Array:
        """The logarithm of SE(3): the twist (angular, linear) that leads here in unit time."""

    def half_log(self) -> Array:
        """Half the rotation vector, half the translation (eq. 32, the paper's logdq)."""

    def conjugate(self) -> Pose:
        """The inverse pose (the paper's cdualq)."""

    def __mul__(self, right: Pose) -> Pose: ...
    def __neg__(self) -> Pose: ...

class Chain:
    """A serial arm of revolute and prismatic joints."""

    @staticmethod
    def builtin(name: str) -> Chain:
        """One of `arms()`."""

    @staticmethod
    def from_dh(table: ArrayLike, convention: Literal["modified_dh", "standard_dh"] = "modified_dh") -> Chain:
        """From rows (alpha, a, d, theta_offset) of revolute joints, base first."""

    @staticmethod
    def from_urdf(text: str, base_frame: str, tool_frame: str) -> Chain:
        """What a robot description has between two links."""

    @property
    def joint_count(self) -> int: ...
    def forward_kinematics(self, theta: ArrayLike) -> Pose:
        """The tool in the base frame (eq. 14)."""

    def link_poses(self, theta: ArrayLike) -> list[Pose]:
        """The frame that moves with each joint, z along its axis."""

    def jacobian(self, theta: ArrayLike) -> Array:
        """6×n: the tool's twist (angular, linear) along the base's axes, of the tool's point."""

    def body_jacobian(self, theta: ArrayLike) -> Array:
        """6×n: the tool's twist in its own frame."""

    def pose_jacobian(self, theta: ArrayLike) -> Array:
        """8×n: the rate of the pose's dual quaternion (eq. 16–20)."""

    def twist(self, theta: ArrayLike, theta_dot: ArrayLike) -> Array:
        """`jacobian(theta) @ theta_dot`, without the matrix."""

    def forward_kinematics_batch(self, thetas: ArrayLike) -> Array:
        """N×8 dual quaternions of N×n joint positions."""

    def jacobian_batch(self, thetas: ArrayLike) -> NDArray[float64]:
        """N×6×n, as `jacobian`."""

class Law:
    """A control law with its gains: one of `laws()`, or a function of yours.

    The function gets the goal's pose as seen from the tool, along the base's axes, and gives the twist (angular, linear) that takes the tool
    there at gain 1: `Law(lambda goal: goal.screw_log())` is logc.
    """

    def __init__(
        self,
        law: str | Callable[[Pose], ArrayLike],
        gains: float | list[float] | None = None,
        *,
        aim: Literal["pose", "position", "position_and_axis", "orientation", "distance"] = "pose",
        map: Literal["damped_inverse", "transpose"] = "damped_inverse",
    ) -> None:
        """`gains` is one number for what drives the law, or all that it has; `map` is what a function's twist goes through."""

    @property
    def name(self) -> str: ...
    @property
    def gains(self) -> list[float]: ...
    def step(self, chain: Chain, theta: ArrayLike, goal: Pose) -> Array:
        """Joint velocities [rad/s, prismatic: m/s] towards the goal, by the nearer of its two signs."""

    def step_batch(self, chain: Chain, thetas: ArrayLike, goals: ArrayLike) -> Array:
        """N×n joint velocities of N×n joint positions and N×8 goals."""

    def twist(self, tool_from_goal: Pose) -> Array:
        """The twist (angular, linear) of a tool without an arm."""

class Servo:
    """The servo, with every safety rule, in whatever time you say it is.

    Parameters are the node's, by their ROS names: `{"controller": "diffc", "limits.linear_speed": 0.2}`.
    """

    def __init__(
        self,
        arm: str | None = None,
        parameters: Parameters | None = None,
        *,
        law: Law | None = None,
    ) -> None:
        """Of one of `arms()`, or of a parameter file; without, the parameters describe the arm, by DH rows or as `robot_description`.

        A law of the table stands for its parameters; a function of yours rules until another law, or `controller`, is given.
        """

    def set_goal(self, base_from_goal: Pose) -> None:
        """Asks for a goal, which the next cycle takes; a goal that moves is set before each."""

    def cycle(
        self,
        now: float,
        positions: ArrayLike | None = None,
        velocities: ArrayLike | None = None,
        *,
        stamp: float | None = None,
    ) -> Array | None:
        """One cycle at `now` [s]: what is to be sent to the robot, or None where nothing is to be sent.

        `positions` are the joint state that came since the cycle before, None where none did; `stamp` [s] is when it was measured, by the
        clock of `now`: just now if you do not say.
        """

    def stop(self) -> None:
        """As `~/stop`: decelerates and drops the goal."""

    def pause(self, paused: bool) -> None:
        """As `~/pause`."""

    def reconfigure(self) -> None:
        """As `~/reconfigure`: lets an arm that has stalled go by the other configuration that was found."""

    def configure(self, parameters: Parameters | None = None, *, law: Law | None = None) -> None:
        """Sets parameters, all of them or none, from the next cycle on."""

    @property
    def parameters(self) -> dict[str, Parameter]:
        """Each parameter with its value."""

    @property
    def joints(self) -> list[str]: ...
    @property
    def state(self) -> str: ...
    @property
    def pose(self) -> Pose | None:
        """The tool where the joints were last; None before the first cycle."""

    @property
    def command(self) -> Array:
        """The last joint velocities, whatever was sent."""

    @property
    def status(self) -> dict[str, Any]:
        """What `~/status` has of the servo: its state, the reason, who asked and what revoked that, and the motion's figures so far."""

class Run:
    """One servo's run in a bag. Times are from its first motion on [s]."""

    @property
    def name(self) -> str: ...
    @property
    def joints(self) -> list[str]: ...
    @property
    def positions(self) -> Curve:
        """Times, and N×n joint positions."""

    @property
    def velocities(self) -> Curve: ...
    @property
    def poses(self) -> Curve:
        """Times, and N×8 dual quaternions of what is controlled."""

    @property
    def errors(self) -> Curve:
        """Times, and N×2 of distance [m] and angle [rad] to the goal, as the servo said them."""

    @property
    def commands(self) -> list[Curve]:
        """For each arm the times, and N×n of what it was sent: velocities where they are known, else positions."""

    @property
    def laws(self) -> list[tuple[float, str]]:
        """Each law with the time since which it was in force."""

    @property
    def motions(self) -> list[dict[str, Any]]:
        """The motions to goals, with every figure, as `dq_servo plot` tables them."""

def arms() -> list[str]:
    """The names of the arms in the box."""

def laws() -> list[str]:
    """The names of the laws in the table."""

def recorded(path: str | PathLike[str], arm: str = "puma560") -> list[Run]:
    """The runs of a bag; where it does not say with which parameters, they are those of `arm`."""

def replay(path: str | PathLike[str]) -> list[dict[str, Any]]:
    """The runs of a bag once more through the servo: how many commands there are, and how many differ in any bit."""

def tasks(arm: str, count: int, seed: int = 1, *, parameters: Parameters | None = None) -> list[Array]:
    """The comparison's first tasks of an arm, or of a parameter file: N×n joint positions at the start, and N×8 goals."""

def settling_gain(law: Law, arm: str, *, parameters: Parameters | None = None) -> float:
    """The gain at which the law has the median settling time of logc at 2 1/s on that arm, over tasks that no comparison uses."""

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
    """Runs a law on the first tasks of an arm: `outcome`, and an array for each figure, NaN where there is none.

    `parameters` are the servo's, by their ROS names, besides those of the arm; the law is `law`.
    """

def hamilton_plus(a: ArrayLike) -> Array:
    """H⁺(a), 4×4: `ab = H⁺(a) b` (eq. 9, the paper's Hp)."""

def hamilton_minus(b: ArrayLike) -> Array:
    """H⁻(b), 4×4: `ab = H⁻(b) a` (eq. 10, the paper's Hn)."""

def dual_hamilton_plus(a: ArrayLike) -> Array:
    """H⁺ of a dual quaternion, 8×8 (the paper's dHp)."""

def dual_hamilton_minus(b: ArrayLike) -> Array:
    """H⁻ of a dual quaternion, 8×8 (the paper's dHn)."""

def multiply(a: ArrayLike, b: ArrayLike) -> Array:
    """The product of two dual quaternions of any norm (the paper's dqmult)."""

def conjugate(a: ArrayLike) -> Array:
    """Both parts conjugated (eq. 6, the paper's cdualq)."""
