// Tests the keys of the page over a slow link, without a browser: `node jog.mjs DIRECTORY_OF_THE_PAGE`.

import assert from "node:assert/strict";

const heard = new Map();
let tick = null;
Object.assign(globalThis, {
  addEventListener: (kind, listener) => heard.set(kind, listener),
  document: { addEventListener() {} },
  setInterval: (listener) => (tick = listener),
  clearInterval: () => (tick = null),
});
const { Jog } = await import(`${process.argv[2]}/jog.js`);

const sent = [];
let answers = [];
const button = { addEventListener() {}, setAttribute() {} };
const jog = new Jog(button, { value: "0.1" }, (linear, angular) => {
  sent.push([...linear, ...angular].map((part) => part + 0));
  return new Promise((resolve) => answers.push(resolve));
});
jog.set(true);
const press = (kind) => heard.get(kind)({ key: "w", target: {}, preventDefault() {} });
const answered = async (count) => {
  for (const resolve of answers.splice(0, count)) resolve();
  await new Promise((resolve) => setImmediate(resolve));
};
const rest = [0, 0, 0, 0, 0, 0];

// The first second has no answers.
press("keydown");
for (let i = 0; i < 25; i++) tick();
assert.deepEqual(sent, Array(3).fill([0.1, 0, 0, 0, 0, 0]));
// The stop is sent immediately nevertheless, as the last message.
press("keyup");
assert.deepEqual(sent.slice(3), [rest]);
assert.equal(tick, null);

// Pressing again meanwhile sends nothing more.
press("keydown");
assert.equal(sent.length, 4);
press("keyup");
assert.deepEqual(sent.slice(4), [rest]);

// After the answers, the next twists are sent.
await answered(5);
press("keydown");
tick();
await answered(2);
for (let i = 0; i < 25; i++) tick();
assert.deepEqual(sent.slice(5), Array(5).fill([0.1, 0, 0, 0, 0, 0]));
