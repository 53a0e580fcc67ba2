// The arm, the goal with its handles, the tool and its path, on a 2D canvas.

import { Camera, aboutAxis, add, angleBetween, axes, distance, product, scaled, unit } from "./space.js";

const AXIS_COLORS = ["--axis-x", "--axis-y", "--axis-z"];
// Handles keep their size on the screen [px].
const ARROW = 74;
const RING = 50;
const RING_POINTS = 48;
// How near a pointer must come to a handle [px]; fingers are wider.
const GRIP = { mouse: 11, pen: 14, touch: 22 };
const PATH_STEP = { distance: 0.001, angle: 0.01 };
const JUMP = 0.2;
const FRAME_STEP = { distance: 0.06, angle: 0.35 };
const MOST_POINTS = 6000;
const KEPT_PATHS = 4;

export class Scene {
  // `moved(pose)` follows a goal that is dragged, `released(pose)` takes it.
  constructor(canvas, { moved, released }) {
    Object.assign(this, { canvas, moved, released });
    this.camera = new Camera();
    this.sheet = canvas.getContext("2d");
    this.links = null;
    this.tool = null;
    this.goal = null;
    this.goalName = "goal";
    this.driving = false;
    this.dimmed = false;
    this.paths = [];
    this.pointers = new Map();
    this.held = null;
    this.dirty = true;
    new ResizeObserver(() => this.resize()).observe(canvas);
    this.listen();
    const frame = () => {
      if (this.dirty) this.draw();
      requestAnimationFrame(frame);
    };
    requestAnimationFrame(frame);
  }

  change() {
    this.dirty = true;
  }

  setReach(reach) {
    this.camera.reach = reach;
    this.change();
  }

  // Poses are [x, y, z, qx, qy, qz, qw]; `motion` numbers the goals.
  follow({ links, tool, motion, law }) {
    this.links = links;
    this.tool = tool;
    if (tool) this.extend(tool, motion, law);
    this.change();
  }

  extend(tool, motion, law) {
    const [place, turn] = [tool.slice(0, 3), tool.slice(3)];
    let path = this.paths.at(-1);
    const last = path?.points.at(-1);
    // A simulated arm that is put back jumps, which is no way.
    const jumped = last && distance(last.place, place) > JUMP;
    if (!path || path.motion !== motion || jumped) {
      path = { motion, law, points: [], frames: [] };
      this.paths.push(path);
      if (this.paths.length > KEPT_PATHS) this.paths.shift();
    }
    path.law = law;
    const isFar = (last, step) => !last || distance(last.place, place) > step.distance || angleBetween(last.turn, turn) > step.angle;
    if (isFar(path.points.at(-1), PATH_STEP)) path.points.push({ place, turn });
    if (isFar(path.frames.at(-1), FRAME_STEP)) path.frames.push({ place, turn });
    if (path.points.length > MOST_POINTS) path.points.shift();
    if (path.frames.length > MOST_POINTS / 10) path.frames.shift();
  }

  resize() {
    const ratio = Math.min(2, devicePixelRatio);
    const [width, height] = [this.canvas.clientWidth, this.canvas.clientHeight];
    this.canvas.width = Math.round(width * ratio);
    this.canvas.height = Math.round(height * ratio);
    this.ratio = ratio;
    this.camera.resize(width, height);
    this.change();
  }

  color(name) {
    return getComputedStyle(document.documentElement).getPropertyValue(name).trim() || "gray";
  }

  draw() {
    this.dirty = false;
    const { sheet, camera } = this;
    sheet.setTransform(this.ratio, 0, 0, this.ratio, 0, 0);
    sheet.clearRect(0, 0, camera.width, camera.height);
    camera.aim();
    sheet.lineCap = sheet.lineJoin = "round";
    sheet.globalAlpha = this.dimmed ? 0.4 : 1;
    this.drawGrid();
    this.paths.forEach((path, i) => this.drawPath(path, i === this.paths.length - 1));
    if (this.links) this.drawArm();
    if (this.tool) this.drawFrame(this.tool, 42, 2.5, this.atGoal() ? "" : "tool");
    if (this.goal) this.drawGoal();
    sheet.globalAlpha = 1;
  }

  line(points, color, width) {
    const { sheet } = this;
    sheet.strokeStyle = color;
    sheet.lineWidth = width;
    sheet.beginPath();
    points.forEach(([x, y], i) => (i ? sheet.lineTo(x, y) : sheet.moveTo(x, y)));
    sheet.stroke();
  }

  dot([x, y], color, radius) {
    const { sheet } = this;
    sheet.fillStyle = color;
    sheet.beginPath();
    sheet.arc(x, y, radius, 0, 7);
    sheet.fill();
  }

  // The plane z = 0 of the base frame, a line each 0.2 m, and its axes.
  drawGrid() {
    const step = 0.2;
    const count = Math.ceil(this.camera.reach / step);
    const color = this.color("--faint");
    const at = (x, y) => this.camera.point([x * step, y * step, 0]);
    for (let i = -count; i <= count; i++) {
      this.line([at(i, -count), at(i, count)], color, 1);
      this.line([at(-count, i), at(count, i)], color, 1);
    }
    if (this.tool) {
      const [x, y, z] = this.tool;
      const { sheet } = this;
      sheet.setLineDash([2, 4]);
      this.line([this.camera.point([x, y, z]), this.camera.point([x, y, 0])], this.color("--edge"), 1);
      sheet.setLineDash([]);
      this.dot(this.camera.point([x, y, 0]), this.color("--edge"), 2.5);
    }
  }

  drawPath({ points, frames, law }, isLast) {
    const color = this.color(`--law-${law}`);
    this.sheet.globalAlpha *= isLast ? 1 : 0.35;
    this.line(points.map(({ place }) => this.camera.point(place)), color, isLast ? 2.5 : 1.5);
    if (isLast) for (const { place, turn } of frames) this.drawAxes([...place, ...turn], 13, 1.2);
    this.sheet.globalAlpha = this.dimmed ? 0.4 : 1;
  }

  // Links as thick lines from the farthest to the nearest, joints as dots on them.
  drawArm() {
    const { camera } = this;
    const thickness = Math.max(5, 0.052 * camera.scale);
    const [fill, edge] = [this.color("--link"), this.color("--link-edge")];
    this.drawBase(thickness, fill, edge);
    const parts = [];
    for (let i = 1; i < this.links.length; i++) {
      const [from, to] = [this.links[i - 1], this.links[i]];
      if (distance(from, to) < 1e-6) continue;
      const thin = 1 - (0.5 * i) / this.links.length;
      parts.push({ depth: camera.depth(scaled(0.5, add(from, to))), from, to, width: thickness * thin });
    }
    parts.sort((a, b) => a.depth - b.depth);
    for (const { from, to, width } of parts) {
      const ends = [camera.point(from), camera.point(to)];
      this.line(ends, edge, width + 2);
      this.line(ends, fill, width);
      for (const end of ends) {
        this.dot(end, edge, width * 0.42);
        this.dot(end, this.color("--paper"), width * 0.26);
      }
    }
  }

  drawBase(thickness, fill, edge) {
    const { sheet, camera } = this;
    const [x, y] = camera.point([0, 0, 0]);
    const radius = 0.09 * camera.scale;
    sheet.fillStyle = fill;
    sheet.strokeStyle = edge;
    sheet.lineWidth = 1.5;
    sheet.beginPath();
    sheet.ellipse(x, y, radius, Math.max(1, radius * Math.abs(Math.sin(camera.elevation))), 0, 0, 7);
    sheet.fill();
    sheet.stroke();
  }

  // Whether tool and goal are too near each other for two names.
  atGoal() {
    if (!this.goal) return false;
    const [a, b] = [this.tool, this.goal].map((pose) => this.camera.point(pose.slice(0, 3)));
    return Math.hypot(a[0] - b[0], a[1] - b[1]) < 40;
  }

  drawAxes(pose, length, width) {
    const { camera } = this;
    const from = pose.slice(0, 3);
    axes(pose.slice(3))
      .map((axis, i) => ({ tip: add(from, scaled(length / camera.scale, axis)), color: this.color(AXIS_COLORS[i]), depth: camera.depth(axis) }))
      .sort((a, b) => a.depth - b.depth)
      .forEach(({ tip, color }) => this.line([camera.point(from), camera.point(tip)], color, width));
  }

  drawFrame(pose, length, width, name) {
    this.drawAxes(pose, length, width);
    const [x, y] = this.camera.point(pose.slice(0, 3));
    this.dot([x, y], this.color("--ink"), 3);
    this.name(name, x + 8, y + 16);
  }

  name(text, x, y) {
    const { sheet } = this;
    sheet.font = "600 13px system-ui, sans-serif";
    sheet.lineWidth = 4;
    sheet.strokeStyle = this.color("--paper");
    sheet.strokeText(text, x, y);
    sheet.fillStyle = this.color("--ink");
    sheet.fillText(text, x, y);
  }

  drawGoal() {
    if (!this.driving) {
      this.drawFrame(this.goal, 42, 2.5, this.goalName);
      return;
    }
    const { sheet, camera } = this;
    const handles = this.handles();
    for (const { kind, axis, points, depths } of handles) {
      const color = this.color(AXIS_COLORS[axis]);
      const isHeld = this.held?.handle?.kind === kind && this.held.handle.axis === axis;
      if (kind === "turn") {
        points.forEach((point, i) => {
          const next = points[(i + 1) % points.length];
          sheet.globalAlpha = depths[i] < 0 ? 0.25 : 0.9;
          this.line([point, next], color, isHeld ? 4 : 2);
        });
        sheet.globalAlpha = this.dimmed ? 0.4 : 1;
      } else {
        this.line(points, color, isHeld ? 5 : 3);
        this.arrowHead(points, color);
      }
    }
    const [x, y] = camera.point(this.goal.slice(0, 3));
    this.dot([x, y], this.color("--ink"), 4);
    this.name(this.goalName, x + 10, y - 10);
  }

  arrowHead([from, to], color) {
    const length = Math.hypot(to[0] - from[0], to[1] - from[1]);
    if (length < 6) return this.dot(to, color, 6);
    const [x, y] = [(to[0] - from[0]) / length, (to[1] - from[1]) / length];
    const { sheet } = this;
    sheet.fillStyle = color;
    sheet.beginPath();
    sheet.moveTo(to[0] + 8 * x, to[1] + 8 * y);
    sheet.lineTo(to[0] - 6 * x + 6 * y, to[1] - 6 * y - 6 * x);
    sheet.lineTo(to[0] - 6 * x - 6 * y, to[1] - 6 * y + 6 * x);
    sheet.fill();
  }

  // The six handles of the goal as they are on the sheet: an arrow to shift along each axis, a ring to turn about it.
  handles() {
    const { camera } = this;
    camera.aim();
    const place = this.goal.slice(0, 3);
    const frame = axes(this.goal.slice(3));
    const arrows = frame.map((direction, axis) => {
      const tip = add(place, scaled(ARROW / camera.scale, direction));
      return { kind: "shift", axis, direction, points: [camera.point(place), camera.point(tip)] };
    });
    const rings = frame.map((direction, axis) => {
      const [u, v] = [frame[(axis + 1) % 3], frame[(axis + 2) % 3]];
      const rim = Array.from({ length: RING_POINTS }, (_, i) => {
        const angle = (2 * Math.PI * i) / RING_POINTS;
        return add(scaled(Math.cos(angle), u), scaled(Math.sin(angle), v));
      });
      const points = rim.map((at) => camera.point(add(place, scaled(RING / camera.scale, at))));
      return { kind: "turn", axis, direction, points, rim, depths: rim.map((at) => camera.depth(at)) };
    });
    return [...rings, ...arrows];
  }

  // The handle under the pointer: arrows before rings, since they are smaller.
  handleAt(x, y, pointer) {
    if (!this.goal || !this.driving) return null;
    const grip = GRIP[pointer] ?? GRIP.mouse;
    let best = null;
    for (const handle of this.handles()) {
      const { kind, points, depths } = handle;
      let off;
      if (kind === "shift") {
        const [from, to] = points;
        // The outer half: the inner one is crowded.
        off = distanceToSegment([x, y], [(from[0] + to[0]) / 2, (from[1] + to[1]) / 2], to) - 3;
      } else {
        off = Math.min(...points.map(([px, py], i) => Math.hypot(px - x, py - y) + (depths[i] < 0 ? 4 : 0)));
      }
      if (off < grip && (!best || off < best.off)) best = { ...handle, off };
    }
    return best;
  }

  drag(dx, dy, x, y) {
    const { handle } = this.held;
    const { camera } = this;
    camera.aim();
    const place = this.goal.slice(0, 3);
    const turn = this.goal.slice(3);
    const direction = axes(turn)[handle.axis];
    if (handle.kind === "shift") {
      const [sx, sy] = camera.direction(direction);
      const square = sx * sx + sy * sy;
      // An axis that points at the viewer cannot be followed.
      if (square < (0.12 * camera.scale) ** 2) return;
      this.goal = [...add(place, scaled((dx * sx + dy * sy) / square, direction)), ...turn];
    } else {
      const ring = this.handles().find(({ kind, axis }) => kind === "turn" && axis === handle.axis);
      const nearest = ring.points.reduce((best, [px, py], i) => {
        const off = Math.hypot(px - x, py - y);
        return off < best.off ? { off, i } : best;
      }, { off: Infinity, i: 0 }).i;
      const [before, after] = [ring.points.at(nearest - 1), ring.points[(nearest + 1) % RING_POINTS]];
      const [tx, ty] = [after[0] - before[0], after[1] - before[1]].map((d) => (d * RING_POINTS) / (4 * Math.PI));
      const square = Math.max(tx * tx + ty * ty, (0.3 * RING) ** 2);
      const angle = (dx * tx + dy * ty) / square;
      this.goal = [...place, ...unit(product(aboutAxis(direction, angle), turn))];
    }
    this.moved(this.goal);
    this.change();
  }

  listen() {
    const { canvas, camera } = this;
    canvas.addEventListener("pointerdown", (event) => {
      canvas.setPointerCapture(event.pointerId);
      this.pointers.set(event.pointerId, [event.offsetX, event.offsetY]);
      if (this.pointers.size > 1) this.cancel();
      else {
        const handle = this.handleAt(event.offsetX, event.offsetY, event.pointerType);
        this.held = { handle, before: this.goal };
      }
      canvas.classList.add("holding");
      this.change();
    });
    canvas.addEventListener("pointermove", (event) => this.move(event));
    const release = (event) => {
      if (!this.pointers.delete(event.pointerId)) return;
      canvas.classList.remove("holding");
      const held = this.held;
      this.held = null;
      if (held?.handle && event.type === "pointerup" && held.before !== this.goal) this.released(this.goal);
      this.change();
    };
    canvas.addEventListener("pointerup", release);
    canvas.addEventListener("pointercancel", (event) => {
      this.cancel();
      release(event);
    });
    canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      camera.magnify(Math.exp(-0.0015 * event.deltaY));
      this.change();
    }, { passive: false });
    canvas.addEventListener("keydown", (event) => this.key(event));
  }

  move(event) {
    const { canvas, camera } = this;
    const [x, y] = [event.offsetX, event.offsetY];
    const last = this.pointers.get(event.pointerId);
    if (!last) {
      canvas.classList.toggle("handle", Boolean(this.handleAt(x, y, event.pointerType)));
      return;
    }
    const [dx, dy] = [x - last[0], y - last[1]];
    if (this.pointers.size === 2) {
      const other = [...this.pointers].find(([id]) => id !== event.pointerId)[1];
      const apart = (point) => Math.max(10, Math.hypot(point[0] - other[0], point[1] - other[1]));
      camera.magnify(apart([x, y]) / apart(last));
    } else if (this.held?.handle) this.drag(dx, dy, x, y);
    else camera.turn(0.008 * dx, 0.008 * dy);
    this.pointers.set(event.pointerId, [x, y]);
    this.change();
  }

  // Gives up what is dragged; whether anything was.
  cancel() {
    if (!this.held?.handle) return false;
    this.goal = this.held.before;
    this.held = null;
    this.moved(this.goal);
    this.change();
    return true;
  }

  key(event) {
    const { camera } = this;
    const actions = {
      ArrowLeft: () => camera.turn(-0.1, 0),
      ArrowRight: () => camera.turn(0.1, 0),
      ArrowUp: () => camera.turn(0, 0.1),
      ArrowDown: () => camera.turn(0, -0.1),
      "+": () => camera.magnify(1.15),
      "-": () => camera.magnify(1 / 1.15),
      0: () => camera.reset(),
    };
    if (event.ctrlKey || event.metaKey || event.altKey || !actions[event.key]) return;
    actions[event.key]();
    event.preventDefault();
    this.change();
  }
}

function distanceToSegment(point, from, to) {
  const along = [to[0] - from[0], to[1] - from[1]];
  const square = along[0] ** 2 + along[1] ** 2 || 1;
  const part = Math.max(0, Math.min(1, ((point[0] - from[0]) * along[0] + (point[1] - from[1]) * along[1]) / square));
  return Math.hypot(point[0] - from[0] - part * along[0], point[1] - from[1] - part * along[1]);
}
