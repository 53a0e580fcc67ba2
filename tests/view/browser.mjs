// Tests the page in a real browser: `node browser.mjs CASE LINK DIRECTORY`. Prints its progress on stdout; screenshots go to the directory.
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
  // A lost connection is not a fault of the page, and only this test reads back its picture.
  page.on("console", (line) => {
    if (["error", "warning"].includes(line.type()) && !/WebSocket connection|ERR_CONNECTION|willReadFrequently|status of 403|GPU stall due to ReadPixels|WebGL is disabled|Error creating WebGL/.test(line.text())) faults.push(line.text());
  });
  page.on("pageerror", (error) => faults.push(error.message));
  page.on("request", (request) => {
    if (!/^(ws|http):\/\/127\.0\.0\.1:8123\/|^data:/.test(request.url())) faults.push(`asked elsewhere: ${request.url()}`);
  });
  await page.goto(link);
  await unfold(page);
  return page;
}

// Opens all folded sections.
const unfold = (page) => page.evaluate(() => document.querySelectorAll("details").forEach((details) => (details.open = true)));

const state = (page, pattern) =>
  page.waitForFunction(([source]) => new RegExp(source).test(document.getElementById("state").textContent), [pattern.source]);
const message = (page, text) =>
  page.waitForFunction(([expected]) => document.getElementById("message").textContent.includes(expected), [text]);
const ready = (page) => page.waitForFunction(() => document.querySelectorAll("#joint-rows tr").length === 6
  && !document.getElementById("drive").disabled && document.querySelector("#goal [name=x]").value !== "");

// Stores the picture, and returns how many of its pixels have changed since the last call.
const changed = async (page) => {
  const picture = (await page.locator("#picture").screenshot()).toString("base64");
  return page.evaluate(async (picture) => {
    const bytes = Uint8Array.from(atob(picture), (letter) => letter.charCodeAt(0));
    const image = await createImageBitmap(new Blob([bytes]));
    const sheet = new OffscreenCanvas(image.width, image.height).getContext("2d");
    sheet.drawImage(image, 0, 0);
    const { data } = sheet.getImageData(0, 0, image.width, image.height);
    const before = window.before;
    window.before = data;
    let count = 0;
    for (let i = 3; before && i < data.length; i += 4) {
      if (before[i - 1] !== data[i - 1] || before[i - 2] !== data[i - 2] || before[i - 3] !== data[i - 3]) count++;
    }
    return count;
  }, picture);
};

// Returns the number of pixels of the stage that show the arm and whose red exceeds blue by this factor.
const onStage = (page, redder = 0) => page.evaluate(async (redder) => {
  const stage = document.getElementById("stage");
  const sheet = new OffscreenCanvas(stage.width, stage.height).getContext("2d");
  let most = 0;
  // WebGL's drawing can be read only within the same frame.
  for (let picture = 0; picture < 8; picture++) {
    document.getElementById("scene").dispatchEvent(new KeyboardEvent("keydown", { key: "+" }));
    await new Promise(requestAnimationFrame);
    sheet.clearRect(0, 0, stage.width, stage.height);
    sheet.drawImage(stage, 0, 0);
    const { data } = sheet.getImageData(0, 0, stage.width, stage.height);
    let count = 0;
    for (let i = 3; i < data.length; i += 4) if (data[i] === 255 && data[i - 3] >= redder * data[i - 1]) count++;
    most = Math.max(most, count);
  }
  document.getElementById("scene").dispatchEvent(new KeyboardEvent("keydown", { key: "0" }));
  return most;
}, redder);

// Returns the number of pixels of the scene with this color.
const pixels = (page, color) => page.evaluate(([red, green, blue]) => {
  const canvas = document.getElementById("scene");
  const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
  let count = 0;
  for (let i = 0; i < data.length; i += 4) if (data[i] === red && data[i + 1] === green && data[i + 2] === blue) count++;
  return count;
}, color);

// Returns the first frame of each kind on another connection of the page.
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

// Returns the positions of the goal's handles on the sheet, computed with the page's camera.
const handles = (page) => frames(page).then(({ now }) => page.evaluate(async ([goal]) => {
  const { Camera, axes, add, scaled, dot } = await import("./space.js");
  const canvas = document.getElementById("scene");
  const camera = new Camera();
  Object.assign(camera, JSON.parse(canvas.dataset.camera));
  camera.resize(canvas.clientWidth, canvas.clientHeight);
  camera.aim();
  scrollTo(0, 0);
  const box = canvas.getBoundingClientRect();
  const at = (p) => camera.point(p).map((part, i) => part + (i ? box.top : box.left));
  const place = goal.slice(0, 3);
  const frame = axes(goal.slice(3));
  return frame.map((axis, i) => {
    const [u, v] = [frame[(i + 1) % 3], frame[(i + 2) % 3]];
    // The point of the ring that is nearest to the viewer, and its direction of motion when the ring turns.
    const [a, b] = [dot(u, camera.towards), dot(v, camera.towards)];
    const norm = Math.hypot(a, b);
    const nearest = add(scaled(a / norm, u), scaled(b / norm, v));
    const along = add(scaled(-b / norm, u), scaled(a / norm, v));
    return {
      tip: at(add(place, scaled(74 / camera.scale, axis))), direction: camera.direction(axis), scale: camera.scale,
      ring: at(add(place, scaled(50 / camera.scale, nearest))), tangent: camera.direction(along),
    };
  });
}, [now.servo.goal]));

async function drag(page, [x, y], [dx, dy]) {
  await page.mouse.move(x, y);
  await page.mouse.down();
  for (let i = 1; i <= 8; i++) await page.mouse.move(x + (dx * i) / 8, y + (dy * i) / 8);
  await page.mouse.up();
}

const heads = (page) => page.$$eval("#run-heads th", (all) => all.map((cell) => cell.textContent));
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
    await page.waitForSelector("#gains [id='parameter-gains.double_geodesic[1]']");
    await page.fill("[id='parameter-gains.double_geodesic[1]']", "2.5");
    await page.press("[id='parameter-gains.double_geodesic[1]']", "Enter");
    await message(page, "gains.double_geodesic is [1.0, 2.5]");
    await page.fill("[id='parameter-gains.double_geodesic[1]']", "1e9");
    await page.press("[id='parameter-gains.double_geodesic[1]']", "Enter");
    await message(page, "cannot be");
    await page.waitForFunction(() => document.getElementById("parameter-gains.double_geodesic[1]").value === "2.5");
    await overtaken(page);
    say("switched");
    await refuses(page);
    await shift(page);
    await turn(page);
    await holds(page);
    say("dragged");
    await page.click("#pause");
    await state(page, /^paused/);
    await page.click("#resume");
    await state(page, /^(settled|tracking)/);
    await jogs(page);
    await page.click("#reset");
    await message(page, "back to initial_positions");
    await page.keyboard.press("Escape");
    await message(page, "the goal is dropped");
    await state(page, /^holding/);
    assert.equal(await page.textContent("#version"), "0.1.0");
    assert.match(await page.evaluate(async () => (await fetch("guide")).text()), /^# In a browser/);
    assert.equal(await page.textContent("#law-about"), "A straight line and the shortest turn, each with its own gain.");
    assert.deepEqual(await page.$$eval("#others h4", (all) => all.map((head) => head.textContent)),
      ["Speed and position limits", "Arrival", "Silence", "Singularities", "Delay and payload", "Other"]);
    assert.equal(await page.textContent("[for='parameter-limits.linear_speed']"), "limits.linear_speed [m/s]");
    await shoot(page, { path: `${directory}/driven.png` });
  },

  async looks(browser) {
    const page = await open(browser);
    await ready(page);
    await sendGoal(page, GOAL);
    await state(page, /^settled/);
    assert.ok(await page.isHidden("#no-webgl"));
    assert.ok((await onStage(page)) > 5000, "the arm is on the stage");
    await fits(page);
    await unfold(page);
    for (const scheme of ["light", "dark"]) {
      await page.emulateMedia({ colorScheme: scheme });
      for (const [look, width, height] of [["desktop", 1280, 900], ["phone", 360, 740]]) {
        await page.setViewportSize({ width, height });
        await page.waitForTimeout(300);
        await shoot(page, { path: `${directory}/${look}-${scheme}.png`, fullPage: true });
        const [needed, there] = await page.evaluate(() => [document.documentElement.scrollWidth, innerWidth]);
        assert.ok(needed <= there, `${look}: ${needed} px wide on ${there}`);
        await isAccessible(page, `${look}, ${scheme}`);
      }
    }
    await page.setViewportSize({ width: 1280, height: 900 });
    await byKeyboard(page);
  },

  async lines(browser) {
    const page = await open(browser);
    await ready(page);
    await page.waitForTimeout(300);
    assert.ok(await page.isVisible("#no-webgl"));
    assert.ok((await pixels(page, [138, 143, 152])) > 300, "links are lines");
    await shoot(page, { path: `${directory}/lines.png` });
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
    await shoot(page, { path: `${directory}/lost.png` });
    say("server lost");
    await state(page, /^holding/);
    await ready(page);
    say("server found");
    await state(page, /^the servo is gone/);
    await shoot(page, { path: `${directory}/gone.png` });
    say("servo lost");
    await state(page, /^holding/);
    await ready(page);
    await sendGoal(page, GOAL);
    await state(page, /^settled/);
    await page.click("#stop");
    await message(page, "the goal is dropped");
    say("servo found");
    await state(page, /open the link that it printed$/);
    assert.ok(await page.isDisabled("#stop"));
    const left = page.url();
    assert.ok(!left.includes("token"), left);
    assert.match(await (await page.goto(left)).text(), /printed the link/);
  },

  async dual(browser) {
    const page = await open(browser);
    await page.waitForFunction(() => document.querySelectorAll("#joint-rows tr").length === 12 && !document.getElementById("drive").disabled);
    await state(page, /^(tracking|settled)/);
    await state(page, /^settled/);
    assert.ok(!(await page.isVisible("#race-details")) && (await page.isVisible("#aim")));
    const before = (await frames(page)).now;
    assert.equal(before.links.length, 2);
    // The goal is the right tool in the left tool's frame: it is typed in that frame, and drawn in the base frame.
    const [x] = before.servo.goal;
    assert.ok(Math.abs((await page.inputValue("#goal [name=x]")) - x) < 1e-3);
    await page.fill("#goal [name=x]", `${(x + 0.03).toFixed(4)}`);
    await page.click("#send");
    await message(page, "goal sent");
    await page.waitForTimeout(400);
    const after = (await frames(page)).now;
    assert.ok(Math.abs(after.servo.goal[0] - x - 0.03) < 1e-3, `${before.servo.goal} -> ${after.servo.goal}`);
    await state(page, /^settled/);
    const there = (await frames(page)).now;
    const place = await page.evaluate(async ([frame, pose]) => (await import("./space.js")).inFrame(frame, pose), [there.goal_frame, there.pose]);
    assert.ok([0, 1, 2].every((i) => Math.abs(place[i] - there.tool[i]) < 5e-3), `the relative pose leads to the right tool: ${place}, ${there.tool}`);
    await page.selectOption("#aim", "relative_distance");
    await message(page, "primitive is relative_distance");
    await shoot(page, { path: `${directory}/dual.png`, fullPage: true });
    await isAccessible(page, "dual");
    await page.click("#reset");
    await message(page, "back to initial_positions");
  },

  async bag(browser) {
    const page = await open(browser);
    await page.waitForSelector("#player:not([hidden])");
    assert.ok(await page.isHidden("#controls") && await page.isHidden("#brake") && await page.isHidden("#back"));
    await state(page, /^bag_demo: tracking/);
    await changed(page);
    await page.waitForTimeout(1000);
    assert.ok((await changed(page)) > 100, "the arm moves");
    await page.selectOption("#player [name=speed]", "20");
    await page.waitForFunction(() => document.querySelector("#player [name=play]").textContent === "Play");
    await shoot(page, { path: `${directory}/bag.png`, fullPage: true });
    for (const color of [[213, 94, 0], [0, 114, 178]]) assert.ok((await pixels(page, color)) > 50, `a way in ${color}`);
    const rows = await page.$$eval("#run-rows tr", (all) => all.map((row) => row.cells[0].textContent));
    assert.deepEqual(rows, ["bag_demo, logc (1)", "bag_demo, diffc (2)"]);
    await isAccessible(page, "bag");
  },

  async race(browser) {
    const page = await open(browser);
    await ready(page);
    await page.click("#race-start");
    await message(page, "send the arm to a goal first");
    await sendGoal(page, GOAL);
    await state(page, /^settled/);
    await page.selectOption("#race-one", "logc");
    await page.selectOption("#race-other", "double_geodesic");
    // While the nodes of the comparison start, Stop is answered.
    await page.evaluate(() => {
      window.told = [];
      const element = document.getElementById("message");
      new MutationObserver(() => window.told.push(element.textContent)).observe(element, { childList: true, characterData: true, subtree: true });
      document.getElementById("race-start").click();
      document.getElementById("stop").click();
    });
    await page.waitForSelector("#player:not([hidden])");
    const order = ["the goal is dropped", "logc and double_geodesic from where"];
    const told = await page.evaluate(() => window.told);
    assert.deepEqual(order.map((text) => told.findIndex((line) => line.includes(text))), [0, 1], `${told}`);
    await state(page, /^logc: tracking.* · double_geodesic: tracking/);
    await page.click("#race-start");
    await message(page, "one comparison at a time");
    await changed(page);
    await page.waitForTimeout(700);
    assert.ok((await changed(page)) > 500, "both arms are seen to move");
    await state(page, /^logc: settled.* · double_geodesic: settled/);
    await page.waitForTimeout(300);
    for (const color of [[213, 94, 0], [0, 158, 115]]) assert.ok((await pixels(page, color)) > 50, `a way in ${color}`);
    const rows = await page.$$eval("#run-rows tr", (all) => all.map((row) => [...row.cells].map((cell) => cell.textContent)));
    assert.deepEqual(rows.map(([name]) => name), ["logc", "double_geodesic"]);
    assert.ok((await heads(page)).includes("overshoot [mm]"), `${await heads(page)}`);
    for (const row of rows) assert.ok(+row[3] > 1 && +row[4] > 0.1, `it says when and how far: ${row}`);
    await shoot(page, { path: `${directory}/race.png`, fullPage: true });
    await isAccessible(page, "race");
    await page.click("#player [name=play]");
    await page.waitForTimeout(600);
    const clock = await page.textContent("#player output");
    assert.ok(parseFloat(clock) > 0.3 && parseFloat(clock) < 3, `played again from the start: ${clock}`);
    await page.click("#back");
    await state(page, /^holding/);
    assert.ok(await page.isVisible("#curves"));
    await page.waitForTimeout(300);
    assert.equal(await pixels(page, [0, 158, 115]), 0, "the other law's way is gone");
    await page.reload();
    await ready(page);
    await state(page, /^holding/);
    assert.ok(await page.isVisible("#curves"), "who comes later sees the arm");
  },

  async record(browser) {
    const page = await open(browser);
    await ready(page);
    // A busy machine draws the arcs of the limits slowly.
    while ((await pixels(page, [122, 62, 134])) <= 100) await page.waitForTimeout(300);
    assert.equal(await page.textContent("#legend"), "range of a joint");
    await page.click("#end_recording");
    await message(page, "there is no recording");
    await page.click("#record");
    await message(page, "recording into");
    await page.click("#record");
    await message(page, "going on already");
    await page.waitForTimeout(1500);
    await sendGoal(page, GOAL);
    await state(page, /^(settled|stalled|joint)/);
    await shoot(page, { path: `${directory}/limits.png`, fullPage: true });
    await page.click("#end_recording");
    await message(page, "recorded: dq_servo plot");
    await page.click("#record");
    await message(page, "recording into");
    await page.waitForTimeout(1500);
    await sendGoal(page, { ...GOAL, z: 0.25 });
    await page.waitForTimeout(1000);
  },

  async slides(browser) {
    const page = await open(browser);
    await page.waitForFunction(() => document.querySelectorAll("#joint-rows tr").length === 4 && !document.getElementById("drive").disabled);
    await state(page, /^holding/);
    await page.waitForTimeout(300);
    const row = () => page.$$eval("#joint-rows tr", (rows) => [...rows[3].cells].slice(0, 3).map((cell) => cell.textContent));
    const [name, place, speed] = await row();
    assert.deepEqual([name, place, speed], ["quill", "-100.0 mm (-300 … 50)", "0.0 mm/s"]);
    assert.ok((await pixels(page, [122, 62, 134])) > 50, "the limits are shown");
    // The arm is drawn with the shapes of its description: those of the base and of each joint.
    await page.waitForFunction(() => document.getElementById("scene").dataset.surfaces === "5");
    assert.ok((await onStage(page, 3)) > 100, "the beams are orange");
    // The rail of the quill is vertical, and as long as its travel.
    const { robot, now } = await frames(page);
    const [rail] = await page.evaluate(async ([robot, now]) => (await import("./limits.js")).limitsOf(now.frames, now.positions, robot).slice(3), [robot, now]);
    const [[x, y, low], [u, v, high]] = rail.arc;
    assert.ok(Math.hypot(x - u, y - v) < 1e-9 && Math.abs(Math.abs(high - low) - 0.35) < 1e-9, JSON.stringify(rail));
    const many = { ...robot, joint_lower: [-1e4, -1, -3, -0.3], joint_upper: [1e4, 1, 3, 0.05] };
    // A joint that can turn all the way round has no arc.
    const lengths = await page.evaluate(async ([robot, now]) => (await import("./limits.js")).limitsOf(now.frames, now.positions, robot).map(({ arc }) => arc.length), [many, now]);
    assert.equal(lengths.length, 3);
    const [part] = lengths;
    assert.ok(part > 10 && part < 100, `${part} points`);
    assert.equal(await page.inputValue("#aim"), "position");
    // An orientation that the arm cannot have: it arrives nevertheless, and no angle remains.
    await sendGoal(page, { x: 0.3, y: 0.35, z: 0.3, roll: 40, pitch: 20, yaw: 90 });
    await state(page, /^settled/);
    await shoot(page, { path: `${directory}/slides.png`, fullPage: true });
    const [left, turned] = (await frames(page)).now.error;
    assert.ok(left < 2e-3 && turned < 1e-6, `${left} m, ${turned} rad`);
    await page.click("#race-start");
    await page.waitForSelector("#player:not([hidden])");
    assert.deepEqual((await heads(page)).slice(-2), ["peak [rad/s, m/s]", "effort [rad²/s, m²/s]"]);
    await page.click("#back");
    await page.selectOption("#aim", "position_and_axis");
    await message(page, "task is position_and_axis");
    await state(page, /^holding/);
  },

  async keepOuts(browser) {
    const page = await open(browser);
    await page.waitForFunction(() => document.getElementById("scene").dataset.keepOuts === "3");
    await page.waitForTimeout(500);
    assert.equal(await page.textContent("#legend"), "keep-out");
    await shoot(page, { path: `${directory}/keep_outs.png` });
  },

  async demo(browser) {
    const page = await open(browser);
    await state(page, /^tracking/);
    await changed(page);
    await page.waitForTimeout(500);
    assert.ok((await changed(page)) > 500, "the arm is seen to move");
    say(await pictures(page));
    await state(page, /^settled/);
  },
};

// The most important parts fit on every screen without scrolling, and Stop is visible wherever the reader has scrolled.
async function fits(page) {
  const needed = ["picture", "home", "state", "stop", "pause", "resume", "goal"];
  for (const [width, height, more] of [[1440, 900, ["law", "first-curves"]], [1024, 600, ["law"]], [390, 844, []]]) {
    await page.setViewportSize({ width, height });
    await page.evaluate(() => {
      document.querySelectorAll("details").forEach((details) => (details.open = false));
      scrollTo(0, 0);
      document.getElementById("controls").scrollTo(0, 0);
    });
    await page.waitForTimeout(300);
    await page.screenshot({ path: `${directory}/screen-${width}.png` });
    const isWhole = async (id) => {
      const { x, y, width: wide, height: high } = await page.locator(`#${id}`).boundingBox();
      assert.ok(x >= 0 && y >= 0 && x + wide <= width && y + high <= height, `#${id} on ${width}×${height}: ${[x, y, wide, high]}`);
    };
    for (const id of [...needed, ...more]) await isWhole(id);
    // The bar of a phone covers nothing of the goal.
    const isOnTop = ([id]) => {
      const { left, bottom } = document.getElementById(id).getBoundingClientRect();
      return document.elementFromPoint(left + 10, bottom - 5).closest(`#${id}`) !== null;
    };
    assert.ok(await page.evaluate(isOnTop, ["send"]), `${width}: the goal is covered`);
    await unfold(page);
    await page.evaluate(() => {
      scrollTo(0, document.body.scrollHeight);
      document.getElementById("controls").scrollTo(0, 1e6);
    });
    await page.waitForTimeout(100);
    await isWhole("stop");
    assert.ok(await page.evaluate(isOnTop, ["stop"]), `${width}: Stop is covered`);
  }
}

// A goal that the servo refuses does not move the camera, its message goes, and one click brings a view back that the user has turned.
async function refuses(page) {
  const camera = () => page.evaluate(() => document.getElementById("scene").dataset.camera);
  const before = await camera();
  for (const [field, value] of Object.entries({ ...GOAL, x: 9 })) await page.fill(`#goal [name=${field}]`, `${value}`);
  await page.click("#send");
  await message(page, "the servo rejected the goal");
  await page.waitForTimeout(200);
  assert.equal(await camera(), before);
  const zoom = async () => JSON.parse(await camera()).zoom;
  await page.focus("#scene");
  for (const key of ["ArrowLeft", "ArrowUp", "+", "+"]) await page.keyboard.press(key);
  await page.waitForTimeout(300);
  assert.ok((await zoom()) > 1.2, await camera());
  await page.click("#home");
  await page.waitForTimeout(300);
  assert.equal(await zoom(), 1);
  await page.waitForFunction(() => document.getElementById("message").textContent === "");
}

// From press to release is one motion, however long the goal is held still.
async function holds(page) {
  const before = (await frames(page)).now.servo;
  const all = await handles(page);
  const longest = all.reduce((best, one, i) => (Math.hypot(...one.direction) > Math.hypot(...all[best].direction) ? i : best), 0);
  const { tip: [x, y], direction } = all[longest];
  const [dx, dy] = normed(direction, 40);
  await page.mouse.move(x, y);
  await page.mouse.down();
  await page.mouse.move(x + dx / 2, y + dy / 2);
  await page.waitForTimeout(2500);
  await page.mouse.move(x + dx, y + dy);
  await page.waitForTimeout(2500);
  await page.mouse.up();
  await message(page, "goal sent");
  await state(page, /^settled/);
  const { servo, words } = (await frames(page)).now;
  assert.equal(servo.goal_count, before.goal_count + 1, words);
  const [, seconds, metres] = /after ([\d.]+) s and ([\d.]+) m/.exec(words);
  assert.ok(seconds > 0.5 && metres > 0.01, words);
}

// From the top, because the head of the page stays where its reader has scrolled.
async function shoot(page, options) {
  await page.evaluate(() => scrollTo(0, 0));
  await page.screenshot(options);
}

// Measures how evenly frames come while the arm moves, and the share of a core that the page's main thread uses, independently of other
// processes.
async function pictures(page) {
  const client = await page.context().newCDPSession(page);
  await client.send("Performance.enable", { timeDomain: "threadTicks" });
  const used = async () => (await client.send("Performance.getMetrics")).metrics.find(({ name }) => name === "TaskDuration").value;
  const before = await used();
  const times = await page.evaluate(() => new Promise((resolve) => {
    const times = [];
    const next = (time) => (times.push(time), time - times[0] < 2000 ? requestAnimationFrame(next) : resolve(times));
    requestAnimationFrame(next);
  }));
  const busy = ((await used()) - before) / 2;
  const gaps = times.slice(1).map((time, i) => time - times[i]).sort((a, b) => a - b);
  const rate = (1000 * gaps.length) / (times.at(-1) - times[0]);
  const at = (part) => gaps[Math.floor(part * (gaps.length - 1))].toFixed(1);
  return `${rate.toFixed(1)} pictures a second, from one to the next ${at(0.5)} ms (99 %: ${at(0.99)}), ${(100 * busy).toFixed(0)} % of a core`;
}

// An older value that arrives after the user moved a slider or chose a law does not undo the change.
async function overtaken(page) {
  const id = "parameter-gains.double_geodesic[1]";
  const { robot } = await frames(page);
  const shown = () => page.evaluate(([id]) => [document.getElementById(id).value, document.getElementById("law").value], [id]);
  await page.evaluate(() => {
    const send = WebSocket.prototype.send;
    WebSocket.prototype.send = function (text) {
      (window.held ??= []).push(() => send.call(this, text));
      window.socket = this;
    };
    window.release = () => {
      WebSocket.prototype.send = send;
      window.held.forEach((send) => send());
    };
  });
  await page.fill(`[id='${id}']`, "3");
  await page.press(`[id='${id}']`, "Tab");
  await page.selectOption("#law", "logc");
  await page.evaluate((robot) => window.socket.onmessage({ data: JSON.stringify({ robot }) }), robot);
  assert.deepEqual(await shown(), ["3", "logc"]);
  // Two answers may arrive in any order within one frame of the page, which shows only the last.
  await page.evaluate(() => {
    const element = document.getElementById("message");
    window.told = [];
    new MutationObserver(() => window.told.push(element.textContent)).observe(element, { childList: true, characterData: true, subtree: true });
    window.release();
  });
  await page.waitForFunction(() => ["controller is logc", "gains.double_geodesic is [1.0, 3.0]"].every((text) => window.told.some((told) => told.includes(text))));
  await page.selectOption("#law", "double_geodesic");
  await message(page, "controller is double_geodesic");
  await page.waitForFunction(([id]) => document.getElementById(id)?.value === "3", [id]);
  await page.fill(`[id='${id}']`, "2.5");
  await page.press(`[id='${id}']`, "Enter");
  await message(page, "gains.double_geodesic is [1.0, 2.5]");
}

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

async function jogs(page) {
  const before = (await frames(page)).now.tool;
  await page.keyboard.down("r");
  await page.waitForTimeout(400);
  await page.keyboard.up("r");
  assert.ok(Math.abs((await frames(page)).now.tool[2] - before[2]) < 1e-3, "nothing moves while it is off");
  await page.click("#jog");
  await page.keyboard.down("r");
  await state(page, /^jogging/);
  await page.waitForTimeout(700);
  await page.keyboard.up("r");
  await state(page, /^holding/);
  const after = (await frames(page)).now.tool;
  assert.ok(after[2] - before[2] > 0.02 && Math.abs(after[0] - before[0]) < 0.02, `R moves it up: ${before} -> ${after}`);
  // Released under another key, or without an event, as on a Mac under Command.
  for (const other of ["Control", "Alt"]) {
    await page.keyboard.down("f");
    await state(page, /^jogging/);
    await page.keyboard.down(other);
    await page.waitForTimeout(1000);
    const stood = (await frames(page)).now.tool;
    await page.waitForTimeout(400);
    const stands = (await frames(page)).now.tool;
    assert.ok(Math.abs(stands[2] - stood[2]) < 1e-3, `${other} ends it: ${stood} -> ${stands}`);
    await page.keyboard.up("f");
    await page.keyboard.up(other);
  }
  await page.keyboard.down("f");
  await page.keyboard.up("f");
  await state(page, /^holding/);
  await page.click("#jog");
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

// Checks the rules of WCAG 2 that a program can check.
async function isAccessible(page, look) {
  await page.evaluate(require("axe-core").source);
  const { violations } = await page.evaluate(() => window.axe.run());
  assert.deepEqual(violations.map(({ id, nodes }) => `${id}: ${nodes.map((node) => node.html).join(" ")}`), [], look);
}

async function byKeyboard(page) {
  await page.evaluate(() => {
    document.activeElement.blur();
    document.querySelectorAll("details:not(#race-details, #recording)").forEach((details) => (details.open = false));
  });
  const reached = [];
  for (let i = 0; i < 36; i++) {
    await page.keyboard.press("Tab");
    reached.push(await page.evaluate(() => document.activeElement.id || document.activeElement.name));
  }
  for (const id of ["scene", "stop", "pause", "x", "yaw", "send", "law", "race-start", "record"]) assert.ok(reached.includes(id), `${id} among ${reached}`);
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

// Without its own sandbox: in the tests it runs as root in its own network namespace.
const browser = await chromium.launch({ executablePath: "/usr/bin/chromium", args: ["--no-sandbox", ...(name === "lines" ? ["--disable-3d-apis"] : [])] });
try {
  await cases[name](browser);
  assert.deepEqual(faults, [], "the console is empty");
} finally {
  await browser.close();
}
say("done");
