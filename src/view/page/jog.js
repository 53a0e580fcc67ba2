// Jogging: the tool moves while keys are held.

// Maps each key to a component of the twist (x, y, z, then about x, y, z) and its direction.
const KEYS = { w: [0, 1], s: [0, -1], a: [1, 1], d: [1, -1], r: [2, 1], f: [2, -1], u: [3, 1], j: [3, -1], i: [4, 1], k: [4, -1], o: [5, 1], l: [5, -1] };
// A twist expires after the servo's twist_timeout, so a new one is sent at this interval [ms].
const REPEAT = 40;
// The largest number of unanswered twists. On a slow connection, twists queue up: with more of them the arm would continue to move after
// the key is released.
const UNANSWERED = 3;
// The angular speed [rad/s] for a linear speed of 1 m/s.
const TURN = 5;

export class Jog {
  // `button` switches jogging on, and `speed` has the speed [m/s]. `send(linear, angular)` sends a twist and resolves when it is answered.
  constructor(button, speed, send) {
    Object.assign(this, { button, speed, send, on: false, held: new Set(), timer: null, unanswered: 0 });
    button.addEventListener("click", () => this.set(!this.on));
    addEventListener("keydown", (event) => this.key(event, true));
    addEventListener("keyup", (event) => this.key(event, false));
    // The page gets no event for keys that are released while another window has the focus.
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
    // With one of these modifiers the key belongs to a shortcut, and its keyup event may be missing: macOS sends none while Command is
    // held.
    if (isDown && (event.ctrlKey || event.metaKey || event.altKey)) {
      this.release();
      return;
    }
    if (!this.on || !KEYS[key]) return;
    // Typing in a field does not jog.
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

  // A zero twist is sent once. After that, the missing twists also mean rest.
  release() {
    this.held.clear();
    if (!this.timer) return;
    clearInterval(this.timer);
    this.timer = null;
    this.move();
  }

  async move() {
    // A zero twist is always sent.
    if (this.held.size && this.unanswered >= UNANSWERED) return;
    const twist = [0, 0, 0, 0, 0, 0];
    for (const key of this.held) twist[KEYS[key][0]] += KEYS[key][1] * +this.speed.value;
    this.unanswered++;
    await this.send(twist.slice(0, 3), twist.slice(3).map((part) => TURN * part));
    this.unanswered--;
  }
}
