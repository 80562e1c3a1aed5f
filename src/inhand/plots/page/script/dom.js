// Nodes of the page: made from text alone, so that no name of a file, a hand or an object is ever taken for markup.

const SVG = "http://www.w3.org/2000/svg";

function dress(node, settings, children) {
  for (const [name, value] of Object.entries(settings)) {
    if (value === null || value === undefined || value === false) continue;
    if (name === "text") node.textContent = value;
    else if (name === "on") for (const [event, act] of Object.entries(value)) node.addEventListener(event, act);
    else if (name === "style") for (const [key, each] of Object.entries(value)) node.style.setProperty(key, each);
    else node.setAttribute(name, value === true ? "" : value);
  }
  node.append(...children.filter((child) => child !== null));
  return node;
}

/** Return an HTML element with attributes, `text`, listeners `on`, styles and children. */
export function make(name, settings = {}, ...children) {
  return dress(document.createElement(name), settings, children);
}

/** Return an SVG element, as `make` an HTML one. */
export function draw(name, settings = {}, ...children) {
  return dress(document.createElementNS(SVG, name), settings, children);
}

/** Call `redraw` with the width of a node [px], now and whenever it changes. */
export function onWidth(node, redraw) {
  let known = 0;
  const look = () => {
    const width = Math.round(node.clientWidth);
    if (width > 0 && width !== known) redraw((known = width));
  };
  new ResizeObserver(look).observe(node);
  look();
}

/** Return points [[x, y], ...] as SVG takes them, to a tenth of a pixel. */
export function pathOf(points) {
  return points.map(([x, y]) => `${x.toFixed(1)},${y.toFixed(1)}`).join(" ");
}

/** Return a flat list of numbers x, y, x, y, ... as points. */
export function pairs(flat) {
  const points = [];
  for (let i = 0; i + 1 < flat.length; i += 2) points.push([flat[i], flat[i + 1]]);
  return points;
}

/** Return a number with some digits behind the point, a real minus sign, and a dash where nothing is known. */
export function shown(value, digits = 1) {
  if (value === null || value === undefined || !Number.isFinite(value)) return "–";
  const text = value.toFixed(digits);
  return (Number(text) === 0 ? text.replace("-", "") : text).replace("-", "\u2212");
}

/** Return round numbers that part a range into about `count` steps. */
export function ticks(low, high, count) {
  const rough = (high - low) / Math.max(count, 1);
  if (!(rough > 0) || !Number.isFinite(rough)) return [low];
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 5, 10].map((each) => each * power).find((each) => each >= rough * 0.999);
  const found = [];
  for (let at = Math.ceil(low / step - 1e-9); at * step <= high + 1e-9 * step; at += 1) found.push(at * step);
  return found;
}

/** Return a number of an axis whose ticks lie `step` apart. */
export function tickText(value, step) {
  const digits = Math.max(0, Math.min(6, -Math.floor(Math.log10(step) + 1e-9)));
  return shown(value, digits);
}

const box = make("div", { class: "tip", "aria-hidden": "true" });

/** Show lines of text beside the pointer of an event. */
export function showTip(event, lines) {
  if (!box.isConnected) document.body.append(box);
  box.replaceChildren(...lines.map((text, i) => make(i ? "span" : "strong", { text })));
  box.style.setProperty("display", "block");
  const { width, height } = box.getBoundingClientRect();
  const right = event.clientX + 14 + width > document.documentElement.clientWidth;
  const x = right ? Math.max(4, event.clientX - 14 - width) : event.clientX + 14;
  const y = Math.max(4, Math.min(event.clientY + 14, window.innerHeight - height - 4));
  box.style.setProperty("transform", `translate(${x}px, ${y}px)`);
}

/** Hide what stands beside the pointer. */
export function hideTip() {
  box.style.setProperty("display", "none");
}
