// The player: a trial as it moved, another one over it, and its signals; picked by name or in the asterisk.

import { Asterisk } from "./asterisk.js";
import { Chart } from "./chart.js";
import { draw, make, onWidth, shown } from "./dom.js";
import { Motion } from "./motion.js";
import { SolidMotion, SolidStage } from "./solid.js";
import { Stage } from "./stage.js";

const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 4];
const TALLEST = 520; // [px]

function choice(label, options, on) {
  const select = make("select", { on: { change: () => on(select.value) } });
  for (const [group, entries] of options) {
    const nodes = entries.map(([value, text]) => make("option", { value, text }));
    if (group) select.append(make("optgroup", { label: group }, ...nodes));
    else select.append(...nodes);
  }
  return { select, node: make("label", { class: "choice" }, make("span", { text: label }), select) };
}

function groupsOf(trials) {
  const groups = new Map();
  trials.forEach((trial, i) => {
    if (!groups.has(trial.group)) groups.set(trial.group, []);
    groups.get(trial.group).push([i, trial.failed ? `${trial.name} — ${trial.outcome}` : trial.name]);
  });
  return [...groups];
}

/** A player of trials in a node; `onOpen` is told the direction of a trial that is opened later on. */
export class Player {
  constructor(host, content, onOpen) {
    this.content = content;
    const Kind = content.space ? SolidMotion : Motion;
    this.motions = content.trials.map((trial) => new Kind(trial, content.hands, content.objects));
    [this.first, this.over, this.row, this.speed, this.playing, this.forces] = [0, -1, 0, 1, false, true];
    this.build(host);
    this.open(this.first);
    onWidth(this.frame, () => this.rebuild());
    this.onOpen = onOpen;
  }

  get motion() {
    return this.motions[this.first];
  }

  build(host) {
    this.frame = make("div", { class: "stage" });
    const Kind = this.content.space ? SolidStage : Stage;
    this.stage = new Kind(this.frame, this.content.extent, this.content.walls);
    this.told = make("p", { class: "told-trial" });
    this.signals = make("div", { class: "signals" });
    const left = make("div", { class: "picker" });
    const right = make("div", { class: "screen" }, this.told, this.frame, this.controls());
    const body = make("div", { class: this.content.picker ? "player" : "player bare", on: { keydown: (event) => this.key(event) } }, left, right);
    host.append(body, this.signals);
    this.choices(left);
    if (this.content.picker) {
      const hint = make("p", { class: "hint", text: "Pick a direction: click, or arrow keys." });
      this.star = new Asterisk(left, this.content.picker, (name) => this.pick(name, this.motion.trial.group));
      left.append(hint);
    }
  }

  choices(place) {
    const groups = groupsOf(this.content.trials);
    const trial = choice("Trial", groups, (value) => this.open(Number(value)));
    const over = choice("Laid over it", [["", [[-1, "nothing"]]], ...groups], (value) => this.lay(Number(value)));
    const shape = { type: "checkbox", on: { change: (event) => { this.forces = event.target.checked; this.show(); } } };
    const forces = make("input", shape);
    forces.checked = true;
    const box = make("label", { class: "check" }, forces, make("span", { text: "forces (8 mm for 1 N)" }));
    [this.trialSelect, this.overSelect] = [trial.select, over.select];
    place.append(trial.node, ...(this.motions.length > 1 ? [over.node] : []), ...(this.content.space ? [] : [box]));
  }

  controls() {
    this.button = make("button", { type: "button", class: "play", text: "Play", on: { click: () => this.toggle() } });
    const step = (by, text, name) =>
      make("button", { type: "button", "aria-label": name, title: name, text, on: { click: () => this.step(by) } });
    this.range = make("input", { type: "range", min: 0, step: 1, "aria-label": "Time in the trial", on: { input: () => this.seek(Number(this.range.value)) } });
    const speeds = SPEEDS.map((speed) => [speed, `${speed}×`]);
    const speed = choice("Speed", [["", speeds]], (value) => { this.speed = Number(value); });
    speed.select.value = "1";
    this.clock = make("output", { class: "clock" });
    const row = [this.button, step(-1, "‹", "One step back"), step(1, "›", "One step on"), this.range, this.clock, speed.node];
    return make("div", { class: "controls", role: "group", "aria-label": "Replay" }, ...row);
  }

  /** Show the trial of a number from its start. */
  open(number) {
    this.stop();
    this.first = number;
    this.trialSelect.value = number;
    const { trial } = this.motion;
    this.row = Math.min(trial.start, this.motion.rows - 1);
    this.range.max = this.motion.rows - 1;
    this.told.replaceChildren(make("strong", { text: `${trial.group}, ${trial.name}` }), `: ${trial.told}`);
    this.star?.choose(trial.direction);
    this.onOpen?.(trial.direction);
    this.rebuild();
    this.chart();
  }

  lay(number) {
    this.over = number;
    this.overSelect.value = number;
    this.rebuild();
    this.chart();
  }

  /** Show the first trial of a direction, of a group if it has one. */
  pick(direction, group) {
    const { trials } = this.content;
    const fits = (trial) => trial.direction === direction;
    const own = trials.findIndex((trial) => fits(trial) && trial.group === group);
    const found = own >= 0 ? own : trials.findIndex(fits);
    if (found >= 0) this.open(found);
  }

  shownMotions() {
    return this.over >= 0 && this.over !== this.first ? [this.motion, this.motions[this.over]] : [this.motion];
  }

  rebuild() {
    const width = this.frame.clientWidth;
    if (!width) return;
    this.stage.build(width, this.shownMotions(), TALLEST);
    this.show();
  }

  show() {
    if (!this.stage.bodies) return;
    const time = this.motion.time(this.row);
    this.stage.show(this.shownMotions().map((motion, i) => (i ? motion.rowAt(time) : this.row)), this.forces);
    const { along, turned } = this.motion.progress(this.row);
    const phase = this.motion.trial.phases.filter(([from]) => from <= this.row).pop()[1];
    this.range.value = this.row;
    const text = `${shown(time, 2)} s · ${phase} · ${shown(along, 1)} mm, ${shown(turned, 1)}°`;
    this.clock.textContent = text;
    this.range.setAttribute("aria-valuetext", text);
    this.charts?.forEach((chart) => chart.cursor(time));
  }

  seek(row) {
    this.row = Math.min(Math.max(row, 0), this.motion.rows - 1);
    this.show();
  }

  step(by) {
    this.stop();
    this.seek(Math.round(this.row) + by);
  }

  toggle() {
    if (this.playing) return this.stop();
    if (this.row >= this.motion.rows - 1) this.row = 0;
    this.playing = true;
    this.button.textContent = "Pause";
    let before = performance.now();
    const frame = (now) => {
      if (!this.playing) return;
      this.row += ((now - before) / 1000 / this.motion.trial.period) * this.speed;
      before = now;
      const ended = this.row >= this.motion.rows - 1;
      this.seek(this.row);
      if (ended) this.stop();
      else requestAnimationFrame(frame);
    };
    requestAnimationFrame(frame);
  }

  stop() {
    this.playing = false;
    this.button.textContent = "Play";
  }

  key(event) {
    const typing = ["INPUT", "SELECT", "BUTTON"].includes(event.target.tagName);
    if (event.key === "k" || (event.key === " " && !typing && event.target.getAttribute("role") !== "radio")) this.toggle();
    else if (event.key === ",") this.step(-1);
    else if (event.key === ".") this.step(1);
    else return;
    event.preventDefault();
  }

  chart() {
    const fingers = this.motion.hand.fingers.map((finger) => finger.name);
    const series = this.shownMotions().map((motion) => signalsOf(motion, fingers.length));
    const named = (text, i) => (i ? `${text}, laid over` : text);
    const lines = (make_) => series.flatMap((one, i) => make_(one, i).map((line) => ({ ...line, dashes: i > 0 })));
    const x = { label: "time [s]", around: 0 };
    const seek = (time) => { this.stop(); this.seek(this.motion.rowAt(time)); };
    const { straight } = this.motion;
    const way = lines((one, i) => [
      { name: named(straight ? "along" : "from the start", i), x: one.time, y: one.along, series: 0 },
      ...(straight ? [{ name: named("across", i), x: one.time, y: one.across, series: 1 }] : []),
      { name: named("turned [deg]", i), x: one.time, y: one.turned, series: 2 }]);
    const force = lines((one, i) => fingers.map((name, k) => ({ name: named(name, i), x: one.time, y: one.forces[k], series: k })));
    const hosts = ["Way of the object [mm]", "Force of each finger [N]"].map((title) => [title, make("div", { class: "signal" })]);
    this.signals.replaceChildren(...hosts.map(([, node]) => node));
    this.charts = [way, force].map((drawn, k) =>
      new Chart(hosts[k][1], { title: hosts[k][0], x, y: { label: "", low: k ? 0 : undefined }, lines: drawn, height: 190 }, seek));
    this.signals.append(this.strip(fingers));
    this.charts.forEach((chart) => chart.cursor(this.motion.time(this.row)));
  }

  strip(fingers) {
    const rows = fingers.map((name, k) => {
      const runs = contactRuns(this.motion, k);
      const bars = runs.map(([from, to]) => draw("rect", { x: from, y: 0, width: Math.max(to - from, 0.4), height: 1, class: "held" }));
      const bar = draw("svg", { viewBox: `0 0 ${this.motion.rows} 1`, preserveAspectRatio: "none", class: "strip", "aria-hidden": "true" }, ...bars);
      const held = runs.reduce((sum, [from, to]) => sum + to - from, 0) / this.motion.rows;
      return make("div", { class: "strip-row" }, make("span", { text: name }), bar, make("span", { class: "share", text: `${shown(100 * held, 0)} %` }));
    });
    return make("div", { class: "signal strips" }, make("h3", { text: "Contact over the trial" }), ...rows);
  }
}

function contactRuns(motion, finger) {
  const runs = [];
  for (let row = 0; row < motion.rows; row += 1) {
    if (!((motion.touching[row] >> finger) & 1)) continue;
    const last = runs[runs.length - 1];
    if (last && last[1] === row) last[1] = row + 1;
    else runs.push([row, row + 1]);
  }
  return runs;
}

function signalsOf(motion, fingers) {
  const found = { time: [], along: [], across: [], turned: [], forces: Array.from({ length: fingers }, () => []) };
  for (let row = 0; row < motion.rows; row += 1) {
    const { along, across, turned } = motion.progress(row);
    found.time.push(motion.time(row));
    found.along.push(along);
    found.across.push(across);
    found.turned.push(turned);
    found.forces.forEach((list, k) => {
      list.push(motion.force(k, row));
    });
  }
  return found;
}
