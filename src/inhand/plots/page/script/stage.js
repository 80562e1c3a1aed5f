// The stage of a replay: hand and object of one trial, to scale, and the outlines of another over it.

import { draw, pairs, pathOf } from "./dom.js";

const DEG = 180 / Math.PI;
const FORCE_MM = 8; // length of the arrow of one newton
const LEAST_N = 0.05; // a smaller force has no arrow

function outline(flat, scale, kind) {
  const points = pairs(flat).map(([x, y]) => [x * scale, -y * scale]);
  return draw("polygon", { points: pathOf(points), class: `scene ${kind}` });
}

/** Hand, object, contacts and way of one trial as nodes of a drawing. */
class Body {
  constructor(motion, stage, over) {
    this.motion = motion;
    this.stage = stage;
    const { scale } = stage;
    const { hand, object } = motion;
    this.palm = outline(hand.palm, scale, "palm");
    this.links = hand.fingers.map((finger) => finger.outlines.map((flat) => outline(flat, scale, "link")));
    this.joints = hand.fingers.map((finger) => finger.lengths.map(() => draw("circle", { r: 3, class: "joint" })));
    const nose = draw("path", { d: `M0,0 L${object.nose * scale},0`, class: "nose" });
    this.object = draw("g", {}, outline(object.outline, scale, "object"), draw("circle", { r: 2.2, class: "nose-dot" }), nose);
    this.halo = draw("polyline", { class: "halo" });
    this.trail = draw("polyline", { class: "path", stroke: motion.trial.colour });
    this.arrows = hand.fingers.map(() => draw("path", { class: "force" }));
    this.dots = hand.fingers.map(() => draw("circle", { r: 4, class: "contact" }));
    const solid = [this.palm, ...this.links.flat(), ...this.joints.flat(), this.object];
    this.node = draw("g", { class: over ? "body over" : "body" }, ...solid, this.halo, this.trail, ...this.arrows, ...this.dots);
  }

  at(x, y) {
    const { left, top, scale } = this.stage;
    return [(x - left) * scale, (top - y) * scale];
  }

  put(node, x, y, angle = 0) {
    const [px, py] = this.at(x, y);
    node.setAttribute("transform", `translate(${px.toFixed(2)} ${py.toFixed(2)}) rotate(${(-angle * DEG).toFixed(3)})`);
  }

  show(row, forces) {
    this.put(this.palm, 0, 0);
    this.links.forEach((nodes, number) => {
      const { links } = this.motion.chain(number, row);
      links.forEach(({ x, y, angle }, i) => {
        this.put(nodes[i], x, y, angle);
        this.put(this.joints[number][i], x, y);
      });
      this.touch(number, row, forces);
    });
    this.put(this.object, ...this.motion.pose(row));
    const points = pathOf(this.motion.trail(row).map(([x, y]) => this.at(x, y)));
    this.trail.setAttribute("points", points);
    this.halo.setAttribute("points", points);
  }

  touch(number, row, forces) {
    const { x, y, fx, fy, held } = this.motion.contact(number, row);
    const [dot, arrow] = [this.dots[number], this.arrows[number]];
    this.put(dot, x, y);
    dot.classList.toggle("open", !held);
    const size = Math.hypot(fx, fy);
    if (!forces || !held || size < LEAST_N) return arrow.setAttribute("d", "");
    const long = size * FORCE_MM * this.stage.scale;
    this.put(arrow, x, y, Math.atan2(fy, fx));
    return arrow.setAttribute("d", `M0,0 L${long.toFixed(1)},0 m-6,-4 l6,4 l-6,4`);
  }
}

/** The drawing of one trial, or of two over each other. */
export class Stage {
  constructor(frame, extent, walls) {
    this.frame = frame;
    this.extent = extent;
    this.walls = walls;
  }

  /** Draw trials for a width [px], the first whole and the others as outlines. */
  build(width, motions, tallest) {
    const [left, right, bottom, top] = this.extent;
    const room = Math.min(width, (tallest * (right - left)) / (top - bottom));
    this.scale = room / (right - left);
    [this.left, this.top] = [left - (width - room) / 2 / this.scale, top];
    this.bodies = motions.map((motion, i) => new Body(motion, this, i > 0));
    const height = (top - bottom) * this.scale;
    const still = [...this.wallNodes(), ...this.rule(width, height)];
    const size = { viewBox: `0 0 ${width} ${height}`, width, height, role: "img", "aria-label": "Hand and object from above" };
    const over = this.targets(motions).map((line) => (line.classList.add("over-all"), line));
    this.frame.replaceChildren(draw("svg", size, ...still, ...this.bodies.map((body) => body.node), ...over));
  }

  at([x, y]) {
    return [(x - this.left) * this.scale, (this.top - y) * this.scale];
  }

  wallNodes() {
    return this.walls.map((flat) => draw("polygon", { points: pathOf(pairs(flat).map((p) => this.at(p))), class: "wall" }));
  }

  targets(motions) {
    const lines = motions.slice(0, 1).map(({ trial }) => pairs(trial.target).map((p) => this.at(p)));
    return lines.map((points) => draw("polyline", { points: pathOf(points), class: "target" }));
  }

  rule(width, height) {
    const long = 20 * this.scale;
    const d = `M12,${height - 12} h${long.toFixed(1)} m0,-4 v8 m${(-long).toFixed(1)},0 v-8`;
    return [draw("path", { d, class: "rule" }), draw("text", { x: 12, y: height - 20, class: "ring-text", text: "20 mm" })];
  }

  /** Move every trial to a row of its own. */
  show(rows, forces) {
    this.bodies.forEach((body, i) => body.show(rows[i], forces));
  }
}
