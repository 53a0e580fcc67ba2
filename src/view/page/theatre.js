// Shows runs over each other in the place of the arm: two arms that race to the same goal under two laws, or what was recorded.

import { Chart } from "./curves.js";
import { Player } from "./player.js";
import { Run } from "./run.js";

const byId = (id) => document.getElementById(id);
const DEGREES = 180 / Math.PI;
const OTHER_COLORS = ["--component-1", "--component-2", "--component-3", "--component-0"];

const number = (value, digits) => (Number.isFinite(value) ? value.toFixed(digits) : "–");
// Units of joint values: of their positions. The third entry is the suffix for that unit.
const FIGURES = [
  ["settled, rotation [s]", (motion) => number(motion.figures.settling_time_2_percent_rotation_s ?? NaN, 2)],
  ["settled, position [s]", (motion) => number(motion.figures.settling_time_2_percent_position_s ?? NaN, 2)],
  ["at goal [s]", (motion) => number(motion.figures.arrival_time_s ?? NaN, 2)],
  ["path [m]", (motion) => number(motion.figures.path_length_m, 3)],
  ["path / straight", (motion) => number(motion.figures.path_ratio ?? NaN, 3)],
  ["overshoot [mm]", (motion) => number(1e3 * motion.figures.overshoot_m, 1)],
  ["peak", (motion) => number(motion.figures.peak_joint_speed_rad_s, 2), "/s"],
  ["effort", (motion) => number(motion.figures.effort_rad2_s, 1), "²/s"],
];

export class Theatre {
  // `closed()` is called when the user returns to the arm.
  constructor(scene, closed) {
    Object.assign(this, { scene, runs: [], race: 0, open: false });
    this.closed = closed;
    this.player = new Player(byId("player"), (time) => this.show(time));
    byId("back").addEventListener("click", () => {
      this.close();
      closed();
    });
  }

  // Updates a race: the current state of both arms.
  follow(race) {
    if (race.number < this.race || (race.number === this.race && !this.open)) return;
    if (race.number > this.race) {
      this.race = race.number;
      // A page that is opened after the race has ended shows the arm.
      if (race.over) return;
      this.runs = race.lanes.map(({ law }) => new Run({ ...race, name: law, laws: [[-Infinity, law]] }));
      this.enter();
    }
    const isOn = race.lanes.every(({ sample }) => sample.links && sample.goal);
    race.lanes.forEach(({ sample, words, figures, law }, i) => {
      const run = this.runs[i];
      run.states.push([sample.time, words]);
      if (isOn && !(sample.time <= run.end && run.samples.length)) {
        run.samples.push(sample);
        this.plot(i, sample);
      }
      run.motions = [{ law, figures }];
    });
    this.fillTable();
    if (race.over) byId("announcement").textContent = `compared: ${this.runs.map((run) => `${run.name}: ${run.state(Infinity)}`).join("; ")}`;
    this.player.span(0, Math.max(...this.runs.map((run) => run.end)), this.player.following);
    if (!this.player.following) this.show(this.player.time);
  }

  // Plays recorded runs, on a page that has no robot.
  play(runs) {
    this.runs = runs.map((run) => new Run(run));
    document.body.classList.add("recorded");
    this.enter();
    byId("back").hidden = true;
    this.runs.forEach((run, i) => run.samples.forEach((sample) => this.plot(i, sample)));
    this.player.go(this.player.start);
    this.player.play();
  }

  enter() {
    this.open = true;
    document.body.classList.add("theatre");
    byId("player").hidden = byId("runs").hidden = byId("run-curves").hidden = false;
    byId("curves").hidden = byId("joints").hidden = true;
    byId("back").hidden = false;
    this.scene.setReach(Math.max(...this.runs.map((run) => run.reach)));
    this.colorRuns();
    this.makeCharts(this.runs[0].threshold);
    this.fillTable();
    this.player.span(Math.min(...this.runs.map((run) => run.start)), Math.max(...this.runs.map((run) => run.end)), true);
  }

  close() {
    this.open = false;
    document.body.classList.remove("theatre");
    this.player.pause();
    byId("player").hidden = byId("runs").hidden = byId("run-curves").hidden = byId("back").hidden = true;
    byId("curves").hidden = byId("joints").hidden = false;
    this.scene.runs = null;
    this.scene.change();
  }

  // Each run has the colour of its law, or a colour of its own if both laws are the same. The second run is also dashed.
  colorRuns() {
    const laws = this.runs.map((run) => run.law(Infinity).split(" ")[0]);
    const has = (law) => getComputedStyle(document.documentElement).getPropertyValue(`--law-${law}`) !== "";
    this.runs.forEach((run, i) => {
      const isAlone = has(laws[i]) && laws.indexOf(laws[i]) === laws.lastIndexOf(laws[i]);
      run.color = isAlone ? `--law-${laws[i]}` : OTHER_COLORS[i % OTHER_COLORS.length];
      run.byLaw = isAlone;
      run.dashed = i % 2 === 1;
    });
  }

  makeCharts(threshold) {
    const place = byId("run-curves");
    for (const figure of place.querySelectorAll("figure")) figure.remove();
    const series = this.runs.map(({ name, color, dashed }) => ({ name, color, dashed }));
    const chart = (options) => new Chart(place, { series, ...options });
    this.charts = [
      [chart({ title: "position error", unit: "mm", log: true, floor: 0.01, top: 1 }), ({ error }) => error && error[0] * 1e3],
      [chart({ title: "rotation error", unit: "°", log: true, floor: 0.01, top: 1 }), ({ error }) => error && error[1] * DEGREES],
      [chart({ title: "fastest joint", unit: "% of its limit", top: 1, digits: 0 }), ({ speeds }) => (speeds.length ? Math.max(...speeds) : null)],
      [chart({ title: "smallest singular value", unit: "1", log: true, floor: 0.001, top: 0.001, mark: "damping begins" }), ({ sigma }) => sigma],
    ];
    this.charts[3][0].level = threshold;
  }

  plot(run, sample) {
    for (const [chart, value] of this.charts) chart.push(run, sample.time, value(sample));
  }

  show(time) {
    this.scene.runs = this.runs.map((run) => ({ ...run.at(time), run, time }));
    this.scene.change();
    byId("state").textContent = this.runs.map((run) => `${run.name}: ${run.state(time) || run.law(time)}`).join(" · ");
    byId("state").className = "";
    byId("scene").setAttribute("aria-label", `The arms: ${byId("state").textContent}`);
    for (const [chart] of this.charts) {
      // The timeline and the curves have the same time.
      chart.window = [this.player.start, Math.max(this.player.end, this.player.start + 1)];
      chart.cursor = time;
    }
  }

  draw() {
    if (this.open) for (const [chart] of this.charts) chart.draw();
  }

  fillTable() {
    const motions = this.runs.flatMap((run) => run.motions);
    // A column without a value in any run is left out.
    const figures = FIGURES.filter(([, text]) => motions.some((motion) => text(motion) !== "–"));
    const rows = this.runs.flatMap((run) => run.motions.map((motion, i) => {
      const row = document.createElement("tr");
      const name = motion.law && motion.law !== run.name ? `${run.name}, ${motion.law}` : run.name;
      const cells = [run.motions.length > 1 ? `${name} (${i + 1})` : name, ...figures.map(([, text]) => text(motion))];
      row.append(...cells.map((text, column) => {
        const cell = document.createElement(column ? "td" : "th");
        if (!column) cell.scope = "row";
        cell.textContent = text;
        return cell;
      }));
      return row;
    }));
    byId("run-rows").replaceChildren(...rows);
    const units = ["rad", "m"].filter((unit) => this.runs.some((run) => run.units.includes(unit)));
    const names = ["run", ...figures.map(([name, , rest]) => (rest ? `${name} [${units.map((unit) => unit + rest).join(", ")}]` : name))];
    byId("run-heads").replaceChildren(...names.map((name) => Object.assign(document.createElement("th"), { scope: "col", textContent: name })));
  }
}
