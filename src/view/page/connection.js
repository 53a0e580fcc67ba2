// The connection to the program. It reconnects automatically.

const LONGEST_SILENCE = 3000;

// Asks whether this browser is no longer authorized. Browsers do not report why a WebSocket was refused.
const isUnauthorized = () => fetch("/", { signal: AbortSignal.timeout(LONGEST_SILENCE) }).then(({ status }) => status === 403, () => false);

export class Connection {
  // `on` has a function for each kind of message (hello, robot, arm_shape, markers, now, race, run) and lost(reason, forGood).
  constructor(on) {
    this.on = on;
    this.waiting = new Map();
    this.next = 1;
    this.delay = 250;
    setInterval(() => this.watch(), 500);
    this.open();
  }

  open() {
    this.socket = new WebSocket(`ws://${location.host}/session`);
    this.heard = performance.now();
    this.socket.onmessage = (event) => this.hear(JSON.parse(event.data));
    this.socket.onclose = (event) => this.close(event);
  }

  hear(frame) {
    this.heard = performance.now();
    this.delay = 250;
    if (frame.answer) {
      if (frame.answer.id === null) this.on.news(frame.answer);
      else this.settle(frame.answer.id, frame.answer);
      return;
    }
    for (const kind of ["hello", "robot", "arm_shape", "markers", "now", "race", "run"]) {
      if (frame[kind]) this.on[kind](frame[kind]);
    }
  }

  // The program sends something at least twice a second. After a long silence the connection is treated as dead.
  watch() {
    if (this.socket && performance.now() - this.heard > LONGEST_SILENCE) {
      const dead = this.socket;
      dead.onclose = dead.onmessage = null;
      dead.close();
      this.close({ reason: `no answer for ${LONGEST_SILENCE / 1000} s` });
    }
  }

  async close({ reason }) {
    this.socket = null;
    for (const id of [...this.waiting.keys()]) this.settle(id, { ok: false, text: "the connection was lost before an answer came" });
    this.on.lost(reason, false);
    if (await isUnauthorized()) {
      this.on.lost("the program that serves this page was started again: open the link that it printed", true);
      return;
    }
    setTimeout(() => this.open(), this.delay);
    this.delay = Math.min(2000, 2 * this.delay);
  }

  settle(id, answer) {
    this.waiting.get(id)?.(answer);
    this.waiting.delete(id);
  }

  // Resolves to the answer: whether the request succeeded, and a text.
  ask(ask) {
    if (this.socket?.readyState !== WebSocket.OPEN) return Promise.resolve({ ok: false, text: "there is no connection" });
    const id = this.next++;
    this.socket.send(JSON.stringify({ id, ask }));
    return new Promise((resolve) => this.waiting.set(id, resolve));
  }
}
