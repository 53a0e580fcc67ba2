// Curves over time: the last seconds of live data, or complete runs that are being played.

const WINDOW = 20;
const MOST = 1200;
// Height below the curves for the time labels [px].
const FOOT = 17;

const color = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

// The smallest number of the form 1, 2 or 5 times a power of ten that is at least `least`.
function roundStep(least) {
  const power = 10 ** Math.floor(Math.log10(least || 1));
  return power * [1, 2, 5, 10].find((digit) => digit * power >= least * (1 - 1e-9));
}

// The smallest number that is at least `least`, and whose half is as short.
function roundTop(least) {
  const power = 10 ** Math.floor(Math.log10(least));
  return power * [1, 1.2, 1.6, 2, 2.4, 3, 4, 5, 6, 8, 10].find((digits) => digits * power >= least * (1 - 1e-9));
}

// A chart of several curves with one axis. Each of the `series` has a name, the custom property of its colour, and whether it is dashed.
// `log` selects a logarithmic axis, which begins at `floor` at the lowest. The axis fits the shown values, and ends at `top` or above.
// `mark` names a horizontal line at the height `level`. `digits` fixes the number of decimals.
export class Chart {
  constructor(parent, { title, unit, series, log, floor, top, mark, digits }) {
    Object.assign(this, { title, unit, series, log, floor, top, mark, digits, level: null });
    // Values below these (one for each series) are shown as no value.
    this.least = [];
    // For runs that are played: their time range, and the current time.
    this.window = null;
    this.cursor = null;
    const figure = document.createElement("figure");
    const caption = document.createElement("figcaption");
    const name = document.createElement("b");
    name.textContent = `${title} [${unit}]`;
    caption.append(name);
    this.legend = document.createElement("span");
    caption.append(this.legend);
    this.setSeries(series);
    this.canvas = document.createElement("canvas");
    this.canvas.setAttribute("role", "img");
    this.canvas.setAttribute("aria-label", `${title} over time`);
    figure.append(caption, this.canvas);
    parent.append(figure);
  }

  setSeries(series) {
    this.series = series.map((one) => ({ ...one, samples: [] }));
    const entries = this.series.map((one) => {
      const entry = document.createElement("span");
      const swatch = document.createElement("i");
      swatch.style.setProperty("--swatch", `var(${one.color})`);
      swatch.classList.toggle("dashed", Boolean(one.dashed));
      entry.append(swatch, `${one.name} `, document.createElement("output"));
      return entry;
    });
    this.legend.replaceChildren(...entries);
    this.values = entries.map((entry) => entry.querySelector("output"));
  }

  // Adds live data: one value for each series.
  add(time, values) {
    this.series.forEach(({ samples }, i) => {
      // The program was restarted, so its clock started again.
      if (samples.length && time < samples.at(-1)[0]) samples.length = 0;
      samples.push([time, values[i]]);
      if (samples.length > MOST) samples.splice(0, samples.length - MOST);
    });
  }

  // Adds one sample of a run to its series.
  push(series, time, value) {
    this.series[series].samples.push([time, value]);
  }

  text(value) {
    if (value === null || value === undefined || !Number.isFinite(value)) return "–";
    if (this.digits !== undefined) return value.toFixed(this.digits);
    if (value !== 0 && Math.abs(value) < 0.01) return value.toExponential(0);
    return Math.abs(value) >= 100 ? value.toFixed(0) : value.toPrecision(2);
  }

  // The ends of the axis: round numbers that fit the values that are shown.
  bounds() {
    const [from] = this.span();
    let [low, high] = this.level ? [this.level, this.level] : [Infinity, 0];
    for (const { samples } of this.series) {
      for (const [time, value] of samples) {
        if (time < from || value === null || !Number.isFinite(value)) continue;
        if (value > high) high = value;
        if (value < low) low = value;
      }
    }
    high = Math.max(high, this.top);
    if (!this.log) return [0, roundTop(high)];
    const bottom = Math.floor(Math.log10(Math.max(Math.min(low, high), this.floor)) + 1e-9);
    return [bottom, Math.max(bottom + 1, Math.ceil(Math.log10(high) - 1e-9))];
  }

  span() {
    if (this.window) return this.window;
    const end = Math.max(0, ...this.series.map(({ samples }) => samples.at(-1)?.[0] ?? 0));
    return [end - WINDOW, end];
  }

  draw() {
    const ratio = Math.min(2, devicePixelRatio);
    const [width, height] = [this.canvas.clientWidth, this.canvas.clientHeight];
    // The chart is hidden.
    if (!width) return;
    if (this.canvas.width !== Math.round(width * ratio) || this.canvas.height !== Math.round(height * ratio)) {
      this.canvas.width = Math.round(width * ratio);
      this.canvas.height = Math.round(height * ratio);
    }
    const sheet = this.canvas.getContext("2d");
    sheet.setTransform(ratio, 0, 0, ratio, 0, 0);
    sheet.clearRect(0, 0, width, height);
    const bottom = height - FOOT;
    const [low, high] = this.bounds();
    const [from, to] = this.span();
    const left = 38;
    const x = (time) => left + ((width - left - 4) * (time - from)) / (to - from || 1);
    const height01 = (value) => ((this.log ? Math.log10(Math.max(value, 1e-12)) : value) - low) / (high - low);
    const y = (value) => Math.min(bottom - 2, bottom - 2 - (bottom - 8) * height01(value));
    this.grid(sheet, width, left, low, high, y);
    this.times(sheet, bottom, from, to, x);
    this.series.forEach((one, i) => {
      this.curve(sheet, one, from, x, y);
      const value = this.valueOf(one);
      this.values[i].textContent = value < this.least[i] ? "0.00" : this.text(value);
    });
    if (this.level) this.line(sheet, width, left, y(this.level));
    if (this.cursor !== null) this.upright(sheet, bottom, x(this.cursor), color("--ink"));
  }

  curve(sheet, { color: name, dashed, samples }, from, x, y) {
    sheet.strokeStyle = color(name);
    sheet.lineWidth = 1.6;
    sheet.setLineDash(dashed ? [6, 4] : []);
    sheet.beginPath();
    let drawing = false;
    for (const [time, value] of samples) {
      if (time < from || value === null || !Number.isFinite(value)) {
        drawing = false;
        continue;
      }
      if (drawing) sheet.lineTo(x(time), y(value));
      else sheet.moveTo(x(time), y(value));
      drawing = true;
    }
    sheet.stroke();
    sheet.setLineDash([]);
  }

  // The value at the cursor, or the last value.
  valueOf({ samples }) {
    if (this.cursor === null) return samples.at(-1)?.[1];
    let [low, high] = [0, samples.length];
    while (low < high) {
      const middle = (low + high) >> 1;
      if (samples[middle][0] <= this.cursor) low = middle + 1;
      else high = middle;
    }
    return samples[low - 1]?.[1];
  }

  upright(sheet, bottom, place, look) {
    sheet.strokeStyle = look;
    sheet.lineWidth = 1;
    sheet.beginPath();
    sheet.moveTo(place, 0);
    sheet.lineTo(place, bottom);
    sheet.stroke();
  }

  // Time labels below the curves: since the goal for runs, before now for live data.
  times(sheet, bottom, from, to, x) {
    const origin = this.window ? 0 : to;
    const step = roundStep((to - from) / 4);
    sheet.textBaseline = "top";
    for (let i = Math.ceil((from - origin) / step - 1e-6); i * step <= to - origin + 1e-6; i++) {
      const time = i * step;
      const place = Math.round(x(origin + time)) + 0.5;
      this.upright(sheet, bottom, place, color("--faint"));
      // The last label stays inside the chart.
      sheet.textAlign = i * step > to - origin - step / 4 ? "right" : "center";
      sheet.fillStyle = color("--soft");
      sheet.fillText(this.window || i ? `${+time.toPrecision(3)} s`.replace("-", "−") : "now", place, bottom + 4);
    }
  }

  grid(sheet, width, left, low, high, y) {
    sheet.font = "11px system-ui, sans-serif";
    sheet.textAlign = "right";
    sheet.textBaseline = "middle";
    sheet.lineWidth = 1;
    const step = this.log ? Math.max(1, Math.ceil((high - low) / 4)) : (high - low) / 2;
    for (let at = low; at <= high + 1e-9; at += step) {
      const value = this.log ? 10 ** at : at;
      const place = Math.round(y(value)) + 0.5;
      sheet.strokeStyle = color("--faint");
      sheet.beginPath();
      sheet.moveTo(left, place);
      sheet.lineTo(width, place);
      sheet.stroke();
      sheet.fillStyle = color("--soft");
      const label = value === 0 ? "0" : value >= 1e4 || value < 1e-2 ? value.toExponential(0) : `${+value.toPrecision(2)}`;
      sheet.fillText(label, left - 5, Math.max(8, Math.min(place, sheet.canvas.clientHeight - FOOT - 4)));
    }
  }

  line(sheet, width, left, place) {
    sheet.strokeStyle = color("--soft");
    sheet.lineWidth = 1;
    sheet.setLineDash([5, 4]);
    sheet.beginPath();
    sheet.moveTo(left, place);
    sheet.lineTo(width, place);
    sheet.stroke();
    sheet.setLineDash([]);
    sheet.textAlign = "left";
    sheet.textBaseline = "bottom";
    // The label has an outline in the background colour, to be legible over curves and grid.
    sheet.lineWidth = 4;
    sheet.strokeStyle = color("--paper");
    sheet.strokeText(this.mark, left + 4, place - 2);
    sheet.fillStyle = color("--soft");
    sheet.fillText(this.mark, left + 4, place - 2);
  }
}
