// Takes pictures of the page of a demo: `pictures.mjs NAME [ARGUMENT…]` runs `demo --view ARGUMENT…`; without a name, takes frames of a
// demo in a terminal.

import { spawn } from "node:child_process";
import { mkdir, rm } from "node:fs/promises";
import { createRequire } from "node:module";
import { resolve } from "node:path";

const { FOLDER, MODULES, PROGRAM } = process.env;
const { chromium } = createRequire(resolve(MODULES, "package.json"))("playwright-core");
const [name, ...args] = process.argv.slice(2);

const SCREENS = {
  desktop: { viewport: { width: 1440, height: 900 } },
  laptop: { viewport: { width: 1024, height: 600 } },
  dark: { viewport: { width: 1440, height: 900 }, colorScheme: "dark" },
  phone: { viewport: { width: 390, height: 844 }, isMobile: true, hasTouch: true },
};

// Starts the program and waits for its link.
async function started(program, args) {
  const child = spawn(program, args, { stdio: ["pipe", "pipe", "inherit"] });
  const link = await new Promise((done, failed) => {
    let said = "";
    child.stdout.on("data", (text) => {
      said += text;
      const found = /http:\S+/.exec(said);
      if (found) done(found[0]);
    });
    child.on("exit", () => failed(new Error(`${program} ${args.join(" ")} has ended: ${said}`)));
  });
  child.ended = new Promise((done) => child.on("exit", done));
  return { child, link };
}

const launch = () => chromium.launch({ executablePath: "/usr/bin/chromium", args: ["--no-sandbox", "--disable-quic", "--disable-background-networking"] });

async function screenshots() {
  const { child, link } = await started(PROGRAM, ["demo", "--view", ...args]);
  const browser = await launch();
  for (const [screen, options] of Object.entries(SCREENS)) {
    const page = await browser.newPage(options);
    await page.goto(link);
    await page.waitForTimeout(4000);
    await page.screenshot({ path: `${FOLDER}/${name}_${screen}.png` });
    await page.close();
  }
  await browser.close();
  child.kill("SIGINT");
  await child.ended;
}

// Takes frames until the demo has printed its table. Each is named by its time [ms].
async function frames() {
  const folder = `${FOLDER}/frames`;
  await rm(folder, { recursive: true, force: true });
  await mkdir(folder, { recursive: true });
  const { child, link } = await started("script", ["--quiet", "--flush", "--return", "--command", `${PROGRAM} demo`, "/dev/null"]);
  let over = false;
  child.stdout.on("data", (text) => (over ||= String(text).includes("woke late")));
  const browser = await launch();
  const page = await browser.newPage({ viewport: { width: 1120, height: 630 } });
  await page.goto(link);
  const began = Date.now();
  while (!over) {
    const at = Date.now() - began;
    await page.screenshot({ path: `${folder}/${String(at).padStart(6, "0")}.png` });
  }
  await browser.close();
  child.stdin.write("\x03");
  await child.ended;
}

await (name ? screenshots() : frames());
