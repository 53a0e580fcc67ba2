"""Dual-quaternion control of serial arms: kinematics, control laws, the servo in fake time, bags, and the comparison of laws.

Metres, radians, seconds. Quaternions are (w, x, y, z), dual quaternions (real, dual), twists and Jacobians' rows (angular, linear).
Arrays are taken as whatever numpy makes one of, and given as numpy's. What is wrong is a ValueError that says what was expected.
"""

from ._native import (
    Chain,
    Law,
    Pose,
    Run,
    Servo,
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

__all__ = [name for name in dir() if not name.startswith("_")]
