// Jogging: as long as keys are held, the tool moves.

// Key to component of the twist and its direction: x, y, z, then about x, y, z.
const KEYS = { w: [0, 1], s: [0, -1], a: [1, 1], d: [1, -1], r: [2, 1], f: [2, -1], u: [3, 1], j: [3, -1], i: [4, 1], k: [4, -1], o: [5, 1], l: [5, -1] };
// A twist that is older than the servo's twist_timeout is stale: it gets a new one this often [ms].
const REPEAT = 40;
// Over a slow link, twists wait behind each other: with more than these on the way, the arm would move on after its key is released.
const UNANSWERED = 3;
// The angular speed [rad/s] that goes with a speed of 1 m/s.
const TURN = 5;

export class Jog {
  // `button` switches it on, `speed` has the speed [m/s]; `send(linear, angular)` sends a twist, and resolves when that is answered.
  constructor(button, speed, send) {
    Object.assign(this, { button, speed, send, on: false, held: new Set(), timer: null, unanswered: 0 });
    button.addEventListener("click", () => this.set(!this.on));
    addEventListener("keydown", (event) => this.key(event, true));
    addEventListener("keyup", (event) => this.key(event, false));
    // Keys that are let go elsewhere are not heard of.
    addEventListener("blur", () => this.release());
    document.addEventListener("visibilitychange", () => this.release());
  }

  set(on) {
    this.on = on;
    this.button.setAttribute("aria-pressed", on);
    if (!on) this.release();
  }

  key(event, isDown) {
    const key = event.key.toLowerCase();
    // With one of these a key is another's, and its end may not be heard: Macs report none under Command.
    if (isDown && (event.ctrlKey || event.metaKey || event.altKey)) {
      this.release();
      return;
    }
    if (!this.on || !KEYS[key]) return;
    // Whoever types, types.
    if (isDown && event.target.matches?.("input:not([type=range]), select, textarea")) return;
    event.preventDefault();
    if (isDown === this.held.has(key)) return;
    if (isDown) this.held.add(key);
    else this.held.delete(key);
    if (!this.held.size) this.release();
    else if (!this.timer) {
      this.timer = setInterval(() => this.move(), REPEAT);
      this.move();
    }
  }

  // Rest: said once, and silence after it says so too.
  release() {
    this.held.clear();
    if (!this.timer) return;
    clearInterval(this.timer);
    this.timer = null;
    this.move();
  }

  async move() {
    // Rest is always said.
    if (this.held.size && this.unanswered >= UNANSWERED) return;
    const twist = [0, 0, 0, 0, 0, 0];
    for (const key of this.held) twist[KEYS[key][0]] += KEYS[key][1] * +this.speed.value;
    this.unanswered++;
    await this.send(twist.slice(0, 3), twist.slice(3).map((part) => TURN * part));
    this.unanswered--;
  }
}
