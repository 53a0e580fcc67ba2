// The goal as the user edits it, and its form.

import { fromRollPitchYaw, toRollPitchYaw, unit } from "./space.js";

const FIELDS = ["x", "y", "z", "roll", "pitch", "yaw"];
// A goal that was sent is shown for this long until the servo reports it [ms].
const TAKEN_WITHIN = 2000;

// A goal: [x, y, z, qx, qy, qz, qw]. The goal that the user edits has priority over the servo's goal.
export class Goal {
  // `form` has the fields. `edited()` is called when the user types, `send(pose)` when the form is submitted.
  constructor(form, { edited, send }) {
    this.form = form;
    this.draft = null;
    this.sentAt = 0;
    form.addEventListener("input", () => {
      const pose = this.typed();
      if (pose) this.edit(pose);
      edited();
    });
    form.addEventListener("submit", (event) => {
      event.preventDefault();
      const pose = this.typed();
      if (pose) send(pose);
    });
  }

  edit(pose) {
    this.draft = pose;
    this.sentAt = 0;
    this.fill(pose);
  }

  sent(pose) {
    this.draft = pose;
    this.sentAt = performance.now();
  }

  // Forgets what the user has edited.
  drop() {
    this.draft = null;
    this.sentAt = 0;
  }

  // The goal to show, given the servo's goal (or null). Returns null if there is none.
  shown(taken) {
    const isOld = this.sentAt && performance.now() - this.sentAt > TAKEN_WITHIN;
    const isTaken = this.sentAt && taken?.every((part, i) => Math.abs(part - this.draft[i]) < 1e-6);
    if (isOld || isTaken) this.drop();
    return this.draft ?? taken;
  }

  // Writes the pose into the fields, unless the user is typing in them.
  fill(pose) {
    if (!pose || (this.form.contains(document.activeElement) && document.activeElement.matches("input"))) return;
    const values = [...pose.slice(0, 3).map((part) => part.toFixed(4)), ...toRollPitchYaw(pose.slice(3)).map((angle) => angle.toFixed(2))];
    FIELDS.forEach((field, i) => {
      const value = `${+values[i] || 0}`;
      if (this.form.elements[field].value !== value) this.form.elements[field].value = value;
    });
  }

  typed() {
    const numbers = FIELDS.map((field) => this.form.elements[field].valueAsNumber);
    return numbers.every(Number.isFinite) ? [...numbers.slice(0, 3), ...unit(fromRollPitchYaw(numbers.slice(3)))] : null;
  }
}
