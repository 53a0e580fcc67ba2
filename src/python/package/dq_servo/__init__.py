"""Dual-quaternion control of serial arms: kinematics, control laws, the servo cycle by cycle, bags, and the comparison of laws.

Units are meters, radians and seconds. Quaternions are (w, x, y, z), dual quaternions (real, dual), twists and rows of Jacobians
(angular, linear). Array arguments may be anything that numpy converts to an array; results are numpy arrays. Invalid arguments raise a
ValueError that says what was expected.
"""

from ._native import (
    Chain,
    Law,
    Pose,
    Run,
    Servo,
    __version__,
    arms,
    compare,
    conjugate,
    dual_hamilton_minus,
    dual_hamilton_plus,
    hamilton_minus,
    hamilton_plus,
    laws,
    multiply,
    recorded,
    replay,
    settling_gain,
    tasks,
)

__all__ = [
    "Chain",
    "Law",
    "Pose",
    "Run",
    "Servo",
    "arms",
    "compare",
    "conjugate",
    "dual_hamilton_minus",
    "dual_hamilton_plus",
    "hamilton_minus",
    "hamilton_plus",
    "laws",
    "multiply",
    "recorded",
    "replay",
    "settling_gain",
    "tasks",
]
