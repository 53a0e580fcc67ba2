// The scene: follows the arm, keeps the path of the tool, and handles pointer and keys.

import { Drawing } from "./drawing.js";
import { dragged, handleAt } from "./handles.js";
import { angleBetween, distance } from "./space.js";

const PATH_STEP = { distance: 0.001, angle: 0.01 };
const JUMP = 0.2;
const FRAME_STEP = { distance: 0.06, angle: 0.35 };
const MOST_POINTS = 6000;
const KEPT_PATHS = 8;

export class Scene extends Drawing {
  // `moved(pose)` is called while a goal is dragged, `released(pose)` when it is dropped.
  constructor(canvas, ground, legend, { moved, released }) {
    super(canvas, ground, legend);
    Object.assign(this, { moved, released });
    this.pointers = new Map();
    this.held = null;
    this.dirty = true;
    new ResizeObserver(() => this.resize()).observe(canvas);
    this.listen();
    // With software rendering only every second frame is drawn, to leave time for the rest of the page.
    let isNext = true;
    const frame = () => {
      isNext = !isNext || !this.stage?.slow;
      if (this.dirty && isNext) this.draw();
      requestAnimationFrame(frame);
    };
    requestAnimationFrame(frame);
  }

  change() {
    this.dirty = true;
  }

  setReach(reach) {
    if (reach !== this.reach) Object.assign(this, { reach, framed: false, floor: null });
    this.change();
  }

  // The shape of the arm from its description, as surfacesOf returns it.
  setLooks(surfaces) {
    this.stage?.setLooks(surfaces);
    this.canvas.dataset.surfaces = surfaces.length;
    this.floor = null;
    this.change();
  }

  // Markers that the servo publishes: keep-out shapes and the nearest pair.
  setMarkers(markers) {
    this.markers = markers;
    this.canvas.dataset.keepOuts = markers.keep_outs.length;
    this.showLegend();
    this.change();
  }

  // `motion` is the number of the goal.
  follow({ links, frames, tool, motion, law, limits }) {
    this.links = links;
    this.frames = frames;
    this.limits = limits;
    this.showLegend();
    this.tool = tool;
    if (tool) this.extend(tool, motion, law);
    this.change();
  }

  extend(tool, motion, law) {
    const [place, turn] = [tool.slice(0, 3), tool.slice(3)];
    let path = this.paths.at(-1);
    const last = path?.points.at(-1);
    // A simulated arm jumps when it is reset. The jump is not part of the path.
    const jumped = last && distance(last.place, place) > JUMP;
    if (!path || path.motion !== motion || path.law !== law || jumped) {
      // If the law changes, the same path continues in another colour.
      path = { motion, law, points: last && !jumped ? [last] : [], frames: [] };
      this.paths.push(path);
      if (this.paths.length > KEPT_PATHS) this.paths.shift();
    }
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
    this.stage?.resize(width, height, ratio);
    this.change();
  }

  handleAt(event) {
    return this.goal && this.driving ? handleAt(this.goal, this.camera, event) : null;
  }

  drag(dx, dy, x, y) {
    this.goal = dragged(this.goal, this.camera, this.held.handle, dx, dy, x, y);
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
        this.held = { handle: this.handleAt(event), before: this.goal };
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
      canvas.classList.toggle("handle", Boolean(this.handleAt(event)));
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

  // Cancels the drag. Returns whether there was one.
  cancel() {
    if (!this.held?.handle) return false;
    this.goal = this.held.before;
    this.held = null;
    this.moved(this.goal);
    this.change();
    return true;
  }

  // Shows the whole arm again, from the first direction.
  home() {
    this.camera.reset();
    this.framed = false;
    this.change();
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
      0: () => this.home(),
    };
    if (event.ctrlKey || event.metaKey || event.altKey || !actions[event.key]) return;
    actions[event.key]();
    event.preventDefault();
    this.change();
  }
}
