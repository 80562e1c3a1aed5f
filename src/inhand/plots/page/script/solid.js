// Trials in space: where joints put links, and a stage that turns under the pointer.

import { make } from "./dom.js";
import { Recorded } from "./motion.js";

const COLOURS = ["hand", "hand-edge", "object", "object-edge", "ink", "muted", "accent", "series-2", "raised"];
const STEP = 0.12; // [rad] that an arrow key turns the stage
const DARKEST = 0.34; // share of black on a face that is seen from its edge

/** Return a vector turned by a unit quaternion w, x, y, z. */
export function turn([w, x, y, z], [a, b, c]) {
  const [p, q, r] = [y * c - z * b + w * a, z * a - x * c + w * b, x * b - y * a + w * c];
  return [a + 2 * (y * r - z * q), b + 2 * (z * p - x * r), c + 2 * (x * q - y * p)];
}

/** Return the quaternion of two turns, the second first. */
export function multiply([a, b, c, d], [e, f, g, h]) {
  return [a * e - b * f - c * g - d * h, a * f + b * e + c * h - d * g, a * g - b * h + c * e + d * f, a * h + b * g - c * f + d * e];
}

function about([x, y, z], angle) {
  const sin = Math.sin(angle / 2);
  return [Math.cos(angle / 2), x * sin, y * sin, z * sin];
}

function add([a, b, c], [x, y, z]) {
  return [a + x, b + y, c + z];
}

function dot([a, b, c], [x, y, z]) {
  return a * x + b * y + c * z;
}

function triples(flat) {
  const points = [];
  for (let i = 0; i + 2 < flat.length; i += 3) points.push(flat.slice(i, i + 3));
  return points;
}

/** One trial in space, as `Motion` in the plane. */
export class SolidMotion extends Recorded {
  constructor(trial, hands, objects) {
    super(trial, hands);
    this.faces = objects[trial.object].faces.map(triples);
    this.palm = this.hand.palm.map(triples);
    this.joints = this.hand.fingers.reduce((count, finger) => count + finger.links.length, 0);
    this.straight = trial.along !== null;
  }

  place(row) {
    return [0, 1, 2].map((k) => this.value(this.joints + k, row));
  }

  turned(row) {
    const q = [3, 4, 5, 6].map((k) => this.value(this.joints + k, row));
    const size = Math.hypot(...q) || 1;
    return q.map((part) => part / size);
  }

  force(finger, row) {
    return this.value(this.joints + 7 + finger, row);
  }

  held(finger, row) {
    return ((this.touching[Math.floor(row)] >> finger) & 1) === 1;
  }

  /** Return the rods of all fingers at a row: both ends and the radius [mm], and whether it is a tip that touches. */
  rods(row) {
    return this.hand.fingers.flatMap((finger, number) => {
      let [place, turned] = [[0, 0, 0], [1, 0, 0, 0]];
      const found = [];
      finger.links.forEach((link, k) => {
        place = add(place, turn(turned, link.origin));
        turned = multiply(multiply(turned, link.turn), about(link.axis, this.value(finger.first + k, row)));
        for (const [x, y, z, u, v, w, radius] of link.rods) {
          found.push({ ends: [add(place, turn(turned, [x, y, z])), add(place, turn(turned, [u, v, w]))], radius, tip: false });
        }
      });
      const tip = add(place, turn(turned, finger.tip));
      return [...found, { ends: [tip, tip], radius: finger.radius, tip: true, held: this.held(number, row) }];
    });
  }

  body(row) {
    const [place, turned] = [this.place(row), this.turned(row)];
    return this.faces.map((face) => face.map((corner) => add(place, turn(turned, corner))));
  }

  trail(row) {
    const points = [];
    for (let r = this.trial.start; r <= Math.floor(row); r += 1) points.push(this.place(r));
    return points;
  }

  progress(row) {
    const start = Math.min(this.trial.start, this.rows - 1);
    const [now, then] = [this.place(row), this.place(start)];
    const moved = now.map((value, k) => value - then[k]);
    const [w, x, y, z] = this.turned(start);
    const angle = 2 * Math.acos(Math.min(1, Math.abs(multiply(this.turned(row), [w, -x, -y, -z])[0])));
    const far = Math.hypot(...moved);
    const along = this.straight ? dot(moved, this.trial.along) : far;
    const across = this.straight ? Math.sqrt(Math.max(0, far * far - along * along)) : null;
    return { along, across, turned: (angle * 180) / Math.PI };
  }
}

/** The stage of trials in space: drag it, or turn it with the arrow keys. */
export class SolidStage {
  constructor(frame, extent) {
    [this.frame, this.extent] = [frame, extent];
    [this.yaw, this.pitch] = [(-62 * Math.PI) / 180, (24 * Math.PI) / 180];
    this.probes = COLOURS.map((name) => make("i", { style: { color: `var(--${name})`, display: "none" } }));
    const on = { pointerdown: (e) => this.grab(e), pointermove: (e) => this.drag(e), pointerup: () => this.drop(), pointercancel: () => this.drop(), keydown: (e) => this.key(e) };
    this.canvas = make("canvas", { tabindex: 0, role: "img", "aria-label": "Hand and object; arrow keys turn the view", on });
    frame.replaceChildren(this.canvas, ...this.probes);
  }

  build(width, motions, tallest) {
    const height = Math.min(width * 0.85, tallest);
    const sharp = window.devicePixelRatio || 1;
    Object.assign(this.canvas, { width: width * sharp, height: height * sharp });
    for (const [name, value] of [["width", width], ["height", height]]) this.canvas.style.setProperty(name, `${value}px`);
    this.pen = this.canvas.getContext("2d");
    this.pen.setTransform(sharp, 0, 0, sharp, 0, 0);
    [this.width, this.height, this.bodies] = [width, height, motions];
    this.scale = Math.min(width, height) / 2 / this.extent.radius;
  }

  grab(event) {
    this.last = [event.clientX, event.clientY];
    this.canvas.setPointerCapture(event.pointerId);
  }

  drag(event) {
    if (!this.last) return;
    this.turnBy((this.last[0] - event.clientX) / 110, (event.clientY - this.last[1]) / 110);
    this.last = [event.clientX, event.clientY];
  }

  drop() {
    this.last = null;
  }

  key(event) {
    const by = { ArrowLeft: [-STEP, 0], ArrowRight: [STEP, 0], ArrowUp: [0, STEP], ArrowDown: [0, -STEP] }[event.key];
    if (!by) return;
    this.turnBy(...by);
    event.preventDefault();
  }

  turnBy(yaw, pitch) {
    this.yaw += yaw;
    this.pitch = Math.max(-1.5, Math.min(1.5, this.pitch + pitch));
    this.show(this.rows);
  }

  camera() {
    const [ca, sa, ce, se] = [Math.cos(this.yaw), Math.sin(this.yaw), Math.cos(this.pitch), Math.sin(this.pitch)];
    return { to: [ce * ca, ce * sa, se], right: [-sa, ca, 0], up: [-se * ca, -se * sa, ce] };
  }

  at(point, { right, up, to }) {
    const from = point.map((value, k) => value - this.extent.middle[k]);
    return [this.width / 2 + dot(from, right) * this.scale, this.height / 2 - dot(from, up) * this.scale, dot(from, to)];
  }

  show(rows) {
    this.rows = rows;
    const camera = this.camera();
    const colours = Object.fromEntries(COLOURS.map((name, k) => [name, getComputedStyle(this.probes[k]).color]));
    this.pen.clearRect(0, 0, this.width, this.height);
    this.bodies.forEach((motion, i) => {
      this.pen.globalAlpha = i ? 0.35 : 1;
      this.draw(motion, rows[i], camera, i ? { ...colours, object: colours.accent } : colours);
    });
    this.pen.globalAlpha = 1;
    const [first] = this.bodies;
    this.path(triples(first.trial.target), camera, colours.muted, 1.2, [4, 4]);
    this.path(first.trail(rows[0]), camera, colours.accent, 2.6, []);
  }

  draw(motion, row, camera, colours) {
    const faces = [...motion.palm.map((face) => [face, "hand"]), ...motion.body(row).map((face) => [face, "object"])];
    const items = faces.map(([face, kind]) => this.face(face, kind, camera)).filter((item) => item !== null);
    for (const rod of motion.rods(row)) {
      const ends = rod.ends.map((end) => this.at(end, camera));
      items.push({ depth: (ends[0][2] + ends[1][2]) / 2, rod, ends });
    }
    items.sort((a, b) => a.depth - b.depth);
    for (const item of items) {
      if (item.rod) this.rod(item, colours);
      else this.fill(item, colours);
    }
  }

  face(face, kind, camera) {
    const [a, b, c] = face;
    const [u, v] = [b.map((value, k) => value - a[k]), c.map((value, k) => value - a[k])];
    const normal = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
    const size = Math.hypot(...normal) || 1;
    const seen = dot(normal, camera.to) / size;
    if (seen <= 0) return null;
    const points = face.map((corner) => this.at(corner, camera));
    return { depth: points.reduce((sum, point) => sum + point[2], 0) / points.length, points, kind, seen };
  }

  fill({ points, kind, seen }, colours) {
    const { pen } = this;
    pen.beginPath();
    points.forEach(([x, y], i) => (i ? pen.lineTo(x, y) : pen.moveTo(x, y)));
    pen.closePath();
    pen.fillStyle = colours[kind];
    pen.fill();
    pen.fillStyle = `rgba(0, 0, 0, ${(DARKEST * (1 - seen)).toFixed(3)})`;
    pen.fill();
    pen.lineWidth = 0.8;
    pen.strokeStyle = points.length > 3 ? colours[`${kind}-edge`] : "transparent";
    pen.stroke();
  }

  rod({ rod, ends: [from, to] }, colours) {
    const { pen } = this;
    const fill = rod.tip && rod.held ? colours["series-2"] : colours.hand;
    const wide = 2 * rod.radius * this.scale;
    pen.lineCap = "round";
    for (const [colour, width] of [[colours["hand-edge"], wide], [fill, Math.max(wide - 2, 1)]]) {
      pen.beginPath();
      pen.moveTo(from[0], from[1]);
      pen.lineTo(to[0] + 0.01, to[1]);
      pen.strokeStyle = colour;
      pen.lineWidth = width;
      pen.stroke();
    }
  }

  path(points, camera, colour, width, dashes) {
    const { pen } = this;
    pen.beginPath();
    points.map((point) => this.at(point, camera)).forEach(([x, y], i) => (i ? pen.lineTo(x, y) : pen.moveTo(x, y)));
    pen.setLineDash(dashes);
    pen.strokeStyle = colour;
    pen.lineWidth = width;
    pen.stroke();
    pen.setLineDash([]);
  }
}
