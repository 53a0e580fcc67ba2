// Position limits of joints in space: an arc about the axis of each joint over its range, and a needle at its current position. A prismatic
// joint has a rail beside it, as long as its range.

import { add, axes, scaled } from "./space.js";

// Radius of the arcs relative to the arm's reach.
const RADIUS = 0.075;
const STEP = 0.12;
const TURN = 1.98 * Math.PI;
// A joint that is closer to its limit than this [rad, m] is highlighted.
const NEAR = { rad: 0.15, m: 0.02 };

// `frames` are the poses of the links, each of which turns about its z axis with its joint or slides along it. Positions and bounds are in
// `units` (rad or m); a bound is null if there is none.
export function limitsOf(frames, positions, { joint_lower: lower, joint_upper: upper, units, reach }) {
  return frames.flatMap((frame, i) => {
    if (lower[i] === null || upper[i] === null) return [];
    // A joint with a full turn of range is shown only when it comes close to its limit.
    const mayTurnRound = units[i] === "rad" && upper[i] - lower[i] >= TURN;
    const centre = frame.slice(0, 3);
    const [x, y, z] = axes(frame.slice(3));
    const isNear = Math.min(positions[i] - lower[i], upper[i] - positions[i]) < NEAR[units[i]];
    if (units[i] === "m") {
      const beside = add(centre, scaled(RADIUS * reach, x));
      const rail = [lower[i], upper[i]].map((bound) => add(beside, scaled(bound - positions[i], z)));
      return [{ arc: rail, needle: [centre, beside], isNear }];
    }
    // The x axis of the link shows the current position of the joint.
    const at = (angle) => {
      const turn = angle - positions[i];
      return add(centre, scaled(RADIUS * reach, add(scaled(Math.cos(turn), x), scaled(Math.sin(turn), y))));
    };
    if (mayTurnRound && !isNear) return [];
    const [first, last] = !mayTurnRound ? [lower[i], upper[i]]
      : positions[i] - lower[i] < upper[i] - positions[i] ? [lower[i], lower[i] + 1] : [upper[i] - 1, upper[i]];
    const count = Math.max(2, Math.ceil((last - first) / STEP));
    const arc = Array.from({ length: count + 1 }, (_, k) => at(first + (k * (last - first)) / count));
    return [{ arc, needle: [centre, at(positions[i])], isNear }];
  });
}
