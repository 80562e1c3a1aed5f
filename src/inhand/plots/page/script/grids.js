// Numbers in rows: heat maps as coloured tables, and estimates with their intervals.

import { make, shown } from "./dom.js";

const DEEPEST = 0.58; // share of colour in the cell of the largest number: more, and its text could not be read

function heatCell(value, note, top, digits) {
  const text = shown(value, digits);
  const lines = note ? [make("span", { class: "note", text: note })] : [];
  const share = value === null ? 0 : Math.max(0, Math.min(1, value / top));
  const depth = (DEEPEST * share).toFixed(3);
  return make("td", { style: { "--depth": depth }, "data-text": text }, make("span", { text }), ...lines);
}

/** Draw heat maps one below the other. */
export function heat(host, { maps }) {
  for (const map of maps) {
    const heads = ["", ...map.columns].map((text) => make("th", { scope: "col", text }));
    const rows = map.rows.map((name, r) => {
      const cells = map.columns.map((_, c) => heatCell(map.values[r][c], map.notes[r][c], map.top, map.digits));
      return make("tr", {}, make("th", { scope: "row", text: name }), ...cells);
    });
    heads[0].append(make("span", { class: "away", text: "Name" }));
    const table = make("table", {}, make("thead", {}, make("tr", {}, ...heads)), make("tbody", {}, ...rows));
    const frame = make("div", { class: "table heat", role: "region", "aria-label": map.title, tabindex: 0 }, table);
    host.append(make("h3", { text: map.title }), make("p", { class: "hint", text: map.told }), frame);
  }
}

function estimate(row, low, high) {
  const at = (value) => `${((100 * (value - low)) / (high - low)).toFixed(2)}%`;
  const clear = row.low > 0 || row.high < 0;
  const parts = row.middle === null ? [] : [
    make("span", { class: "whisker", style: { left: at(row.low), right: `calc(100% - ${at(row.high)})` } }),
    make("span", { class: clear ? "mark" : "mark open", style: { left: at(row.middle) } }),
  ];
  const zero = make("span", { class: "zero", style: { left: at(0) } });
  const ends = row.middle === null ? "not told" : `${shown(row.middle, 2)} (${shown(row.low, 2)} to ${shown(row.high, 2)})`;
  const cells = [make("span", { text: row.name }), make("span", { class: "track" }, zero, ...parts), make("span", { class: "value", text: ends })];
  return make("li", { class: "estimate" }, ...cells);
}

/** Draw lists of estimates with their intervals, one panel each. */
export function intervals(host, { panels, low, high }) {
  const grid = make("div", { class: "charts wider" });
  host.append(grid);
  for (const panel of panels) {
    const rows = panel.rows.map((row) => estimate(row, low, high));
    const head = [make("h3", { text: panel.title }), make("p", { class: "hint", text: panel.told })];
    grid.append(make("div", { class: "panel" }, ...head, make("ol", { class: "ways" }, ...rows)));
  }
}
