// Live curves over the last seconds.

const WINDOW = 20;
const MOST = 1200;

const color = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

// A chart of several curves over one axis.
// `series`: name and the custom property of the colour, each; `log`: powers of ten; `mark`: the name of a line at a height; `digits` after
// the point, where their number is fixed.
export class Chart {
  constructor(parent, { title, unit, series, log, range, mark, digits }) {
    Object.assign(this, { title, unit, series, log, range, mark, digits, level: null });
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
    this.series = series;
    this.samples = [];
    const entries = series.map((one) => {
      const entry = document.createElement("span");
      const swatch = document.createElement("i");
      swatch.style.background = `var(${one.color})`;
      entry.append(swatch, `${one.name} `, document.createElement("output"));
      return entry;
    });
    this.legend.replaceChildren(...entries);
    this.values = entries.map((entry) => entry.querySelector("output"));
  }

  add(time, values) {
    const last = this.samples.at(-1);
    // The program was started again: its clock begins anew.
    if (last && time < last.time) this.samples = [];
    this.samples.push({ time, values });
    if (this.samples.length > MOST) this.samples.splice(0, this.samples.length - MOST);
  }

  text(value) {
    if (value === null || value === undefined || !Number.isFinite(value)) return "–";
    if (this.digits !== undefined) return value.toFixed(this.digits);
    if (value !== 0 && Math.abs(value) < 0.01) return value.toExponential(0);
    return Math.abs(value) >= 100 ? value.toFixed(0) : value.toPrecision(2);
  }

  bounds() {
    let [low, high] = this.range;
    for (const { values } of this.samples) {
      for (const value of values) if (Number.isFinite(value) && value > high) high = value;
    }
    return this.log ? [Math.log10(low), Math.ceil(Math.log10(high) - 1e-9)] : [low, high];
  }

  draw() {
    const ratio = Math.min(2, devicePixelRatio);
    const [width, height] = [this.canvas.clientWidth, this.canvas.clientHeight];
    if (this.canvas.width !== Math.round(width * ratio) || this.canvas.height !== Math.round(height * ratio)) {
      this.canvas.width = Math.round(width * ratio);
      this.canvas.height = Math.round(height * ratio);
    }
    const sheet = this.canvas.getContext("2d");
    sheet.setTransform(ratio, 0, 0, ratio, 0, 0);
    sheet.clearRect(0, 0, width, height);
    const [low, high] = this.bounds();
    const left = 38;
    const end = this.samples.at(-1)?.time ?? 0;
    const x = (time) => left + ((width - left - 4) * (time - end + WINDOW)) / WINDOW;
    const height01 = (value) => ((this.log ? Math.log10(Math.max(value, 1e-12)) : value) - low) / (high - low);
    const y = (value) => Math.min(height - 6, height - 6 - (height - 12) * height01(value));
    this.grid(sheet, width, left, low, high, y);
    if (this.level) this.line(sheet, width, left, y(this.level));
    this.series.forEach((one, i) => {
      sheet.strokeStyle = color(one.color);
      sheet.lineWidth = 1.6;
      sheet.beginPath();
      let drawing = false;
      for (const { time, values } of this.samples) {
        const value = values[i];
        if (time < end - WINDOW || value === null || !Number.isFinite(value)) {
          drawing = false;
          continue;
        }
        if (drawing) sheet.lineTo(x(time), y(value));
        else sheet.moveTo(x(time), y(value));
        drawing = true;
      }
      sheet.stroke();
      this.values[i].textContent = this.text(this.samples.at(-1)?.values[i]);
    });
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
      sheet.fillText(label, left - 5, Math.max(8, Math.min(place, sheet.canvas.clientHeight - 8)));
    }
  }

  line(sheet, width, left, place) {
    sheet.strokeStyle = color("--soft");
    sheet.setLineDash([5, 4]);
    sheet.beginPath();
    sheet.moveTo(left, place);
    sheet.lineTo(width, place);
    sheet.stroke();
    sheet.setLineDash([]);
    sheet.textAlign = "left";
    sheet.textBaseline = "bottom";
    sheet.fillStyle = color("--soft");
    sheet.fillText(this.mark, left + 4, place - 2);
  }
}
