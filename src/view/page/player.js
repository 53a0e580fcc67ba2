// Plays a recording: a button, a timeline and a speed.

export class Player {
  // `root` has the buttons and fields. `show(time)` shows the given time.
  constructor(root, show) {
    Object.assign(this, { root, show, time: 0, start: 0, end: 0, playing: false, following: false });
    const find = (name) => root.querySelector(`[name=${name}]`);
    Object.assign(this, { button: find("play"), line: find("time"), speed: find("speed"), clock: root.querySelector("output") });
    this.button.addEventListener("click", () => (this.playing ? this.pause() : this.play()));
    this.line.addEventListener("input", () => {
      this.following = false;
      this.pause();
      this.go(+this.line.value);
    });
  }

  // Sets the range from start to end. If `following`, the recording continues to grow and its newest time is shown.
  span(start, end, following = false) {
    Object.assign(this, { start, end, following });
    Object.assign(this.line, { min: start, max: Math.max(end, start + 0.01), step: 0.01 });
    if (following) this.go(end);
  }

  play() {
    if (this.playing) return;
    this.following = false;
    if (this.time >= this.end - 0.01) this.go(this.start);
    this.playing = true;
    this.label();
    let last = performance.now();
    const frame = (now) => {
      if (!this.playing) return;
      this.go(this.time + ((now - last) / 1000) * +this.speed.value);
      last = now;
      if (this.time >= this.end) this.pause();
      else requestAnimationFrame(frame);
    };
    requestAnimationFrame(frame);
  }

  pause() {
    this.playing = false;
    this.label();
  }

  label() {
    this.button.textContent = this.playing ? "Pause" : "Play";
  }

  go(time) {
    this.time = Math.max(this.start, Math.min(this.end, time));
    this.line.value = this.time;
    this.line.setAttribute("aria-valuetext", `${this.time.toFixed(1)} seconds`);
    this.clock.textContent = `${this.time.toFixed(2)} s of ${this.end.toFixed(2)} s`;
    this.show(this.time);
  }
}
