// Lines and points over one axis, with the values under the pointer.

import { draw, hideTip, make, onWidth, pathOf, showTip, shown, ticks, tickText } from "./dom.js";

const PAD = { left: 60, right: 14, top: 10, bottom: 38 };
const SYMBOLS = ["circle", "square", "triangle", "diamond"];

function finite(values) {
  return values.filter((value) => value !== null && Number.isFinite(value));
}

function rangeOf(values, { low, high, around = 0.06 }) {
  const known = finite(values);
  const least = Math.min(...known, low ?? Infinity);
  const most = Math.max(...known, high ?? -Infinity);
  if (!known.length && (low ?? null) === null) return [0, 1];
  const margin = (most - least || Math.abs(most) || 1) * around;
  return [least === low ? least : least - margin, most === high ? most : most + margin];
}

function symbol(kind, x, y, settings, size) {
  const d = {
    square: `M${x - 3},${y - 3} h6 v6 h-6 z`,
    triangle: `M${x},${y - 4} l4,7 h-8 z`,
    diamond: `M${x},${y - 4.5} l4.5,4.5 l-4.5,4.5 l-4.5,-4.5 z`,
  }[kind];
  return d ? draw("path", { d, ...settings }) : draw("circle", { cx: x, cy: y, r: size ?? 3.2, ...settings });
}

/** A chart of lines; `spec` says what of, `onSeek` is told the place of the axis that the reader clicks on. */
export class Chart {
  constructor(host, spec, onSeek = null) {
    this.spec = spec;
    this.onSeek = onSeek;
    this.frame = make("div", { class: "chart" });
    host.append(...(spec.title ? [make("h3", { text: spec.title })] : []), this.frame);
    if (spec.lines.length > 1 || spec.legend) host.append(this.legend());
    onWidth(this.frame, (width) => this.redraw(width));
  }

  legend() {
    const keys = this.spec.lines.filter((line) => line.name && !line.silent);
    const items = keys.map((line) => {
      const swatch = draw("svg", { width: 26, height: 12, "aria-hidden": "true" });
      if (!line.points) swatch.append(draw("path", { d: "M1,6 h24", ...this.look(line) }));
      if (line.dots || line.points) swatch.append(this.dot(line, 13, 6));
      return make("li", {}, swatch, make("span", { text: line.name }));
    });
    return make("ul", { class: "legend" }, ...items);
  }

  look(line) {
    const colour = line.colour ? { stroke: line.colour } : {};
    return { class: `line ${line.colour ? "" : `series-${line.series}`} ${line.faint ? "faint" : ""} ${line.dashes ? "dashes" : ""}`, ...colour };
  }

  dot(line, x, y) {
    const colour = line.colour ? { fill: line.colour } : {};
    return symbol(line.symbol ?? SYMBOLS[(line.series ?? 0) % 4], x, y, {
      class: `dot ${line.colour ? "" : `series-${line.series}`} ${line.hollow ? "hollow" : ""}`, ...colour }, line.size);
  }

  redraw(width) {
    const { spec } = this;
    const height = spec.height ?? 230;
    const log = spec.y.log === true;
    const flat = (key) => spec.lines.flatMap((line) => [...line[key], ...(key === "y" ? [...(line.low ?? []), ...(line.high ?? [])] : [])]);
    const ys = log ? finite(flat("y")).filter((y) => y > 0).map(Math.log10) : flat("y");
    const [x0, x1] = rangeOf(flat("x"), { around: spec.x.around ?? 0.02, ...spec.x });
    const [y0, y1] = rangeOf([...ys, ...(spec.levels ?? []).map((level) => level.y)], spec.y);
    const [w, h] = [width - PAD.left - PAD.right, height - PAD.top - PAD.bottom];
    this.px = (x) => PAD.left + ((x - x0) / (x1 - x0 || 1)) * w;
    this.py = (y) => PAD.top + (1 - ((log ? Math.log10(Math.max(y, 1e-300)) : y) - y0) / (y1 - y0 || 1)) * h;
    this.fromPx = (px) => x0 + ((px - PAD.left) / w) * (x1 - x0);
    this.box = { width, height, w, h };
    this.pen = draw("path", { class: "cursor" });
    const on = { pointermove: (e) => this.point(e), pointerleave: hideTip, click: (e) => this.seek(e) };
    const size = { viewBox: `0 0 ${width} ${height}`, width, height, role: "img", "aria-label": this.name() };
    const inside = [...this.axes([x0, x1], [y0, y1], log), ...this.levels(), ...spec.lines.flatMap((line) => this.line(line)), this.pen];
    this.frame.replaceChildren(draw("svg", { ...size, on, class: this.onSeek ? "pick" : "" }, ...inside));
    if (this.at !== undefined) this.cursor(this.at);
  }

  name() {
    return this.spec.about ?? `${this.spec.title ?? this.spec.y.label} over ${this.spec.x.label}`;
  }

  axes([x0, x1], [y0, y1], log) {
    const { width, height, w, h } = this.box;
    const found = [];
    const across = ticks(x0, x1, Math.max(2, w / 90));
    for (const x of across) {
      const text = tickText(x, across[1] - across[0] || 1);
      found.push(draw("path", { d: `M${this.px(x)},${PAD.top} v${h}`, class: "grid" }));
      found.push(draw("text", { x: this.px(x), y: PAD.top + h + 16, class: "tick middle", text }));
    }
    const up = log ? ticks(Math.ceil(y0), Math.floor(y1), 4).filter(Number.isInteger) : ticks(y0, y1, h / 42);
    for (const y of up) {
      const place = this.py(log ? 10 ** y : y);
      const text = log ? `1e${y}` : tickText(y, up[1] - up[0] || 1);
      found.push(draw("path", { d: `M${PAD.left},${place} h${w}`, class: "grid" }));
      found.push(draw("text", { x: PAD.left - 7, y: place + 4, class: "tick end", text }));
    }
    found.push(draw("text", { x: PAD.left + w, y: height - 5, class: "axis end", text: this.spec.x.label }));
    if (this.spec.y.label) {
      const turn = `translate(11 ${PAD.top + h / 2}) rotate(-90)`;
      found.push(draw("text", { transform: turn, class: "axis middle", text: this.spec.y.label }));
    }
    return found.concat(draw("path", { d: `M${PAD.left},${PAD.top} v${h} h${width - PAD.left - PAD.right}`, class: "frame" }));
  }

  levels() {
    return (this.spec.levels ?? []).map(({ y, series }) =>
      draw("path", { d: `M${PAD.left},${this.py(y)} h${this.box.w}`, class: `level series-${series ?? 0}` }),
    );
  }

  line(line) {
    const places = line.x.map((x, i) => (line.y[i] === null ? null : [this.px(x), this.py(line.y[i])]));
    const known = places.filter((place) => place !== null);
    const found = [];
    if (line.low) {
      const edge = (side) => line.x.map((x, i) => (side[i] === null ? null : [this.px(x), this.py(side[i])])).filter(Boolean);
      found.push(draw("polygon", { points: pathOf([...edge(line.low), ...edge(line.high).reverse()]), class: `spread series-${line.series ?? 0}` }));
    }
    if (!line.points) found.push(draw("polyline", { points: pathOf(known), ...this.look(line) }));
    if (line.dots || line.points) found.push(...known.map(([x, y]) => this.dot(line, x, y)));
    return found;
  }

  point(event) {
    const { left, top } = this.frame.getBoundingClientRect();
    const [mx, my] = [event.clientX - left, event.clientY - top];
    const lines = this.spec.scatter ? this.nearest(mx, my) : this.column(this.fromPx(mx));
    if (lines) showTip(event, lines);
    else hideTip();
  }

  nearest(mx, my) {
    let best = null;
    for (const line of this.spec.lines) {
      line.x.forEach((x, i) => {
        if (line.y[i] === null || !line.names) return;
        const far = Math.hypot(this.px(x) - mx, this.py(line.y[i]) - my);
        if (far < 24 && (!best || far < best.far)) best = { far, line, i };
      });
    }
    if (!best) return null;
    const { line, i } = best;
    return [line.names[i], `${this.spec.x.label}: ${shown(line.x[i], 1)}`, `${this.spec.y.label}: ${shown(line.y[i], 1)}`];
  }

  column(at) {
    const named = this.spec.lines.filter((line) => line.name && !line.faint && line.x.length);
    const rows = named.map((line) => {
      const apart = line.x.map((x) => Math.abs(x - at));
      const i = apart.indexOf(Math.min(...apart));
      return { x: line.x[i], text: `${line.name}: ${shown(line.y[i], this.spec.digits ?? 2)}` };
    });
    return rows.length ? [`${this.spec.x.label}: ${shown(rows[0].x, this.spec.x.digits ?? 2)}`, ...rows.map((row) => row.text)] : null;
  }

  seek(event) {
    if (this.onSeek) this.onSeek(this.fromPx(event.clientX - this.frame.getBoundingClientRect().left));
  }

  /** Draw a line through a place of the axis. */
  cursor(x) {
    this.at = x;
    this.pen?.setAttribute("d", `M${this.px(x).toFixed(1)},${PAD.top} v${this.box.h}`);
  }
}
