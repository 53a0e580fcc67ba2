"""Poses and Jacobians by Pinocchio (PyPI `pin`): pin.py FILE BASE TOOL COUNT JOINT.... Prints, as little-endian doubles for each
configuration: the positions of the joints, base_from_tool as a 4x4 matrix by rows, the 6xn Jacobian of the tool by rows, linear first, along
the axes of the base. Pinocchio's own mimic joints must come after their drivers and mimic no mimic joint; here, its free joints are moved."""
import sys
import xml.etree.ElementTree as xml

import numpy as np
import pinocchio as pin

file, base, tool, count, *joints = sys.argv[1:]
model = pin.buildModelFromUrdf(file)
data = model.createData()
frames = [model.getFrameId(name) for name in (base, tool)]
mimics = {joint.get("name"): joint.find("mimic") for joint in xml.parse(file).iter("joint")}


def coupling(name):
    """The joint's position as numbers for all joints and 1."""
    row, mimic = np.zeros(len(joints) + 1), mimics[name]
    if mimic is not None:
        row[-1] = float(mimic.get("offset", 0.0))
        return row + float(mimic.get("multiplier", 1.0)) * coupling(mimic.get("joint"))
    if name in joints:
        row[joints.index(name)] = 1.0
    return row


ratios = np.array([coupling(name) for name in list(model.names)[1:]])
random = np.random.default_rng(560)
for _ in range(int(count)):
    positions = random.uniform(-3.0, 3.0, len(joints))
    q = pin.integrate(model, pin.neutral(model), ratios @ [*positions, 1.0])
    pin.computeJointJacobians(model, data, q)
    pin.updateFramePlacements(model, data)
    base_pose, tool_pose = (data.oMf[frame] for frame in frames)
    jacobian = pin.getFrameJacobian(model, data, frames[1], pin.LOCAL_WORLD_ALIGNED) @ ratios[:, :-1]
    turn = base_pose.rotation.T
    rows = [positions, base_pose.actInv(tool_pose).homogeneous, turn @ jacobian[:3], turn @ jacobian[3:]]
    sys.stdout.buffer.write(b"".join(np.ascontiguousarray(part, "<f8").tobytes() for part in rows))
