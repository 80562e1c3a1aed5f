// Tables that are sorted by their headings and copied as CSV and LaTeX.

import { make } from "./dom.js";

const NOTHING = new Set(["", "-", "–", "—"]);
const LATEX = {
  "\\": "\\textbackslash{}", "&": "\\&", "%": "\\%", $: "\\$", "#": "\\#", _: "\\_", "{": "\\{", "}": "\\}",
  "~": "\\textasciitilde{}", "^": "\\textasciicircum{}", "±": "$\\pm$", "\u2212": "$-$", "<": "$<$", ">": "$>$", "|": "$|$",
};

/** Return the number that a text begins with; NaN where it begins with none. */
export function leading(text) {
  const found = /^[+\-\u2212]?(\d[\d,]*\.?\d*|\.\d+)(e[+-]?\d+)?/i.exec(text.trim());
  return found ? Number(found[0].replace(/,/g, "").replace("\u2212", "-")) : NaN;
}

function textsOf(table) {
  return [...table.rows].map((row) => [...row.cells].map((cell) => cell.dataset.text ?? cell.textContent.trim()));
}

/** Return rows of texts as CSV. */
export function csvOf(rows) {
  const quoted = (text) => (/[",\n\r]/.test(text) ? `"${text.replace(/"/g, '""')}"` : text);
  return rows.map((row) => row.map(quoted).join(",")).join("\n") + "\n";
}

/** Return rows of texts as a LaTeX table, the first as its heading. */
export function latexOf(rows) {
  const escaped = (text) => [...text].map((letter) => LATEX[letter] ?? letter).join("");
  const lines = rows.map((row) => `${row.map(escaped).join(" & ")} \\\\`);
  const columns = rows[0].map((_, i) => (rows.slice(1).every((row) => isNaN(leading(row[i]))) ? "l" : "r")).join("");
  const [head, ...body] = lines;
  const inside = ["\\toprule", head, "\\midrule", ...body, "\\bottomrule"];
  return [`\\begin{tabular}{${columns}}`, ...inside, "\\end{tabular}", ""].join("\n");
}

async function copy(text) {
  try {
    await navigator.clipboard.writeText(text);
  } catch {
    const area = make("textarea", { "aria-hidden": "true", class: "away" });
    area.value = text;
    document.body.append(area);
    area.select();
    document.execCommand("copy"); // browsers that give pages from the disk no clipboard
    area.remove();
  }
}

/** Return a button that copies what `made` returns, and says so in `told`. */
export function copyButton(name, made, told) {
  const act = async () => {
    await copy(made());
    told.textContent = `${name}: copied`;
    setTimeout(() => told.replaceChildren(), 2500);
  };
  return make("button", { type: "button", class: "small", text: name, on: { click: act } });
}

function sort(table, column, down) {
  const body = table.tBodies[0];
  const rows = [...body.rows].map((row) => [row, textsOf({ rows: [row] })[0][column] ?? ""]);
  const filled = rows.filter(([, text]) => !NOTHING.has(text));
  const empty = rows.filter(([, text]) => NOTHING.has(text));
  const numbers = filled.every(([, text]) => !isNaN(leading(text)));
  const compare = numbers
    ? ([, a], [, b]) => leading(a) - leading(b)
    : ([, a], [, b]) => a.localeCompare(b, "en", { numeric: true });
  filled.sort(compare);
  if (down) filled.reverse();
  body.append(...[...filled, ...empty].map(([row]) => row));
}

function sortable(table) {
  const heads = [...table.tHead.rows[0].cells];
  heads.forEach((head, column) => {
    const text = head.textContent;
    const act = () => {
      const down = head.getAttribute("aria-sort") === "ascending";
      heads.forEach((other) => other.removeAttribute("aria-sort"));
      head.setAttribute("aria-sort", down ? "descending" : "ascending");
      sort(table, column, down);
    };
    head.dataset.text = text;
    head.replaceChildren(make("button", { type: "button", class: "sort", text, on: { click: act } }));
  });
}

/** Let a table of a frame be sorted and copied. */
export function tables(frame) {
  const table = frame.querySelector("table");
  if (table.tBodies[0].rows.length > 1) sortable(table);
  const told = make("span", { class: "told", role: "status" });
  const buttons = [
    copyButton("Copy CSV", () => csvOf(textsOf(table)), told),
    copyButton("Copy LaTeX", () => latexOf(textsOf(table)), told),
  ];
  frame.after(make("div", { class: "tools" }, ...buttons, told));
}
