"""Makes golden vectors with DQ Robotics, an independent implementation: poses and 8xn pose Jacobians of the PUMA 560 (modified DH) and of
a seven-joint arm (standard DH).
Run: python3 -m venv v && v/bin/pip install dqrobotics && v/bin/python make_golden.py"""
import json
import random

import numpy as np
from dqrobotics.robot_modeling import DQ_SerialManipulatorDH, DQ_SerialManipulatorMDH

random.seed(560)
HALF = np.pi / 2
PUMA = {"alpha": [0, -HALF, 0, -HALF, HALF, -HALF], "a": [0, 0, 0.4318, 0.019, 0, 0], "d": [0, 0, 0.125, 0.432, 0, 0]}
SEVEN = {
    "alpha": [1.5, -1.2, 0.3, 0.0, 1.0, -1.5, 0.4],
    "a": [0.1, 0.3, 0.0, 0.2, 0.05, 0.0, 0.1],
    "d": [0.3, 0.0, 0.25, 0.0, 0.1, 0.2, 0.05],
}


def cases(kind, convention, arm):
    n = len(arm["a"])
    # Rows: theta, d, a, alpha, joint type (0: revolute).
    robot = kind(np.array([[0.0] * n, arm["d"], arm["a"], arm["alpha"], [0.0] * n]))
    for _ in range(10):
        theta = [random.uniform(-3, 3) for _ in range(n)]
        q = np.array(theta)
        yield {
            "convention": convention,
            **arm,
            "theta": theta,
            "pose": robot.fkm(q).vec8().tolist(),
            "jacobian": robot.pose_jacobian(q).tolist(),
        }


if __name__ == "__main__":
    puma = cases(DQ_SerialManipulatorMDH, "modified_dh", PUMA)
    seven = cases(DQ_SerialManipulatorDH, "standard_dh", SEVEN)
    print(json.dumps([*puma, *seven], indent=None))
