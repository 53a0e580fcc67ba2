// A run: the samples of one arm's motion. Times are in seconds, lengths in metres, in the base frame.

import { unit } from "./space.js";

// Samples that are farther apart in time are not connected.
const GAP = 0.5;

const between = (a, b, part) => a.map((value, i) => (Array.isArray(value) ? between(value, b[i], part) : value + part * (b[i] - value)));

export class Run {
  constructor({ name, joints, units, reach, threshold, laws, states = [], motions = [], samples = [] }) {
    Object.assign(this, { name, joints, units, reach, threshold, laws, states, motions, samples });
  }

  get start() {
    return this.samples[0]?.time ?? 0;
  }

  get end() {
    return this.samples.at(-1)?.time ?? 0;
  }

  // The number of samples up to the given time.
  count(time) {
    let [low, high] = [0, this.samples.length];
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.samples[middle].time <= time) low = middle + 1;
      else high = middle;
    }
    return low;
  }

  // The state at the given time, interpolated between samples, or the first sample before the start. Null if there is no sample.
  at(time) {
    const count = this.count(time);
    const [last, next] = [this.samples[Math.max(0, count - 1)], this.samples[count]];
    if (!last?.links || !count || !next?.links || next.time - last.time > GAP || last.links.length !== next.links.length) return last ?? null;
    const part = (time - last.time) / (next.time - last.time);
    const links = between(last.links, next.links, part);
    return { ...last, links, tool: last.tool && next.tool ? this.turned(last.tool, next.tool, part) : last.tool };
  }

  // Interpolates between two poses; q and -q are the same orientation.
  turned(a, b, part) {
    const sign = [3, 4, 5, 6].reduce((sum, i) => sum + a[i] * b[i], 0) < 0 ? -1 : 1;
    const other = b.slice(3).map((value) => sign * value);
    return [...between(a.slice(0, 3), b.slice(0, 3), part), ...unit(between(a.slice(3), other, part))];
  }

  // The value that was active at the given time, from a list of changes [time, to].
  of(changes, time) {
    return changes.findLast(([since]) => since <= time)?.[1] ?? changes[0]?.[1] ?? "";
  }

  law(time) {
    return this.of(this.laws, time);
  }

  state(time) {
    return this.of(this.states, time);
  }

  // The path in pieces with one law each, and with the time of each point.
  ways() {
    if (this.known?.count === this.samples.length) return this.known.ways;
    const ways = [];
    let last = null;
    for (const { time, tool } of this.samples) {
      if (!tool) continue;
      const law = this.law(time);
      const point = { time, place: tool.slice(0, 3) };
      const isNear = last && time - last.time < GAP;
      if (!isNear || ways.at(-1).law !== law) ways.push({ law, points: isNear ? [last, point] : [point] });
      else ways.at(-1).points.push(point);
      last = point;
    }
    this.known = { count: this.samples.length, ways };
    return ways;
  }
}
