// The six handles of a goal: an arrow to shift along each axis of its frame, a ring to turn about it.

import { aboutAxis, add, axes, product, scaled, unit } from "./space.js";

// Handles keep their size on the screen [px].
const ARROW = 74;
const RING = 50;
const RING_POINTS = 48;
// How near a pointer must come to a handle [px]; fingers are wider.
const GRIP = { mouse: 11, pen: 14, touch: 22 };

// The handles of the pose as they are on the sheet, arrows last.
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

// The handle under the pointer of this event; null for none.
export function handleAt(pose, camera, { offsetX: x, offsetY: y, pointerType }) {
  const grip = GRIP[pointerType] ?? GRIP.mouse;
  const off = ({ kind, points, depths }) => {
    // The far half of a ring gives way to what is before it.
    if (kind === "turn") return Math.min(...points.map(([px, py], i) => Math.hypot(px - x, py - y) + (depths[i] < 0 ? 4 : 0)));
    const [from, to] = points;
    // The outer half of an arrow: the inner one is crowded.
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
    // An axis that points at the viewer cannot be followed.
    if (square < (0.12 * camera.scale) ** 2) return pose;
    return [...add(place, scaled((dx * sx + dy * sy) / square, direction)), ...turn];
  }
  const { points } = handlesOf(pose, camera).find((handle) => handle.kind === "turn" && handle.axis === axis);
  const offs = points.map(([px, py]) => Math.hypot(px - x, py - y));
  const nearest = offs.indexOf(Math.min(...offs));
  const [before, after] = [points.at(nearest - 1), points[(nearest + 1) % RING_POINTS]];
  // How the rim goes there when the ring turns [px/rad]; where it goes away from the viewer, not as fast as it would seem.
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
