// Position limits of joints in space: an arc about each joint's axis over where it may turn, and a needle where it is.

import { add, axes, scaled } from "./space.js";

// Radius of the arcs by the arm's reach.
const RADIUS = 0.075;
const STEP = 0.12;
// A joint that is nearer to its limit than this [rad] is shown to be.
const NEAR = 0.15;

// `frames`: the poses of the links, each turning with its joint about its z; angles and bounds in radians, null for none. Joints that slide,
// by their `units`, have no arc.
export function limitsOf(frames, positions, { joint_lower: lower, joint_upper: upper, units, reach }) {
  return frames.flatMap((frame, i) => {
    if (lower[i] === null || upper[i] === null || units[i] !== "rad") return [];
    const centre = frame.slice(0, 3);
    const [x, y] = axes(frame.slice(3));
    // The link's x is where the joint is now.
    const at = (angle) => {
      const turn = angle - positions[i];
      return add(centre, scaled(RADIUS * reach, add(scaled(Math.cos(turn), x), scaled(Math.sin(turn), y))));
    };
    const count = Math.max(2, Math.ceil((upper[i] - lower[i]) / STEP));
    const arc = Array.from({ length: count + 1 }, (_, k) => at(lower[i] + (k * (upper[i] - lower[i])) / count));
    const isNear = Math.min(positions[i] - lower[i], upper[i] - positions[i]) < NEAR;
    return [{ arc, needle: [centre, at(positions[i])], isNear }];
  });
}
