// Builds the shape of an arm from the positions of its links: links with volume, joint housings, a base on the floor and a tool.

import { lengthwise } from "./solids.js";
import { add, axes, distance, scaled } from "./space.js";

// Radius of the first link relative to the arm's reach, and the fraction of it that remains at the last link.
const THICKNESS = 0.062;
const TAPER = 0.45;
// If the first joints are no higher than this fraction of the reach, the base frame is at the shoulder, and the shoulder stands on a
// column.
const LOW_SHOULDER = 0.1;
const COLUMN = 0.42;

// The floor height for these arms, given the previous height `before`. It is never above their lowest point.
export function floorUnder(links, reach, before, usual = usualFloor(links, reach)) {
  const lowest = Math.min(...links.flatMap((arm) => arm.slice(1).map(([, , z]) => z))) - THICKNESS * reach;
  return Math.min(before ?? usual, usual, lowest < 0 ? lowest : 0);
}

function usualFloor(links, reach) {
  const shoulder = Math.max(...links.map((arm) => Math.max(...arm.slice(0, 3).map(([, , z]) => z))));
  return shoulder < LOW_SHOULDER * reach ? -COLUMN * reach : 0;
}

// Adds one arm to `solids`. `links` are the origins of base, links and tool; `frames` are the poses of the links, each with z along its
// joint axis.
export function addArm(solids, { links, frames, tool }, { reach, floor, colors }) {
  const [base, ...rest] = links;
  const joints = frames.map((frame, i) => ({ at: rest[i], axis: axes(frame.slice(3))[2] }));
  const count = joints.length;
  const radius = (i) => THICKNESS * reach * (1 - (TAPER * i) / count);
  addBase(solids, base, joints[0]?.at ?? base, radius(0), { floor, colors });
  joints.forEach(({ at, axis }, i) => {
    const next = joints[i + 1];
    const [size, sizeTo] = [radius(i), radius(i + 1)];
    // A joint turns in a housing that sticks out on both sides of its link.
    solids.cylinder(add(at, scaled(-1.2 * size, axis)), add(at, scaled(1.2 * size, axis)), 1.12 * size, colors.joint);
    if (!next || distance(at, next.at) < 1e-6) return;
    // If the next joint is offset along this joint's axis, the housing covers the offset.
    const shift = lengthwise(add(next.at, scaled(-1, at)), next.axis);
    const corner = add(next.at, scaled(-1, shift));
    if (distance(at, corner) > 1e-6) solids.capsule(at, corner, size, sizeTo, colors.link);
    if (distance(corner, next.at) > 1e-6) solids.capsule(corner, next.at, sizeTo, sizeTo, colors.link);
  });
  addTool(solids, joints.at(-1), rest.at(-1), tool, { size: radius(count), colors });
}

function addBase(solids, base, shoulder, size, { floor, colors }) {
  addStand(solids, base, size, { floor, colors });
  if (distance(base, shoulder) > 1e-6) solids.capsule(base, shoulder, 1.25 * size, size, colors.link);
}

// The stand under a base of the given size.
function addStand(solids, base, size, { floor, colors }) {
  const foot = [base[0], base[1], floor];
  const plate = add(foot, [0, 0, 0.35 * size]);
  solids.cylinder(foot, plate, 2.2 * size, colors.base);
  if (base[2] > plate[2]) solids.cylinder(plate, base, 1.5 * size, colors.base, 1.25 * size);
}

// The stand of an arm that is drawn from its description, if the description has no stand.
export function addStandUnder(solids, [base], { reach, floor, colors }) {
  if (floor < base[2] - 1e-3) addStand(solids, base, THICKNESS * reach, { floor, colors });
}

// The flange, and a gripper whose fingertips are at the tool point if there is enough room for one.
function addTool(solids, last, point, tool, { size, colors }) {
  if (!last) return;
  const way = add(point, scaled(-1, last.at));
  const long = Math.hypot(...way);
  const pose = tool && distance(tool.slice(0, 3), point) < 1e-3 ? axes(tool.slice(3)) : null;
  const forward = long > 1e-6 ? scaled(1 / long, way) : pose?.[2] ?? last.axis;
  const flange = add(last.at, scaled(1.3 * size, last.axis));
  solids.cylinder(add(last.at, scaled(-1.3 * size, last.axis)), flange, 0.8 * size, colors.tool);
  if (long < 2 * size) return;
  const palm = add(last.at, scaled(Math.max(0.5, 1 - (2.2 * size) / long) * long, forward));
  solids.cylinder(last.at, palm, 0.7 * size, colors.tool);
  const aside = pose ? pose[1] : axes([0, 0, 0, 1])[1];
  for (const side of [-1, 1]) {
    const shift = scaled(0.55 * side * size, aside);
    solids.capsule(add(palm, shift), add(point, shift), 0.2 * size, 0.13 * size, colors.finger);
  }
}
