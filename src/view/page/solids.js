// Solids of revolution as triangles. Each is a profile rotated about the line between two points.

import { add, axes, cross, dot, scaled } from "./space.js";

const SIDES = 24;
const ROUNDS = 5;
// A vertex: its position, its normal and its colour.
export const STRIDE = 9;

const length = (v) => Math.hypot(...v);
function roomFor(array, size) {
  if (size <= array.length) return array;
  const larger = new array.constructor(Math.max(size, 2 * array.length));
  larger.set(array);
  return larger;
}

const normed = (v) => scaled(1 / (length(v) || 1), v);

// The points of a ring, as components along two directions.
const RIM = Array.from({ length: SIDES + 1 }, (_, i) => [Math.cos((2 * Math.PI * i) / SIDES), Math.sin((2 * Math.PI * i) / SIDES)]);

// Vertices and triangles of many solids, in buffers that grow.
export class Solids {
  constructor() {
    this.vertices = new Float32Array(1 << 16);
    this.triangles = new Uint32Array(1 << 16);
    this.clear();
  }

  clear() {
    this.size = this.count = 0;
  }

  // `profile`: for each ring [distance along the line, radius, the component of the normal along the line, its component away from the
  // line].
  turned(from, along, profile, color) {
    const aside = Math.abs(along[2]) < 0.9 ? [0, 0, 1] : [1, 0, 0];
    const u = normed(cross(aside, along));
    const v = cross(along, u);
    const first = this.size / STRIDE;
    this.vertices = roomFor(this.vertices, this.size + profile.length * RIM.length * STRIDE);
    this.triangles = roomFor(this.triangles, this.count + profile.length * SIDES * 6);
    const { vertices, triangles } = this;
    for (const [way, radius, forward, out] of profile) {
      for (const [cos, sin] of RIM) {
        for (let k = 0; k < 3; k++) {
          const rim = cos * u[k] + sin * v[k];
          vertices[this.size + k] = from[k] + way * along[k] + radius * rim;
          vertices[this.size + 3 + k] = forward * along[k] + out * rim;
          vertices[this.size + 6 + k] = color[k];
        }
        this.size += STRIDE;
      }
    }
    for (let ring = 1; ring < profile.length; ring++) {
      for (let i = 0; i < SIDES; i++) {
        const [a, c] = [first + (ring - 1) * RIM.length + i, first + ring * RIM.length + i];
        for (const vertex of [a, a + 1, c, c, a + 1, c + 1]) triangles[this.count++] = vertex;
      }
    }
  }

  // A link: round at both ends, with a radius at each end.
  capsule(from, to, radius, radiusTo, color) {
    const way = add(to, scaled(-1, from));
    const long = length(way);
    const along = long > 1e-9 ? scaled(1 / long, way) : [0, 0, 1];
    const profile = [];
    // The wall of a cone is inclined.
    const lean = Math.asin(Math.max(-1, Math.min(1, (radius - radiusTo) / Math.max(long, 1e-9))));
    const cap = (centre, size, first, last) => {
      for (let i = 0; i <= ROUNDS; i++) {
        const angle = first + ((last - first) * i) / ROUNDS;
        profile.push([centre + size * Math.sin(angle), size * Math.cos(angle), Math.sin(angle), Math.cos(angle)]);
      }
    };
    cap(0, radius, -Math.PI / 2, lean);
    cap(long, radiusTo, lean, Math.PI / 2);
    this.turned(from, along, profile, color);
  }

  // A box with the given edge lengths, centred at the pose.
  box(pose, size, color) {
    const rows = axes(pose.slice(3));
    for (let k = 0; k < 3; k++) {
      const [u, v] = [(k + 1) % 3, (k + 2) % 3].map((i) => scaled(size[i], rows[i]));
      for (const sign of [-1, 1]) {
        const normal = scaled(sign, rows[k]);
        const middle = add(pose.slice(0, 3), scaled(0.5 * size[k], normal));
        const first = this.size / STRIDE;
        this.vertices = roomFor(this.vertices, this.size + 4 * STRIDE);
        this.triangles = roomFor(this.triangles, this.count + 6);
        for (const [a, b] of [[-0.5, -0.5], [0.5, -0.5], [-0.5, 0.5], [0.5, 0.5]]) {
          this.vertices.set([...add(middle, add(scaled(a, u), scaled(b, v))), ...normal, ...color], this.size);
          this.size += STRIDE;
        }
        for (const corner of [0, 1, 2, 2, 1, 3]) this.triangles[this.count++] = first + corner;
      }
    }
  }

  // Triangles from consecutive corners, counterclockwise as seen from outside.
  hull(corners, color) {
    const first = this.size / STRIDE;
    this.vertices = roomFor(this.vertices, this.size + corners.length * STRIDE);
    this.triangles = roomFor(this.triangles, this.count + corners.length);
    for (let i = 0; i < corners.length; i += 3) {
      const [along, aside] = [1, 2].map((k) => add(corners[i + k], scaled(-1, corners[i])));
      const normal = normed(cross(along, aside));
      for (const k of [0, 1, 2]) {
        this.vertices.set([...corners[i + k], ...normal, ...color], this.size);
        this.size += STRIDE;
        this.triangles[this.count++] = first + i + k;
      }
    }
  }

  // An RViz marker. Its size is along the axes of its pose; the corners of a hull are in the base frame.
  marker({ kind, pose, size, points }, color) {
    const [middle, [, , z]] = [pose.slice(0, 3), axes(pose.slice(3))];
    const half = scaled(0.5 * size[2], z);
    if (kind === "box") this.box(pose, size, color);
    else if (kind === "hull") this.hull(points, color);
    else if (kind === "ball") this.capsule(middle, middle, 0.5 * size[0], 0.5 * size[0], color);
    else this.cylinder(add(middle, scaled(-1, half)), add(middle, half), 0.5 * size[0], color);
  }

  // A housing: flat at both ends, with bevelled edges.
  cylinder(from, to, radius, color, radiusTo = radius) {
    const way = add(to, scaled(-1, from));
    const long = length(way);
    if (long < 1e-9) return;
    const edge = 0.12 * Math.min(radius, radiusTo, long);
    const slope = (radius - radiusTo) / long;
    this.turned(from, scaled(1 / long, way), [
      [0, 0, -1, 0], [0, radius - edge, -1, 0],
      [0, radius - edge, -1, 1], [edge, radius, -1, 1],
      [edge, radius, slope, 1], [long - edge, radiusTo, slope, 1],
      [long - edge, radiusTo, 1, 1], [long, radiusTo - edge, 1, 1],
      [long, radiusTo - edge, 1, 0], [long, 0, 1, 0],
    ], color);
  }
}

export const lengthwise = (v, axis) => scaled(dot(v, axis), axis);
