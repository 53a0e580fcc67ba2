// Vectors, quaternions (x, y, z, w) and the projection of space onto the sheet. Units are metres and radians, with z up.

export const add = (a, b) => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
export const scaled = (k, a) => [k * a[0], k * a[1], k * a[2]];
export const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
export const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
export const distance = (a, b) => Math.hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);

// The Hamilton product: the rotation b, then the rotation a.
export function product(a, b) {
  const [ax, ay, az, aw] = a;
  const [bx, by, bz, bw] = b;
  return [
    aw * bx + ax * bw + ay * bz - az * by,
    aw * by - ax * bz + ay * bw + az * bx,
    aw * bz + ax * by - ay * bx + az * bw,
    aw * bw - ax * bx - ay * by - az * bz,
  ];
}

export function unit(q) {
  const norm = Math.hypot(...q);
  return q.map((part) => part / norm);
}

export const aboutAxis = (axis, angle) => [...scaled(Math.sin(angle / 2), axis), Math.cos(angle / 2)];

// The directions of the axes of the frame: the columns of its rotation matrix.
export function axes([x, y, z, w]) {
  return [
    [1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)],
    [2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)],
    [2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)],
  ];
}

// Transforms the pose b from frame a to the parent frame of a; and the inverse.
export const inFrame = (a, b) => [...add(a.slice(0, 3), turned(a.slice(3), b.slice(0, 3))), ...product(a.slice(3), b.slice(3))];
export function fromFrame(a, b) {
  const back = [-a[3], -a[4], -a[5], a[6]];
  return [...turned(back, add(b.slice(0, 3), scaled(-1, a.slice(0, 3)))), ...product(back, b.slice(3))];
}

function turned(q, v) {
  const [x, y, z] = axes(q);
  return add(add(scaled(v[0], x), scaled(v[1], y)), scaled(v[2], z));
}

// Angle between two orientations.
export const angleBetween = (a, b) => 2 * Math.acos(Math.min(1, Math.abs(a.reduce((sum, part, i) => sum + part * b[i], 0))));

// Roll, pitch, yaw about the fixed axes x, y, z (REP 103) in degrees, and the inverse.
export function fromRollPitchYaw(angles) {
  const [roll, pitch, yaw] = angles.map((angle) => (angle * Math.PI) / 180);
  return product(aboutAxis([0, 0, 1], yaw), product(aboutAxis([0, 1, 0], pitch), aboutAxis([1, 0, 0], roll)));
}

export function toRollPitchYaw(q) {
  const [x, y, z] = axes(q);
  const pitch = Math.asin(Math.max(-1, Math.min(1, -x[2])));
  // At a pitch of ±90° only the sum or the difference of roll and yaw is defined. All of it is taken as yaw.
  const steep = Math.abs(x[2]) > 1 - 1e-9;
  const roll = steep ? 0 : Math.atan2(y[2], z[2]);
  const yaw = steep ? Math.atan2(-y[0], y[1]) : Math.atan2(x[1], x[0]);
  return [roll, pitch, yaw].map((angle) => (angle * 180) / Math.PI);
}

// A 4x4 matrix, column by column: maps positions relative to `middle` to components along `rows`, where the distance `sizes` becomes 1.
export function matrix(rows, middle, sizes) {
  const scaledRows = rows.map((row, i) => scaled(1 / sizes[i], row));
  const columns = [0, 1, 2].flatMap((k) => [...scaledRows.map((row) => row[k]), 0]);
  return new Float32Array([...columns, ...scaledRows.map((row) => -dot(row, middle)), 1]);
}

// Parallel projection, as in the figures, of everything within `radius` of `target`.
export class Camera {
  constructor() {
    this.reset();
    this.frame([[0, 0, 0]], 1);
    this.resize(1, 1);
  }

  // Aims at the middle of the given points, the first of which is the base. The direction is chosen so that an arm of that reach appears
  // large and in front of its base; if `stays`, the direction is kept.
  frame(points, reach, stays = false) {
    const [low, high] = [Math.min, Math.max].map((of) => [0, 1, 2].map((i) => of(...points.map((point) => point[i]))));
    this.target = scaled(0.5, add(low, high));
    this.radius = Math.max(0.45 * reach, 0.5 * distance(low, high) + 0.1 * reach);
    const away = add(this.target, scaled(-1, points[0]));
    if (!stays && Math.hypot(away[0], away[1]) > 0.02 * reach) this.azimuth = Math.atan2(away[1], away[0]) - 0.7;
  }

  reset() {
    this.azimuth = -0.95;
    this.elevation = 0.36;
    this.zoom = 1;
  }

  resize(width, height) {
    this.width = width;
    this.height = height;
  }

  turn(right, up) {
    this.azimuth -= right;
    this.elevation = Math.max(-1.5, Math.min(1.5, this.elevation + up));
  }

  magnify(factor) {
    this.zoom = Math.max(0.3, Math.min(12, this.zoom * factor));
  }

  // Computes what all points of one frame have in common.
  aim() {
    const [sa, ca, se, ce] = [Math.sin(this.azimuth), Math.cos(this.azimuth), Math.sin(this.elevation), Math.cos(this.elevation)];
    this.right = [-sa, ca, 0];
    this.towards = [ca * ce, sa * ce, se];
    this.up = cross(this.towards, this.right);
    this.scale = (this.zoom * Math.min(this.width, this.height)) / (2 * this.radius);
  }

  // From space to the WebGL clip cube, with the given depth [m].
  matrix(depth) {
    return matrix([this.right, this.up, scaled(-1, this.towards)], this.target, [this.width / (2 * this.scale), this.height / (2 * this.scale), depth]);
  }

  // A direction on the sheet [px], with y down.
  direction(v) {
    return [this.scale * dot(v, this.right), -this.scale * dot(v, this.up)];
  }

  point(p) {
    const [x, y] = this.direction(add(p, scaled(-1, this.target)));
    return [this.width / 2 + x, this.height / 2 + y];
  }

  depth(p) {
    return dot(p, this.towards);
  }
}
