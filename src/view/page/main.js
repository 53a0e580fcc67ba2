// Connects the parts of the page: data from the program goes to scene, curves and controls, and input of the user goes to the program.

import { Connection } from "./connection.js";
import { surfacesOf } from "./arm_shape.js";
import { Chart } from "./curves.js";
import { Goal } from "./goal.js";
import { Jog } from "./jog.js";
import { limitsOf } from "./limits.js";
import { Parameters } from "./parameters.js";
import { Scene } from "./scene.js";
import { fromFrame, inFrame } from "./space.js";
import { Theatre } from "./theatre.js";

const byId = (id) => document.getElementById(id);
const DEGREES = 180 / Math.PI;

let robot = null;
let now = null;
let mayDrive = false;
let connected = false;
let announced = "";
let said = { words: "connecting", look: "lost" };
let rejected = null;

const scene = new Scene(byId("scene"), byId("stage"), byId("legend"), {
  moved(pose) {
    goal.edit(fromBase(pose));
    if (byId("follow").checked) stream(fromBase(pose));
  },
  released: (pose) => send(fromBase(pose)),
});
const goal = new Goal(byId("goal"), { edited: () => showGoal(), send: (pose) => send(pose) });
const JOINT_COLORS = ["--law-diffc", "--law-logc", "--law-double_geodesic", "--component-1", "--component-2", "--component-3"];
const charts = {
  error: new Chart(byId("first-curves"), {
    title: "error", unit: "mm, °", log: true, floor: 0.01, top: 0.01,
    series: [{ name: "position", color: "--law-diffc" }, { name: "rotation", color: "--law-logc" }],
  }),
  speed: new Chart(byId("first-curves"), { title: "joint speeds", unit: "% of the limit", top: 1, digits: 0, series: [] }),
  sigma: new Chart(byId("more-curves"), {
    title: "smallest singular value", unit: "1", log: true, floor: 0.001, top: 0.001, mark: "damping begins",
    series: [{ name: "σ", color: "--law-double_geodesic" }],
  }),
  jitter: new Chart(byId("more-curves"), {
    title: "cycle jitter", unit: "µs", log: true, floor: 1, top: 1,
    series: [{ name: "99 %", color: "--law-diffc" }, { name: "worst", color: "--component-1" }],
  }),
};

byId("no-webgl").hidden = scene.stage !== null;

// The cookie has the token now, so it is removed from the address bar.
history.replaceState(null, "", "/");

const connection = new Connection({
  async hello(frame) {
    mayDrive = frame.drive;
    connected = true;
    byId("version").textContent = frame.version;
    byId("rights").hidden = mayDrive || frame.recorded;
    if (frame.recorded && !theatre.open) theatre.play(await (await fetch("/runs")).json());
    allow();
  },
  news: (answer) => message(answer.ok, answer.text),
  race: (frame) => theatre.follow(frame),
  robot(frame) {
    robot = frame;
    if (!theatre.open) scene.setReach(frame.reach);
    fillLaws(frame.parameters);
    charts.sigma.level = frame.damping_threshold;
    charts.error.least = [frame.tolerance[0] * 1e3, frame.tolerance[1] * DEGREES];
    byId("race-details").hidden = frame.joints.some((name) => name.includes("/"));
    makeJoints(frame.joints);
    parameters.show(frame.parameters);
  },
  async arm_shape({ size }) {
    const read = size ? surfacesOf(await (await fetch("/arm_shape")).arrayBuffer()) : [];
    scene.setLooks(read);
  },
  markers: (frame) => scene.setMarkers(frame),
  now(frame) {
    now = frame;
    show();
  },
  lost(reason, forGood) {
    connected = false;
    say(forGood ? reason : `${reason || "the program that serves this page is gone"}: trying again`, "lost");
    allow();
  },
});

// Resolves when the program has answered.
const jog = new Jog(byId("jog"), byId("jog-speed"), async (linear, angular) => {
  const answer = await connection.ask({ jog: { linear, angular } });
  if (!answer.ok) message(false, answer.text);
});

const parameters = new Parameters(async (name, value) => {
  const answer = await report(connection.ask({ set: { name, value } }));
  return answer.ok;
});

// Goals of two arms are in the frame of the left tool, but the scene is in the base frame.
const inBase = (pose) => (now.goal_frame ? inFrame(now.goal_frame, pose) : pose);
const fromBase = (pose) => (now.goal_frame ? fromFrame(now.goal_frame, pose) : pose);

// Controls that need a servo and the right to drive are shown only if both are present.
function allow() {
  const can = connected && mayDrive;
  byId("drive").disabled = byId("brake").disabled = !can;
  if (!can && jog.on) jog.set(false);
  scene.driving = can && Boolean(now?.alive) && !theatre.open;
  scene.dimmed = !connected || !(now?.alive || theatre.open);
  scene.change();
}

// A change of state is shown at once. A change of a number in it is shown ten times a second, because it changes the layout of the whole
// page.
function say(words, look) {
  said = { words, look };
  // A different duration since the loss is not a different state.
  const kind = look === "lost" ? words.replace(/\d+/g, "") : now?.servo?.state ?? "";
  if (kind === announced) return;
  announced = kind;
  showWords();
  // Screen readers announce a change of state, but not every change of a number in it.
  byId("announcement").textContent = words;
}

function showWords() {
  const { words, look } = said;
  const state = byId("state");
  if (state.textContent === words && state.className === look) return;
  state.textContent = words;
  state.className = look;
  document.title = `${words} – dq_servo`;
  byId("scene").setAttribute("aria-label", `The arm: ${words}`);
}

function show() {
  const { alive, words, servo, links, frames, tool } = now;
  if (!theatre.open) say(words, !alive ? "lost" : servo.warning ? "warning" : servo.state === "settled" ? "settled" : "");
  allow();
  if (alive) {
    scene.follow({ links, frames, tool, motion: servo.goal_count, law: servo.law, limits: jointLimits() });
    record();
    showRejection(servo.rejected_goal);
  }
  showGoal();
}

function record() {
  const { time, servo, error, velocities } = now;
  const hasGoal = servo.goal !== null;
  charts.error.add(time, error && hasGoal ? [error[0] * 1e3, error[1] * DEGREES] : [null, null]);
  charts.sigma.add(time, [servo.smallest_singular_value]);
  // No value has been measured yet in this motion.
  charts.jitter.add(time, [servo.jitter_p99_us || null, servo.jitter_max_us || null]);
  if (robot && velocities?.length) {
    charts.speed.add(time, velocities.map((speed, i) => (100 * Math.abs(speed)) / robot.joint_velocity[i]));
  }
}

function jointLimits() {
  const { frames, positions } = now;
  return frames && robot ? limitsOf(frames, positions, robot) : [];
}

function showRejection(rejection) {
  const stamp = rejection?.stamp ?? null;
  // Goals that were rejected before the page was opened are not reported.
  if (rejected !== null && stamp !== null && stamp !== rejected) {
    message(false, `the servo rejected the goal: ${rejection.why}`);
    goal.drop();
  }
  rejected = stamp ?? "";
}

function showGoal() {
  if (!now || scene.held?.handle) return;
  const taken = now.servo?.goal ?? null;
  const pose = goal.shown(taken);
  scene.taken = taken && inBase(taken);
  scene.goalName = pose ? "goal" : "tool: drag it to set a goal";
  // Without a goal, the handles are at the tool.
  scene.goal = pose ? inBase(pose) : now.tool;
  if (!goal.draft) goal.fill(pose ?? now.pose);
  scene.change();
}

// While a goal is dragged, the newest pose is sent as soon as the previous one was answered.
let newest = null;
async function stream(pose) {
  const isUnderWay = newest !== null;
  newest = pose;
  if (isUnderWay) return;
  let answer = { ok: true };
  for (let sent = null; answer.ok && newest !== null && sent !== newest; ) {
    sent = newest;
    answer = await ask(sent);
  }
  newest = null;
  if (!answer.ok) message(false, answer.text);
}

// A goal that is held is repeated at this interval [ms], so that the servo takes everything from press to release as one motion: after a
// silence of 1.5 s it would begin another one.
const REPEAT = 500;
setInterval(() => {
  if (scene.held?.handle && scene.held.before !== scene.goal && byId("follow").checked) stream(fromBase(scene.goal));
}, REPEAT);

const ask = (pose) => connection.ask({ goal: { position: pose.slice(0, 3), orientation: pose.slice(3) } });

async function send(pose) {
  goal.sent(pose);
  showGoal();
  const answer = await report(ask(pose));
  if (!answer.ok) goal.drop();
}

async function report(asked) {
  const answer = await asked;
  message(answer.ok, answer.text);
  return answer;
}

// What a message is about is over after this time [ms].
const SHOWN_FOR = 12_000;
let fading = null;

function message(ok, text) {
  byId("message").textContent = text;
  byId("message").className = ok ? "" : "refused";
  clearTimeout(fading);
  fading = text ? setTimeout(() => message(true, ""), SHOWN_FOR) : null;
}

function makeJoints(names) {
  const rows = byId("joint-rows");
  if (rows.children.length === names.length && [...rows.children].every((row, i) => row.cells[0].textContent === names[i])) return;
  rows.replaceChildren(...names.map((name) => {
    const row = document.createElement("tr");
    const head = document.createElement("th");
    head.scope = "row";
    head.textContent = name;
    row.append(head);
    for (let i = 0; i < 2; i++) row.append(document.createElement("td"));
    const cell = document.createElement("td");
    const meter = document.createElement("meter");
    Object.assign(meter, { min: 0, max: 1, high: 0.9, optimum: 0 });
    meter.setAttribute("aria-label", `speed of ${name} against its limit`);
    cell.append(meter);
    row.append(cell);
    return row;
  }));
  const count = JOINT_COLORS.length;
  const series = names.map((name, i) => ({ name, color: JOINT_COLORS[i % count], dashed: i % (2 * count) >= count }));
  charts.speed.setSeries(series);
}

// Text is updated ten times a second.
function showFigures() {
  if (!now || !robot || document.hidden) return;
  const { positions, velocities } = now;
  [...byId("joint-rows").children].forEach((row, i) => {
    const speed = velocities?.[i];
    row.cells[1].textContent = positions ? `${amount(i, positions[i])}${limits(i)}` : "–";
    row.cells[2].textContent = speed === undefined ? "–" : `${amount(i, speed)}${slides(i) ? "/s" : ""}`;
    row.cells[3].firstChild.value = speed === undefined ? 0 : Math.abs(speed) / robot.joint_velocity[i];
  });
  if (!theatre.open) for (const chart of Object.values(charts)) chart.draw();
}

// The laws to compare: the current one and another, until the user chooses.
function fillLaws(all) {
  const law = all.find((one) => one.name === "controller");
  const [one, other] = [byId("race-one"), byId("race-other")];
  if (!law || one.options.length === law.choices.length) return;
  for (const select of [one, other]) select.replaceChildren(...law.choices.map((name) => new Option(name, name)));
  one.value = law.value;
  other.value = law.choices.find((name) => name !== law.value) ?? law.value;
}

// Rounds to a tenth of a degree or of a millimetre, and avoids "-0".
const slides = (i) => robot.units[i] === "m";
const amount = (i, value) => `${((Math.round(value * (slides(i) ? 1e3 : DEGREES) * 10) || 0) / 10).toFixed(1)}${slides(i) ? " mm" : ""}`;

function limits(i) {
  const [lower, upper] = [robot.joint_lower[i], robot.joint_upper[i]];
  if (lower === null && upper === null) return "";
  const shown = (bound) => (bound === null ? "∞" : (bound * (slides(i) ? 1e3 : DEGREES)).toFixed(0));
  return ` (${shown(lower)} … ${shown(upper)})`;
}

const theatre = new Theatre(scene, () => {
  if (robot) scene.setReach(robot.reach);
  if (now) show();
});
byId("race").addEventListener("submit", (event) => {
  event.preventDefault();
  report(connection.ask({ race: { laws: [byId("race-one").value, byId("race-other").value] } }));
});
byId("home").addEventListener("click", () => scene.home());
byId("here").addEventListener("click", () => {
  if (now?.pose) goal.edit(now.pose);
  showGoal();
});
for (const ask of ["stop", "pause", "resume", "reset", "record", "end_recording"]) {
  byId(ask).addEventListener("click", () => {
    if (ask === "stop") {
      goal.drop();
      newest = null;
    }
    if (ask === "stop" || ask === "pause") jog.set(false);
    report(connection.ask(ask));
  });
}
addEventListener("keydown", (event) => {
  if (event.key !== "Escape" || event.defaultPrevented) return;
  // Cancels a drag that the arm does not follow yet. Otherwise stops the arm.
  const isDraft = scene.cancel() && !byId("follow").checked;
  if (!isDraft && !byId("brake").disabled) byId("stop").click();
});
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => scene.change());
setInterval(() => {
  if (!theatre.open) showWords();
  showFigures();
  theatre.draw();
}, 100);
