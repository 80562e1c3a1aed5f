// Maps of all directions of space: half of them on a disc, a dot for each, with its numbers under the pointer.

import { draw, hideTip, make, showTip, shown } from "./dom.js";

const [SIDE, RIM] = [340, 122]; // [px]
const MANY = 40; // from so many dots on their numbers would cover each other

function onDisc(x, y) {
  return [SIDE / 2 + RIM * x, SIDE / 2 - RIM * y];
}

function mark(dot, few, pick) {
  const [cx, cy] = onDisc(dot.x, dot.y);
  const on = { pointermove: (event) => showTip(event, [dot.name, ...dot.told]), pointerleave: hideTip, click: () => pick(dot.name) };
  const rim = dot.failed ? "var(--bad)" : "var(--ink)";
  const circle = draw("circle", { cx, cy, r: few ? 8 : 6, fill: dot.colour, stroke: rim, "stroke-width": dot.failed ? 3 : 0.8, on });
  return few ? [circle, draw("text", { x: cx, y: cy + 20, class: "number", text: shown(dot.label, 0) })] : [circle];
}

/** Draw maps side by side; `pick` is told a direction that the reader clicks on, and whose it is. */
export function maps(host, discs, pick) {
  const grid = make("div", { class: "charts wider" });
  for (const { title, group, rim, dots } of discs) {
    const [cx, cy] = onDisc(0, 0);
    const ends = [[-1.25, 0], [1.25, 0], [0, -1.32], [0, 1.16]].map(([x, y]) => onDisc(x, y));
    const words = rim.map((text, k) => draw("text", { x: ends[k][0], y: ends[k][1] + 4, class: "ring-text middle", text }));
    const few = dots.length < MANY;
    const marks = dots.map((dot) => mark(dot, few, (name) => pick(name, group)));
    const above = [...marks.map(([circle]) => circle), ...marks.flatMap(([, ...numbers]) => numbers)]; // no dot hides a number
    const told = dots.map((dot) => `${dot.name} ${shown(dot.label, 0)}`).join(", ");
    const settings = { viewBox: `0 0 ${SIDE} ${SIDE}`, width: "100%", class: "pick", role: "img", "aria-label": `${title}: ${told}` };
    const svg = draw("svg", settings, draw("circle", { cx, cy, r: RIM, class: "limit" }), ...words, ...above);
    grid.append(make("div", { class: "panel disc" }, make("h3", { text: title }), svg));
  }
  host.append(grid);
}
