// The asterisk: paths in every direction from one start, with the reach of the hand around them.

import { draw, hideTip, make, onWidth, pairs, pathOf, showTip, shown } from "./dom.js";

const RAD = Math.PI / 180;
const LEAST_LABEL = 62; // [px] from the middle: nearer, the numbers of sixteen directions would cover each other
const MIDDLE = 12; // [px] around the start, where no direction is meant

function placed(panel, width) {
  const [left, right, bottom, top] = panel.extent;
  const scale = width / (right - left);
  return { scale, height: (top - bottom) * scale, at: ([x, y]) => [(x - left) * scale, (top - y) * scale] };
}

function polygon(points, at, settings) {
  return draw("polygon", { points: pathOf(points.map(at)), ...settings });
}

function scene(panel, at) {
  return panel.scene.map(({ kind, points }) => polygon(pairs(points), at, { class: `scene ${kind}` }));
}

function rings(panel, { at, scale }) {
  const [left, right, bottom, top] = panel.extent;
  const far = Math.max(-left, right, -bottom, top);
  const step = [10, 20, 25, 50, 100, 200, 500].find((each) => each * scale >= 46) ?? 1000;
  const circles = [];
  const numbers = [];
  const [x, y] = at([0, 0]);
  for (let radius = step; radius < far * 1.4; radius += step) {
    const [tx, ty] = at([radius * Math.cos(-11.25 * RAD), radius * Math.sin(-11.25 * RAD)]);
    circles.push(draw("circle", { cx: x, cy: y, r: radius * scale, class: "ring" }));
    if (radius * scale > LEAST_LABEL && tx < (right - left) * scale - 12) numbers.push(draw("text", { x: tx, y: ty + 4, class: "ring-text middle", text: radius }));
  }
  return { circles, numbers };
}

function along(curve, length) {
  return [length * Math.cos(curve.angle * RAD), length * Math.sin(curve.angle * RAD)];
}

function line(curve, place) {
  const target = curve.target ? pairs(curve.target) : [[0, 0], along(curve, curve.limit ?? curve.label)];
  const path = pairs(curve.points).map(place.at);
  const parts = [draw("polyline", { points: pathOf(target.map(place.at)), class: "target" })];
  for (const band of curve.bands) parts.push(polygon(pairs(band), place.at, { fill: curve.colour, class: "band" }));
  parts.push(draw("polyline", { points: pathOf(path), class: "halo" }));
  parts.push(draw("polyline", { points: pathOf(path), class: "path", stroke: curve.colour }));
  const end = path[path.length - 1] ?? place.at([0, 0]);
  if (curve.failed) parts.push(draw("path", { d: `M${end} m-4,-4 l8,8 m0,-8 l-8,8`, class: "cross" }));
  return parts;
}

function label(curve, place) {
  const [x, y] = place.at([0, 0]);
  const points = pairs(curve.points);
  const end = points[points.length - 1] ?? [0, 0];
  const radius = Math.max(LEAST_LABEL, Math.hypot(...end) * place.scale + 13);
  const angle = Math.hypot(...end) * place.scale > 8 && curve.target ? Math.atan2(end[1], end[0]) : curve.angle * RAD;
  const at = { x: x + radius * Math.cos(angle), y: y - radius * Math.sin(angle) + 4 };
  return draw("text", { ...at, class: "number", text: shown(curve.label, 0) });
}

function toldOf(curve) {
  return [curve.name, ...curve.told];
}

/** The asterisk of one panel in a node; `onPick` is told the name of a direction that the reader chooses. */
export class Asterisk {
  constructor(host, panel, onPick = null) {
    this.panel = panel;
    this.onPick = onPick;
    this.chosen = -1;
    this.plain = panel.plain ?? false;
    this.host = host;
    this.told = this.plain ? null : make("p", { class: "reading", "aria-live": "polite" });
    this.frame = make("div", { class: "asterisk" });
    host.append(this.frame, ...(this.told ? [this.told] : []));
    this.rest();
    onWidth(this.frame, (width) => this.redraw(width));
  }

  rest() {
    if (this.told) this.told.textContent = this.panel.curves.length ? this.panel.hint : "No trial of these directions.";
  }

  redraw(width) {
    const place = placed(this.panel, width);
    const { curves, limit } = this.panel;
    const holds = this.frame.contains(document.activeElement);
    this.place = place;
    this.marks = curves.map((curve, i) => this.mark(curve, i, place));
    const { circles, numbers } = this.plain ? { circles: [], numbers: [] } : rings(this.panel, place);
    const back = [...circles, ...scene(this.panel, place.at), ...numbers]; // the hand would hide numbers below it
    if (limit.length) back.push(polygon(pairs(limit), place.at, { class: "limit" }));
    const group = draw("g", { role: "radiogroup", "aria-label": `Directions of ${this.panel.title}` }, ...this.marks);
    const labels = this.plain ? [] : curves.map((curve) => label(curve, place));
    const on = { pointermove: (e) => this.point(e), pointerleave: () => this.leave(), click: (e) => this.click(e) };
    const size = { viewBox: `0 0 ${width} ${place.height}`, width, height: place.height };
    this.frame.replaceChildren(draw("svg", { ...size, class: this.onPick ? "pick" : "", on }, ...back, group, ...labels));
    this.show(this.chosen);
    if (holds) this.marks[this.chosen]?.focus();
  }

  mark(curve, i, place) {
    const on = { keydown: (event) => this.key(event, i), focus: () => this.tell(i), blur: () => this.leave() };
    const settings = { role: "radio", class: "direction", "aria-label": toldOf(curve).join("; "), on };
    return draw("g", settings, ...line(curve, place));
  }

  near(event) {
    const { left, top } = this.frame.getBoundingClientRect();
    const [x, y] = this.place.at([0, 0]);
    const [dx, dy] = [event.clientX - left - x, y - (event.clientY - top)];
    if (Math.hypot(dx, dy) < MIDDLE || !this.panel.curves.length) return null;
    const angle = Math.atan2(dy, dx) / RAD;
    const apart = (curve) => Math.abs(((angle - curve.angle + 540) % 360) - 180);
    const found = this.panel.curves.map(apart);
    const i = found.indexOf(Math.min(...found));
    return found[i] < 40 ? { i, way: (Math.hypot(dx, dy) * Math.cos(found[i] * RAD)) / this.place.scale } : null;
  }

  point(event) {
    const found = this.near(event);
    if (!found) return this.leave();
    this.tell(found.i);
    showTip(event, [...toldOf(this.panel.curves[found.i]), `pointer at ${shown(found.way, 0)} mm`]);
  }

  tell(i) {
    this.frame.classList.add("told-one");
    this.marks.forEach((mark, j) => mark.classList.toggle("near", i === j));
    if (this.told) this.told.textContent = toldOf(this.panel.curves[i]).join(" · ");
  }

  leave() {
    hideTip();
    this.frame.classList.remove("told-one");
    this.marks.forEach((mark) => mark.classList.remove("near"));
    this.rest();
  }

  click(event) {
    const found = this.near(event);
    if (found) this.pick(found.i);
  }

  key(event, i) {
    const count = this.marks.length;
    const step = { ArrowRight: 1, ArrowDown: 1, ArrowLeft: -1, ArrowUp: -1 }[event.key];
    if (step) {
      const next = (i + step + count) % count;
      this.pick(next);
      this.marks[next].focus();
    } else if (event.key === "Enter" || event.key === " ") this.pick(i);
    else return;
    event.preventDefault();
  }

  pick(i) {
    this.show(i);
    if (this.onPick) this.onPick(this.panel.curves[i].name, this.panel.title);
  }

  show(i) {
    this.chosen = i;
    this.marks?.forEach((mark, j) => {
      mark.setAttribute("aria-checked", i === j);
      mark.setAttribute("tabindex", Math.max(i, 0) === j ? 0 : -1);
      mark.classList.toggle("chosen", Boolean(this.onPick) && i === j);
    });
  }

  /** Mark the direction of a name as the chosen one; `told` tells of it, as if the reader had picked it here. */
  choose(name, told = false) {
    const i = this.panel.curves.findIndex((curve) => curve.name === name);
    if (i >= 0 && told) this.pick(i);
    else if (i >= 0) this.show(i);
  }
}
