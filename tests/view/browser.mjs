// The page in a real browser: `node browser.mjs CASE LINK DIRECTORY`. Says on stdout how far it is; screenshots go to the directory.
import { strict as assert } from "node:assert";
import { createRequire } from "node:module";

const require = createRequire(`${process.env.MODULES}/`);
const { chromium } = require("playwright-core");
const [name, link, directory] = process.argv.slice(2);
const GOAL = { x: -0.125, y: 0.2, z: 0.2, roll: 0, pitch: 0, yaw: 0 };

const say = (text) => console.log(text);
const faults = [];

async function open(browser, options = {}) {
  const context = await browser.newContext({ viewport: { width: 1280, height: 900 }, ...options });
  const page = await context.newPage();
  page.setDefaultTimeout(60_000);
  // A connection that is lost is no fault of the page, and its picture is read back by this test alone.
  page.on("console", (line) => {
    if (["error", "warning"].includes(line.type()) && !/WebSocket connection|ERR_CONNECTION|willReadFrequently/.test(line.text())) faults.push(line.text());
  });
  page.on("pageerror", (error) => faults.push(error.message));
  page.on("request", (request) => {
    if (!/^(ws|http):\/\/127\.0\.0\.1:8123\/|^data:/.test(request.url())) faults.push(`asked elsewhere: ${request.url()}`);
  });
  await page.goto(link);
  return page;
}

const state = (page, pattern) =>
  page.waitForFunction(([source]) => new RegExp(source).test(document.getElementById("state").textContent), [pattern.source]);
const message = (page, text) =>
  page.waitForFunction(([expected]) => document.getElementById("message").textContent.includes(expected), [text]);
const ready = (page) => page.waitForFunction(() => document.querySelectorAll("#joint-rows tr").length === 6
  && !document.getElementById("drive").disabled && document.querySelector("#goal [name=x]").value !== "");

// Remembers what the scene shows, and returns how many of its pixels have changed since it was last called.
const changed = (page) => page.evaluate(() => {
  const canvas = document.getElementById("scene");
  const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
  const before = window.before;
  window.before = data;
  let count = 0;
  for (let i = 3; before && i < data.length; i += 4) {
    if (before[i] !== data[i] || before[i - 1] !== data[i - 1] || before[i - 3] !== data[i - 3]) count++;
  }
  return count;
});

// How many pixels of the scene have that colour.
const pixels = (page, color) => page.evaluate(([red, green, blue]) => {
  const canvas = document.getElementById("scene");
  const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
  let count = 0;
  for (let i = 0; i < data.length; i += 4) if (data[i] === red && data[i + 1] === green && data[i + 2] === blue) count++;
  return count;
}, color);

// The first frame of each kind that another connection of the page's own gets.
const frames = (page) => page.evaluate(() => new Promise((resolve) => {
  const seen = {};
  const socket = new WebSocket(`ws://${location.host}/session`);
  socket.onmessage = ({ data }) => {
    Object.assign(seen, JSON.parse(data));
    if (seen.robot && seen.now) {
      socket.close();
      resolve(seen);
    }
  };
}));

async function sendGoal(page, pose) {
  for (const [field, value] of Object.entries(pose)) await page.fill(`#goal [name=${field}]`, `${value}`);
  await page.click("#send");
  await message(page, "goal sent");
}

// Where the goal's handles are on the sheet, by the page's own camera.
const handles = (page) => frames(page).then(({ robot, now }) => page.evaluate(async ([reach, goal]) => {
  const { Camera, axes, add, scaled, dot } = await import("./space.js");
  const canvas = document.getElementById("scene");
  const camera = new Camera();
  camera.reach = reach;
  camera.resize(canvas.clientWidth, canvas.clientHeight);
  camera.aim();
  const box = canvas.getBoundingClientRect();
  const border = 1;
  const at = (p) => camera.point(p).map((part, i) => part + (i ? box.top : box.left) + border);
  const place = goal.slice(0, 3);
  const frame = axes(goal.slice(3));
  return frame.map((axis, i) => {
    const [u, v] = [frame[(i + 1) % 3], frame[(i + 2) % 3]];
    // The point of the ring that is nearest to the viewer, and where it goes when the ring turns.
    const [a, b] = [dot(u, camera.towards), dot(v, camera.towards)];
    const norm = Math.hypot(a, b);
    const nearest = add(scaled(a / norm, u), scaled(b / norm, v));
    const along = add(scaled(-b / norm, u), scaled(a / norm, v));
    return {
      tip: at(add(place, scaled(74 / camera.scale, axis))), direction: camera.direction(axis), scale: camera.scale,
      ring: at(add(place, scaled(50 / camera.scale, nearest))), tangent: camera.direction(along),
    };
  });
}, [robot.reach, now.servo.goal]));

async function drag(page, [x, y], [dx, dy]) {
  await page.mouse.move(x, y);
  await page.mouse.down();
  for (let i = 1; i <= 8; i++) await page.mouse.move(x + (dx * i) / 8, y + (dy * i) / 8);
  await page.mouse.up();
}

const normed = ([x, y], length) => [(x * length) / Math.hypot(x, y), (y * length) / Math.hypot(x, y)];

const cases = {
  async drive(browser) {
    const page = await open(browser);
    await ready(page);
    await state(page, /^holding/);
    await changed(page);
    await sendGoal(page, GOAL);
    await state(page, /^tracking/);
    await page.waitForTimeout(500);
    assert.ok((await changed(page)) > 500, "the arm is seen to move");
    await state(page, /^settled after [\d.]+ s and [\d.]+ m$/);
    const { now } = await frames(page);
    assert.ok(Math.abs(now.tool[1] - GOAL.y) < 2e-3, `the tool is at the goal: ${now.tool}`);
    say("arrived");
    await page.selectOption("#law", "double_geodesic");
    await message(page, "controller is double_geodesic");
    await page.waitForTimeout(300);
    assert.ok((await pixels(page, [213, 94, 0])) > 20, "the way under logc keeps logc's colour");
    await page.waitForSelector("#gains [id='parameter-double_geodesic.gain_linear']");
    await page.fill("[id='parameter-double_geodesic.gain_linear']", "2.5");
    await page.press("[id='parameter-double_geodesic.gain_linear']", "Enter");
    await message(page, "double_geodesic.gain_linear is 2.5");
    await page.fill("[id='parameter-double_geodesic.gain_linear']", "1e9");
    await page.press("[id='parameter-double_geodesic.gain_linear']", "Enter");
    await message(page, "cannot be");
    await page.waitForFunction(() => document.getElementById("parameter-double_geodesic.gain_linear").value === "2.5");
    say("switched");
    await shift(page);
    await turn(page);
    say("dragged");
    await page.click("#pause");
    await state(page, /^paused/);
    await page.click("#resume");
    await state(page, /^(settled|tracking)/);
    await page.click("#reset");
    await message(page, "back to initial_positions");
    await page.keyboard.press("Escape");
    await message(page, "the goal is dropped");
    await state(page, /^holding/);
    await page.screenshot({ path: `${directory}/driven.png` });
  },

  async looks(browser) {
    const page = await open(browser);
    await ready(page);
    await sendGoal(page, GOAL);
    await state(page, /^settled/);
    for (const scheme of ["light", "dark"]) {
      await page.emulateMedia({ colorScheme: scheme });
      for (const [look, width, height] of [["desktop", 1280, 900], ["phone", 360, 740]]) {
        await page.setViewportSize({ width, height });
        await page.waitForTimeout(300);
        await page.screenshot({ path: `${directory}/${look}-${scheme}.png`, fullPage: true });
        const [needed, there] = await page.evaluate(() => [document.documentElement.scrollWidth, innerWidth]);
        assert.ok(needed <= there, `${look}: ${needed} px wide on ${there}`);
        await isAccessible(page, `${look}, ${scheme}`);
      }
    }
    await page.setViewportSize({ width: 1280, height: 900 });
    await byKeyboard(page);
  },

  async watch(browser) {
    const page = await open(browser);
    await page.waitForFunction(() => document.querySelectorAll("#joint-rows tr").length === 6);
    await state(page, /^holding/);
    assert.ok(await page.isVisible("#rights"));
    for (const id of ["stop", "send", "law", "reset"]) assert.ok(await page.isDisabled(`#${id}`), id);
    await page.keyboard.press("Escape");
    await page.waitForTimeout(200);
    assert.equal(await page.textContent("#message"), "");
  },

  async lost(browser) {
    const page = await open(browser);
    await ready(page);
    await state(page, /^holding/);
    say("open");
    await state(page, /trying again$/);
    assert.ok(await page.isDisabled("#stop"));
    await page.screenshot({ path: `${directory}/lost.png` });
    say("server lost");
    await state(page, /^holding/);
    await ready(page);
    say("server found");
    await state(page, /^the servo is gone/);
    await page.screenshot({ path: `${directory}/gone.png` });
    say("servo lost");
    await state(page, /^holding/);
    await ready(page);
    await sendGoal(page, GOAL);
    await state(page, /^settled/);
    await page.click("#stop");
    await message(page, "the goal is dropped");
    say("servo found");
  },

  async demo(browser) {
    const page = await open(browser);
    await state(page, /^tracking/);
    await changed(page);
    await page.waitForTimeout(500);
    assert.ok((await changed(page)) > 500, "the arm is seen to move");
    await state(page, /^settled/);
    const rate = await page.evaluate(() => new Promise((resolve) => {
      const begin = performance.now();
      let count = 0;
      const next = () => (count++, performance.now() - begin < 1000 ? requestAnimationFrame(next) : resolve(count));
      requestAnimationFrame(next);
    }));
    say(`${rate} pictures in a second`);
  },
};

async function shift(page) {
  const before = (await frames(page)).now.servo.goal;
  const all = await handles(page);
  const longest = all.reduce((best, one, i) => (Math.hypot(...one.direction) > Math.hypot(...all[best].direction) ? i : best), 0);
  const { tip, direction, scale } = all[longest];
  await drag(page, tip, normed(direction, 40));
  await message(page, "goal sent");
  await page.waitForTimeout(500);
  const after = (await frames(page)).now.servo.goal;
  const moved = Math.hypot(...[0, 1, 2].map((i) => after[i] - before[i]));
  assert.ok(Math.abs(moved - (40 * scale) / (Math.hypot(...direction) * scale)) < 0.01, `an arrow shifts along its axis: ${before}, ${after}`);
  assert.ok(after.slice(3).every((part, i) => Math.abs(part - before[3 + i]) < 1e-9));
  await state(page, /^settled/);
}

async function turn(page) {
  const before = (await frames(page)).now.servo.goal;
  const all = await handles(page);
  const widest = all.reduce((best, one, i) => (Math.hypot(...one.tangent) > Math.hypot(...all[best].tangent) ? i : best), 0);
  await drag(page, all[widest].ring, normed(all[widest].tangent, 20));
  await message(page, "goal sent");
  await page.waitForTimeout(500);
  const after = (await frames(page)).now.servo.goal;
  const angle = 2 * Math.acos(Math.min(1, Math.abs([3, 4, 5, 6].reduce((sum, i) => sum + before[i] * after[i], 0))));
  assert.ok(angle > 0.1 && angle < 1, `a ring turns: ${angle}`);
  assert.ok([0, 1, 2].every((i) => Math.abs(after[i] - before[i]) < 1e-9));
  await state(page, /^settled/);
}

// By the rules of WCAG 2 that can be checked by a program.
async function isAccessible(page, look) {
  await page.evaluate(require("axe-core").source);
  const { violations } = await page.evaluate(() => window.axe.run());
  assert.deepEqual(violations.map(({ id, nodes }) => `${id}: ${nodes.map((node) => node.html).join(" ")}`), [], look);
}

async function byKeyboard(page) {
  await page.evaluate(() => document.activeElement.blur());
  const reached = [];
  for (let i = 0; i < 24; i++) {
    await page.keyboard.press("Tab");
    reached.push(await page.evaluate(() => document.activeElement.id || document.activeElement.name));
  }
  for (const id of ["scene", "stop", "pause", "x", "yaw", "send", "law"]) assert.ok(reached.includes(id), `${id} among ${reached}`);
  await page.focus("#scene");
  await changed(page);
  await page.keyboard.press("ArrowLeft");
  await page.waitForTimeout(200);
  assert.ok((await changed(page)) > 500, "an arrow key turns the view");
  await page.focus("#goal [name=z]");
  await page.keyboard.press("Control+A");
  await page.keyboard.type("0.15");
  await page.keyboard.press("Enter");
  await message(page, "goal sent");
  await state(page, /^tracking/);
}

// Without a sandbox of its own: in the tests it is root in a network namespace of its own.
const browser = await chromium.launch({ executablePath: "/usr/bin/chromium", args: ["--no-sandbox"] });
try {
  await cases[name](browser);
  assert.deepEqual(faults, [], "the console is empty");
} finally {
  await browser.close();
}
say("done");
