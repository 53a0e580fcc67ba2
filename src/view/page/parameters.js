// The selection of the law and the sliders, made from the parameter descriptors.

import { GROUPS, LAWS, TASKS } from "./texts.js";

const STEPS = 1000;

// A range over several powers of ten gets a logarithmic slider.
const isWide = ({ min, max }) => min > 0 && max / min >= 1e3;

function position(parameter, value) {
  const { min, max } = parameter;
  const part = isWide(parameter) ? Math.log(value / min) / Math.log(max / min) : (value - min) / (max - min);
  return Math.round(STEPS * Math.max(0, Math.min(1, part)));
}

function valueAt(parameter, step) {
  const { min, max } = parameter;
  if (step >= STEPS) return max;
  const value = isWide(parameter) ? min * (max / min) ** (step / STEPS) : min + ((max - min) * step) / STEPS;
  return Math.min(max, Math.max(min, +value.toPrecision(3)));
}

// Splits a list of numbers into its numbers, and returns any other value unchanged. These values are passed to `show`.
function numbersOf(parameter) {
  if (parameter.type !== "double array" || !Array.isArray(parameter.value)) return [parameter];
  const { name } = parameter;
  return parameter.value.map((value, i) => ({ ...parameter, type: "double", name: `${name}[${i}]`, value, list: name }));
}

// A description ends with the unit in brackets. Its first clause says what the parameter is; the rest is for reference.
function lineOf(description) {
  const [, text, unit] = /^(.*?)(?: \[([^\]]*)\])?$/s.exec(description);
  return { line: text.split(";")[0], unit: unit ?? "" };
}

class Slider {
  constructor(parameter, set) {
    this.element = document.createElement("div");
    this.element.className = "slider";
    const id = `parameter-${parameter.name}`;
    const label = document.createElement("label");
    label.htmlFor = id;
    const { line, unit } = lineOf(parameter.description);
    label.textContent = unit ? `${parameter.name} [${unit}]` : parameter.name;
    this.range = document.createElement("input");
    Object.assign(this.range, { type: "range", min: 0, max: STEPS, step: 1 });
    this.range.setAttribute("aria-label", `${parameter.name}, slider`);
    this.number = document.createElement("input");
    Object.assign(this.number, { id, type: "number", step: "any", min: parameter.min, max: parameter.max });
    const about = document.createElement("small");
    about.id = `${id}-about`;
    about.textContent = line;
    about.title = parameter.description;
    this.number.setAttribute("aria-describedby", about.id);
    this.range.oninput = () => (this.number.value = valueAt(this.parameter, +this.range.value));
    this.range.onchange = () => set(this.parameter.name, valueAt(this.parameter, +this.range.value));
    this.number.onchange = () => {
      if (this.number.value !== "") set(this.parameter.name, +this.number.value);
    };
    this.element.append(label, this.range, this.number, about);
    this.show(parameter);
  }

  show(parameter) {
    this.parameter = parameter;
    this.range.value = position(parameter, parameter.value);
    this.number.value = +parameter.value.toPrecision(6);
    this.range.setAttribute("aria-valuetext", this.number.value);
  }

  restore() {
    this.show(this.parameter);
  }
}

// Shows the parameters in the page. `ask(name, value)` requests a new value, and resolves to whether the servo accepted it.
export class Parameters {
  constructor(ask) {
    this.ask = ask;
    this.law = document.getElementById("law");
    this.sliders = new Map();
    this.groups = GROUPS.map(([title, names]) => {
      const [section, heading, place] = ["section", "h4", "div"].map((kind) => document.createElement(kind));
      heading.textContent = title;
      place.className = "sliders";
      section.append(heading, place);
      document.getElementById("others").append(section);
      return { names, section, place };
    });
    this.law.onchange = () => this.set("controller", this.law.value);
    this.aim = document.getElementById("aim");
    this.aim.onchange = () => this.set(this.aim.name, this.aim.value);
    // The number of unanswered requests for each parameter. Until they are answered, the value of the user is shown, even if an older value
    // arrives.
    this.asked = new Map();
    // The last value that was requested.
    this.wanted = new Map();
  }

  async set(name, value) {
    const count = (more) => this.asked.set(name, (this.asked.get(name) ?? 0) + more);
    const shown = () => this.known.find((one) => one.name === name)?.value;
    const before = shown();
    count(1);
    this.wanted.set(name, value);
    const [list, values] = this.whole(name, value);
    const taken = await this.ask(list, values);
    count(-1);
    // If the servo rejects a value, the page shows the current value, including changes that were announced in the meantime.
    if (!this.asked.get(name) && (!taken || shown() !== before)) {
      this.sliders.get(name)?.restore();
      this.show(this.known);
    }
  }

  // The parameter that has this value, and its complete value. If one number of a list changes, the others keep their current or requested
  // values.
  whole(name, value) {
    const { list } = this.known.find((one) => one.name === name) ?? {};
    if (!list) return [name, value];
    const numbers = this.known.filter((one) => one.list === list);
    return [list, numbers.map((one) => (one.name === name ? value : this.asked.get(one.name) ? this.wanted.get(one.name) : one.value))];
  }

  show(parameters) {
    parameters = parameters.flatMap(numbersOf);
    this.known = parameters;
    const law = parameters.find((one) => one.name === "controller");
    if (law) this.showChoice(this.law, law, LAWS);
    // Parameters of one arm, or of two.
    const aim = parameters.find((one) => one.name === "task" || one.name === "primitive");
    document.getElementById("aim-choice").hidden = !aim;
    if (aim) {
      this.aim.name = aim.name;
      this.showChoice(this.aim, aim, TASKS);
    }
    const numbers = parameters.filter((one) => one.type === "double" && !one.read_only && one.min !== null && one.max !== null);
    this.place(document.getElementById("gains"), numbers.filter((one) => law && (one.list ?? one.name) === `gains.${law.value}`));
    let others = numbers.filter((one) => !one.list && !one.name.startsWith("gains."));
    for (const { names, section, place } of this.groups) {
      this.place(place, others.filter(({ name }) => names.test(name)));
      others = others.filter(({ name }) => !names.test(name));
      section.hidden = !place.children.length;
    }
  }

  showChoice(select, { name, choices, value }, texts) {
    if (select.options.length !== choices.length) {
      select.replaceChildren(...choices.map((name) => new Option(name, name)));
    }
    if (!this.asked.get(name)) select.value = value;
    document.getElementById(`${select.id}-about`).textContent = texts[select.value] ?? "";
  }

  // Keeps existing controls, so that a slider that the user holds is not replaced.
  place(place, parameters) {
    const elements = parameters.map((parameter) => {
      const known = this.sliders.get(parameter.name);
      if (!known) this.sliders.set(parameter.name, new Slider(parameter, (name, value) => this.set(name, value)));
      else if (this.asked.get(parameter.name)) known.parameter = parameter;
      else if (!known.element.contains(document.activeElement) || known.parameter.value !== parameter.value) known.show(parameter);
      return this.sliders.get(parameter.name).element;
    });
    const same = place.children.length === elements.length && elements.every((element, i) => place.children[i] === element);
    if (!same) place.replaceChildren(...elements);
  }
}
