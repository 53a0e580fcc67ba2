// Draws the arm on its stage, and on a 2D sheet over it the goal with its handles, the tool and the tool's path.

import { addArm, addStandUnder, floorUnder } from "./body.js";
import { handlesOf } from "./handles.js";
import { Solids } from "./solids.js";
import { Camera, add, axes, distance, scaled } from "./space.js";
import { Stage, parts } from "./stage.js";

// A goal must be at least this far from the edge of the picture to leave room for its handles [px].
const MARGIN = 80;
const AXIS_COLORS = ["--axis-x", "--axis-y", "--axis-z"];

// What is shown, and how it is drawn. Poses are [x, y, z, qx, qy, qz, qw].
export class Drawing {
  constructor(canvas, ground, legend) {
    this.canvas = canvas;
    this.legend = legend;
    this.sheet = canvas.getContext("2d");
    this.ground = ground;
    // Null if the browser has no WebGL. Then the arm is drawn as lines on the sheet.
    this.stage = Stage.on(ground);
    this.solids = new Solids();
    // Transparent solids: keep-out shapes, and more transparent the workspace around the arm.
    this.ghosts = [
      { of: "keep_outs", color: "--bad", alpha: 0.4, solids: new Solids() },
      { of: "keep_ins", color: "--good", alpha: 0.12, solids: new Solids() },
    ];
    this.markers = { keep_outs: [], keep_ins: [], closest: [] };
    this.camera = new Camera();
    this.reach = 1;
    this.floor = null;
    this.framed = false;
    // For each arm the origins of base, links and tool; and the poses of all links, one arm after the other.
    this.links = null;
    this.frames = null;
    // The position limits of the joints, as limitsOf returns them.
    this.limits = [];
    this.tool = null;
    this.goal = null;
    this.goalName = "goal";
    // The goal that the servo has taken. The camera follows only this one: a goal that the servo refuses does not move it.
    this.taken = null;
    // Paths of the tool, one for each motion and law. The current one is last.
    this.paths = [];
    // The handle that is being dragged, and the previous goal.
    this.held = null;
    this.driving = false;
    this.dimmed = false;
    // If set, the runs of the theatre are shown instead of all that.
    this.runs = null;
  }

  // The name of a law may be followed by the law that the user requested.
  lawColor(law) {
    return this.color(`--law-${law.split(" ")[0]}`);
  }

  color(name) {
    return getComputedStyle(document.documentElement).getPropertyValue(name).trim() || "gray";
  }

  draw() {
    this.dirty = false;
    const { sheet, camera } = this;
    sheet.setTransform(this.ratio, 0, 0, this.ratio, 0, 0);
    sheet.clearRect(0, 0, camera.width, camera.height);
    this.frameAll();
    camera.aim();
    this.canvas.dataset.camera = JSON.stringify(camera);
    sheet.lineCap = sheet.lineJoin = "round";
    sheet.globalAlpha = this.dimmed ? 0.4 : 1;
    if (this.stage) this.drawStage();
    else this.drawGrid();
    if (!this.runs) this.drawHeight();
    if (this.runs) {
      this.drawRuns();
      return;
    }
    for (const path of this.paths) this.drawPath(path, path.motion === this.paths.at(-1).motion);
    if (!this.stage) for (const arm of this.links ?? []) this.drawArm(arm, this.color("--link"));
    this.drawLimits();
    this.drawClosest();
    if (this.links?.length === 2) ["left", "right"].forEach((side, i) => this.nameAt(side, this.links[i].at(-1)));
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

  // What is on the stage: arms with the colours of their links (null for the usual colour).
  arms() {
    if (!this.runs) return [{ links: this.links, frames: this.frames, tool: this.tool, color: null }];
    const isAlone = this.runs.length === 1;
    return this.runs.map(({ links, frames, tool, run }) => ({ links, frames, tool, color: isAlone ? null : run.color }));
  }

  // Whether the servo has taken another goal and that is outside the picture.
  isGoalOut() {
    if (!this.taken || this.held || this.runs) return false;
    const isNews = !this.framedGoal || distance(this.framedGoal, this.taken) > 1e-3;
    this.framedGoal = this.taken;
    this.camera.aim();
    const [x, y] = this.camera.point(this.taken);
    const { width, height } = this.camera;
    return isNews && (Math.min(x, width - x) < MARGIN || Math.min(y, height - y) < MARGIN);
  }

  // Aims the camera at the arms and their goals: once for each robot, and again when a goal arrives that is outside the picture.
  frameAll() {
    const arms = this.arms().filter(({ links }) => links);
    const isOut = this.isGoalOut();
    if ((this.framed && !isOut) || !arms.length) return;
    const goals = this.runs ? this.runs.map(({ goal }) => goal) : [this.taken];
    const points = [...arms.flatMap(({ links }) => links.flat()), ...goals.filter(Boolean)].map((point) => point.slice(0, 3));
    this.camera.frame(points, this.reach, this.framed);
    this.framed = true;
  }

  drawStage() {
    const { solids, reach } = this;
    solids.clear();
    const shades = Object.fromEntries(["joint", "base", "tool", "finger"].map((part) => [part, parts(this.color(`--body-${part}`))]));
    const armShape = this.stage.armShape.length && !this.runs ? this.frames : null;
    for (const { links, frames, color, tool } of this.arms()) {
      if (!links || !frames) continue;
      this.floor = floorUnder(links, reach, this.floor, armShape ? 0 : undefined);
      if (armShape) {
        addStandUnder(solids, links[0], { reach, floor: this.floor, colors: shades });
        continue;
      }
      let from = 0;
      for (const [i, arm] of links.entries()) {
        const count = arm.length - 2;
        const link = color ?? (i ? "--body-other" : "--body-link");
        const colors = { ...shades, link: parts(this.color(link)) };
        addArm(solids, { links: arm, frames: frames.slice(from, from + count), tool }, { reach, floor: this.floor, colors });
        from += count;
      }
    }
    this.ground.style.opacity = this.dimmed ? 0.4 : 1;
    for (const { of, color, solids } of this.ghosts) {
      solids.clear();
      for (const marker of this.runs ? [] : this.markers[of]) solids.marker(marker, parts(this.color(color)));
    }
    this.stage.draw(this.camera, { solids, frames: armShape, ghosts: this.ghosts }, { floor: this.floor ?? 0, reach, line: this.color("--edge") });
  }

  // The plane z = 0 of the base frame, with a line every 0.2 m.
  drawGrid() {
    const step = 0.2;
    const count = Math.ceil(this.reach / step);
    const color = this.color("--faint");
    const at = (x, y) => this.camera.point([x * step, y * step, 0]);
    for (let i = -count; i <= count; i++) {
      this.line([at(i, -count), at(i, count)], color, 1);
      this.line([at(-count, i), at(count, i)], color, 1);
    }
  }

  // The height of the tool above the floor.
  drawHeight() {
    if (!this.tool) return;
    const [[x, y, z], { sheet }] = [this.tool, this];
    const foot = this.camera.point([x, y, this.stage ? this.floor ?? 0 : 0]);
    sheet.setLineDash([2, 4]);
    this.line([this.camera.point([x, y, z]), foot], this.color("--soft"), 1);
    sheet.setLineDash([]);
    this.dot(foot, this.color("--soft"), 2.5);
  }

  drawPath({ points, frames, law }, isPresent) {
    const color = this.lawColor(law);
    this.sheet.globalAlpha *= isPresent ? 1 : 0.35;
    this.line(points.map(({ place }) => this.camera.point(place)), color, isPresent ? 2.5 : 1.5);
    if (isPresent) for (const { place, turn } of frames) this.drawAxes([...place, ...turn], 13, 1.2);
    this.sheet.globalAlpha = this.dimmed ? 0.4 : 1;
  }

  // The distance from the arm to the nearest keep-out shape.
  drawClosest() {
    const [from, to] = this.markers.closest;
    if (!to) return;
    const ends = [from, to].map((point) => this.camera.point(point));
    this.line(ends, this.color("--bad"), 2);
    for (const end of ends) this.dot(end, this.color("--bad"), 3);
  }

  // Names what is drawn in the picture besides the arm.
  showLegend() {
    const { limits, markers } = this;
    const entries = [
      ["range of a joint", "--limit", limits.some(({ isNear }) => !isNear)],
      ["joint near its limit", "--bad", limits.some(({ isNear }) => isNear)],
      ["keep-out", "--bad", markers.keep_outs.length],
      ["keep-in", "--good", markers.keep_ins.length],
    ].filter(([, , isShown]) => isShown);
    const names = entries.map(([name]) => name).join();
    if (this.legend.dataset.names === names) return;
    this.legend.dataset.names = names;
    this.legend.replaceChildren(...entries.map(([name, color]) => {
      const [entry, swatch] = ["li", "i"].map((kind) => document.createElement(kind));
      swatch.style.setProperty("--swatch", `var(${color})`);
      entry.append(swatch, name);
      return entry;
    }));
  }

  drawLimits() {
    for (const { arc, needle, isNear } of this.limits) {
      const color = this.color(isNear ? "--bad" : "--limit");
      this.line(arc.map((point) => this.camera.point(point)), color, isNear ? 3 : 2);
      this.line(needle.map((point) => this.camera.point(point)), color, isNear ? 3 : 1.5);
    }
  }

  // Draws links as thick lines from the farthest to the nearest, and joints as dots on them.
  drawArm(links, fill) {
    const { camera } = this;
    const thickness = Math.max(5, 0.052 * camera.scale);
    const edge = this.color("--link-edge");
    this.drawBase(links[0], fill, edge);
    const parts = [];
    for (let i = 1; i < links.length; i++) {
      const [from, to] = [links[i - 1], links[i]];
      if (distance(from, to) < 1e-6) continue;
      const thin = 1 - (0.5 * i) / links.length;
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

  // Draws runs over each other: first paths (whole paths pale, the part that has been played on top), then arms, then goals.
  drawRuns() {
    const { sheet } = this;
    for (const { run, time } of this.runs) {
      sheet.setLineDash(run.dashed ? [7, 5] : []);
      for (const { law, points } of run.ways()) {
        const color = run.byLaw ? this.lawColor(law) : this.color(run.color);
        const past = points.filter((point) => point.time <= time);
        sheet.globalAlpha = 0.3;
        this.line(points.map(({ place }) => this.camera.point(place)), color, 1.5);
        sheet.globalAlpha = 1;
        if (past.length > 1) this.line(past.map(({ place }) => this.camera.point(place)), color, 3);
      }
      sheet.setLineDash([]);
    }
    sheet.globalAlpha = this.runs.length > 1 ? 0.75 : 1;
    for (const { links, run } of this.stage ? [] : this.runs) {
      const fill = this.color(this.runs.length > 1 ? run.color : "--link");
      for (const arm of links ?? []) this.drawArm(arm, fill);
    }
    sheet.globalAlpha = 1;
    const goals = [];
    for (const { goal, tool } of this.runs) {
      if (goal && !goals.some((known) => distance(known, goal) < 1e-3)) goals.push(goal);
      if (tool) this.drawFrame(tool, 30, 2.5, "");
    }
    for (const goal of goals) this.drawFrame(goal, 46, 2.5, "goal");
    this.runs.forEach(({ tool, run }, i) => tool && this.nameAt(run.name, tool, -14 * (i + 1)));
  }

  drawBase(foot, fill, edge) {
    const { sheet, camera } = this;
    const [x, y] = camera.point(foot);
    const radius = 0.09 * camera.scale;
    sheet.fillStyle = fill;
    sheet.strokeStyle = edge;
    sheet.lineWidth = 1.5;
    sheet.beginPath();
    sheet.ellipse(x, y, radius, Math.max(1, radius * Math.abs(Math.sin(camera.elevation))), 0, 0, 7);
    sheet.fill();
    sheet.stroke();
  }

  // Whether tool and goal are too close to each other for two labels.
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

  nameAt(text, place, lift = -14) {
    const [x, y] = this.camera.point(place);
    this.name(text, x - 34, y + lift);
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
    for (const { kind, axis, points, depths } of handlesOf(this.goal, camera)) {
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
}
