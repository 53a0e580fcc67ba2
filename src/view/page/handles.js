// The six handles of a goal: an arrow to move it along each axis of its frame, and a ring to rotate it about each axis.

import { aboutAxis, add, axes, product, scaled, unit } from "./space.js";

// Size of the handles, which is constant on the screen [px].
const ARROW = 74;
const RING = 50;
const RING_POINTS = 48;
// How close a pointer must be to a handle to grab it [px]. Touch needs a larger distance.
const GRIP = { mouse: 11, pen: 14, touch: 22 };

// The handles of the pose as drawn on the sheet, arrows last.
export function handlesOf(pose, camera) {
  camera.aim();
  const place = pose.slice(0, 3);
  const frame = axes(pose.slice(3));
  const arrows = frame.map((direction, axis) => {
    const tip = add(place, scaled(ARROW / camera.scale, direction));
    return { kind: "shift", axis, points: [camera.point(place), camera.point(tip)] };
  });
  const rings = frame.map((_, axis) => {
    const [u, v] = [frame[(axis + 1) % 3], frame[(axis + 2) % 3]];
    const rim = Array.from({ length: RING_POINTS }, (_, i) => {
      const angle = (2 * Math.PI * i) / RING_POINTS;
      return add(scaled(Math.cos(angle), u), scaled(Math.sin(angle), v));
    });
    const points = rim.map((at) => camera.point(add(place, scaled(RING / camera.scale, at))));
    return { kind: "turn", axis, points, depths: rim.map((at) => camera.depth(at)) };
  });
  return [...rings, ...arrows];
}

// The handle under the pointer of this event, or null.
export function handleAt(pose, camera, { offsetX: x, offsetY: y, pointerType }) {
  const grip = GRIP[pointerType] ?? GRIP.mouse;
  const off = ({ kind, points, depths }) => {
    // The far half of a ring has lower priority than the handles in front of it.
    if (kind === "turn") return Math.min(...points.map(([px, py], i) => Math.hypot(px - x, py - y) + (depths[i] < 0 ? 4 : 0)));
    const [from, to] = points;
    // Only the outer half of an arrow can be grabbed, because the inner half is crowded.
    const middle = [(from[0] + to[0]) / 2, (from[1] + to[1]) / 2];
    return distanceToSegment([x, y], middle, to) - 3;
  };
  const near = handlesOf(pose, camera).map((handle) => ({ handle, off: off(handle) })).filter((one) => one.off < grip);
  return near.sort((a, b) => a.off - b.off)[0]?.handle ?? null;
}

// The pose after its handle was dragged by (dx, dy) to (x, y).
export function dragged(pose, camera, { kind, axis }, dx, dy, x, y) {
  camera.aim();
  const [place, turn] = [pose.slice(0, 3), pose.slice(3)];
  const direction = axes(turn)[axis];
  if (kind === "shift") {
    const [sx, sy] = camera.direction(direction);
    const square = sx * sx + sy * sy;
    // A drag along an axis that points at the viewer has no effect.
    if (square < (0.12 * camera.scale) ** 2) return pose;
    return [...add(place, scaled((dx * sx + dy * sy) / square, direction)), ...turn];
  }
  const { points } = handlesOf(pose, camera).find((handle) => handle.kind === "turn" && handle.axis === axis);
  const offs = points.map(([px, py]) => Math.hypot(px - x, py - y));
  const nearest = offs.indexOf(Math.min(...offs));
  const [before, after] = [points.at(nearest - 1), points[(nearest + 1) % RING_POINTS]];
  // How the rim moves on the screen when the ring turns [px/rad]. The value is bounded where the rim moves away from the viewer.
  const [tx, ty] = [after[0] - before[0], after[1] - before[1]].map((part) => (part * RING_POINTS) / (4 * Math.PI));
  const square = Math.max(tx * tx + ty * ty, (0.3 * RING) ** 2);
  return [...place, ...unit(product(aboutAxis(direction, (dx * tx + dy * ty) / square), turn))];
}

function distanceToSegment(point, from, to) {
  const along = [to[0] - from[0], to[1] - from[1]];
  const square = along[0] ** 2 + along[1] ** 2 || 1;
  const part = Math.max(0, Math.min(1, ((point[0] - from[0]) * along[0] + (point[1] - from[1]) * along[1]) / square));
  return Math.hypot(point[0] - from[0] - part * along[0], point[1] - from[1] - part * along[1]);
}
