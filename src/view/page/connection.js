// The connection to the program: comes back by itself.

const LONGEST_SILENCE = 3000;
const NOT_ALLOWED = 1008;

export class Connection {
  // `on` has a function for each kind of frame: hello, robot, now, race, run; and lost(reason, forGood).
  constructor(on) {
    this.on = on;
    this.waiting = new Map();
    this.next = 1;
    this.delay = 250;
    addEventListener("hashchange", () => location.reload());
    setInterval(() => this.watch(), 500);
    this.open();
  }

  open() {
    const token = new URLSearchParams(location.hash.slice(1)).get("token");
    const query = token ? `?token=${encodeURIComponent(token)}` : "";
    this.socket = new WebSocket(`ws://${location.host}/session${query}`);
    this.heard = performance.now();
    this.socket.onmessage = (event) => this.hear(JSON.parse(event.data));
    this.socket.onclose = (event) => this.close(event);
  }

  hear(frame) {
    this.heard = performance.now();
    this.delay = 250;
    if (frame.answer) {
      this.settle(frame.answer.id, frame.answer);
      return;
    }
    for (const kind of ["hello", "robot", "now", "race", "run"]) {
      if (frame[kind]) this.on[kind](frame[kind]);
    }
  }

  // The program shows something at least twice a second: after a long silence the connection is dead, whatever it says.
  watch() {
    if (this.socket && performance.now() - this.heard > LONGEST_SILENCE) {
      const dead = this.socket;
      dead.onclose = dead.onmessage = null;
      dead.close();
      this.close({ code: 0, reason: "" });
    }
  }

  close({ code, reason }) {
    this.socket = null;
    for (const id of [...this.waiting.keys()]) this.settle(id, { ok: false, text: "the connection was lost before an answer came" });
    const forGood = code === NOT_ALLOWED;
    this.on.lost(reason, forGood);
    if (forGood) return;
    setTimeout(() => this.open(), this.delay);
    this.delay = Math.min(2000, 2 * this.delay);
  }

  settle(id, answer) {
    this.waiting.get(id)?.(answer);
    this.waiting.delete(id);
  }

  // Resolves to the answer: whether it was done, and a text.
  ask(ask) {
    if (this.socket?.readyState !== WebSocket.OPEN) return Promise.resolve({ ok: false, text: "there is no connection" });
    const id = this.next++;
    this.socket.send(JSON.stringify({ id, ask }));
    return new Promise((resolve) => this.waiting.set(id, resolve));
  }
}
