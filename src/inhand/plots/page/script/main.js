// The page comes to life: its tables, its views, its theme.

import { Asterisk } from "./asterisk.js";
import { Chart } from "./chart.js";
import { make, shown } from "./dom.js";
import { heat, intervals } from "./grids.js";
import { maps } from "./maps.js";
import { Player } from "./player.js";
import { copyButton, tables } from "./tables.js";
import { themes } from "./theme.js";

function asterisks(host, { panels }, page) {
  const grid = make("div", { class: panels.length > 1 ? "panels" : "panels one" });
  host.append(grid);
  const stars = panels.map((panel) => {
    const pick = (name) => page.player?.pick(name, panel.title);
    const head = [make("h3", { text: panel.title }), make("p", { class: "hint", text: panel.subtitle })];
    const node = make("div", { class: "panel" }, ...head);
    grid.append(node);
    return new Asterisk(node, panel, pick);
  });
  page.stars.push(...stars);
  if (panels.length === 1) grid.append(ways(panels[0], (name) => stars[0].choose(name, true)));
}

/** The directions of an asterisk as a list of bars: how far, against how far the hand could reach. */
function ways(panel, pick, title = null) {
  const limits = panel.curves.every(({ limit, label }) => limit && Math.abs(limit - label) < 0.01); // a reach
  const far = Math.max(1, ...panel.curves.map((curve) => Math.max(curve.limit ?? 0, curve.label)));
  const share = (value) => `${Math.max(0, (100 * value) / far).toFixed(2)}%`;
  const rows = panel.curves.map((curve) => {
    const fill = make("span", { class: "fill", style: { width: share(curve.label), background: curve.colour } });
    const reach = make("span", { class: "reach", style: { width: share(curve.limit ?? 0) } });
    const number = make("span", { class: "value", text: curve.limit && !limits ? `${shown(curve.label)} of ${shown(curve.limit)}` : shown(curve.label) });
    const act = { click: () => pick(curve.name) };
    const cells = [make("span", { text: curve.name }), make("span", { class: "track" }, reach, fill), number];
    return make("li", {}, make("button", { type: "button", class: "way", on: act }, ...cells));
  });
  const head = make("h3", { text: title ?? (limits ? "The hand's limit [mm]" : "Distance, and the hand's limit [mm]") });
  return make("div", { class: "panel" }, head, make("ol", { class: "ways" }, ...rows));
}

function player(host, content, page) {
  page.player = new Player(host, content, (direction) => page.stars.forEach((star) => star.choose(direction)));
  const failed = content.trials.map((trial, i) => [trial, i]).filter(([trial]) => trial.failed);
  if (!failed.length) return;
  const buttons = failed.map(([trial, i]) => {
    const act = () => {
      page.player.open(i);
      host.scrollIntoView({ block: "nearest" });
    };
    const name = content.trials.some((other) => other.group !== trial.group) ? `${trial.group}, ${trial.name}` : trial.name;
    return make("button", { type: "button", class: "chip", text: `${name}: ${trial.outcome}`, on: { click: act } });
  });
  const label = make("h3", { text: `Failed: ${failed.length} of ${content.trials.length}, to replay` });
  host.append(make("div", { class: "failed" }, label, make("div", { class: "chips" }, ...buttons)));
}

function charts(host, content) {
  const grid = make("div", { class: `charts ${content.size ?? ""}` });
  host.append(grid);
  for (const spec of content.charts) {
    const node = make("div", { class: "panel" });
    grid.append(node);
    new Chart(node, spec);
  }
}

function bars(host, { lists }, page) {
  const grid = make("div", { class: "charts wider" });
  for (const list of lists) grid.append(ways(list, (name) => page.player?.pick(name, list.group), list.title));
  host.append(grid);
}

function discs(host, content, page) {
  maps(host, content.discs, (name, group) => page.player?.pick(name, group));
}

const VIEWS = { asterisks, player, charts, heat, intervals, bars, maps: discs };
const page = { stars: [] };

for (const host of document.querySelectorAll(".view")) {
  const content = JSON.parse(document.getElementById(host.dataset.content).textContent);
  VIEWS[host.dataset.view](host, content, page);
}
for (const frame of document.querySelectorAll(".table")) tables(frame);
for (const block of document.querySelectorAll("pre")) {
  const told = make("span", { class: "told", role: "status" });
  block.after(make("div", { class: "tools" }, copyButton("Copy the command", () => block.textContent, told), told));
}
themes(document.getElementById("theme"));
document.documentElement.dataset.ready = "yes";
