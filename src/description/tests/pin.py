"""Poses and Jacobians by Pinocchio (PyPI `pin`): pin.py FILE BASE TOOL COUNT. Prints, as little-endian doubles for each configuration: the
joint positions from base to tool, base_from_tool as a 4x4 matrix by rows, the 6xn Jacobian of the tool by rows, linear first, along the axes
of the base."""
import sys

import numpy as np
import pinocchio as pin

file, base, tool, count = sys.argv[1:]
model = pin.buildModelFromUrdf(file)
data = model.createData()
frames = [model.getFrameId(name) for name in (base, tool)]
# The joints that move the tool but not the base.
columns = [c for j in model.supports[model.frames[frames[1]].parentJoint] for c in range(model.idx_vs[j], model.idx_vs[j] + model.nvs[j]) if j]
before = [c for j in model.supports[model.frames[frames[0]].parentJoint] for c in range(model.idx_vs[j], model.idx_vs[j] + model.nvs[j]) if j]
columns = [c for c in columns if c not in before]
random = np.random.default_rng(560)
for _ in range(int(count)):
    positions = random.uniform(-3.0, 3.0, model.nv)
    q = pin.integrate(model, pin.neutral(model), positions)
    pin.computeJointJacobians(model, data, q)
    pin.updateFramePlacements(model, data)
    base_pose, tool_pose = (data.oMf[frame] for frame in frames)
    jacobian = pin.getFrameJacobian(model, data, frames[1], pin.LOCAL_WORLD_ALIGNED)[:, columns]
    turn = base_pose.rotation.T
    rows = [positions[columns], base_pose.actInv(tool_pose).homogeneous, turn @ jacobian[:3], turn @ jacobian[3:]]
    sys.stdout.buffer.write(b"".join(np.ascontiguousarray(part, "<f8").tobytes() for part in rows))
