// A run: what an arm did, sample by sample. Times in seconds, lengths in metres, base frame.

import { unit } from "./space.js";

// What is farther apart in time is not connected.
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

  // How many samples there are up to that time.
  count(time) {
    let [low, high] = [0, this.samples.length];
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.samples[middle].time <= time) low = middle + 1;
      else high = middle;
    }
    return low;
  }

  // How it was at that time, before its start as it began; null where there is nothing of it.
  at(time) {
    const count = this.count(time);
    const [last, next] = [this.samples[Math.max(0, count - 1)], this.samples[count]];
    if (!last?.links || !count || !next?.links || next.time - last.time > GAP || last.links.length !== next.links.length) return last ?? null;
    const part = (time - last.time) / (next.time - last.time);
    const links = between(last.links, next.links, part);
    return { ...last, links, tool: last.tool && next.tool ? this.turned(last.tool, next.tool, part) : last.tool };
  }

  // Between two poses; q and -q are one orientation.
  turned(a, b, part) {
    const sign = [3, 4, 5, 6].reduce((sum, i) => sum + a[i] * b[i], 0) < 0 ? -1 : 1;
    const other = b.slice(3).map((value) => sign * value);
    return [...between(a.slice(0, 3), b.slice(0, 3), part), ...unit(between(a.slice(3), other, part))];
  }

  // What was in force at that time, of a list of changes [time, to].
  of(changes, time) {
    return changes.findLast(([since]) => since <= time)?.[1] ?? changes[0]?.[1] ?? "";
  }

  law(time) {
    return this.of(this.laws, time);
  }

  state(time) {
    return this.of(this.states, time);
  }

  // Its way in pieces of one law each, with the time of each place.
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
