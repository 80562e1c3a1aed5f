// Trials as they move: what is packed in the page, and where that puts fingers and object.

/** Return the columns of numbers that are packed as 16-bit steps: base64, column by column. */
export function unpack({ data, rows, low, step }) {
  const bytes = Uint8Array.from(atob(data), (letter) => letter.charCodeAt(0));
  const view = new DataView(bytes.buffer);
  return low.map((least, c) =>
    Float64Array.from({ length: rows }, (_, r) => least + step[c] * view.getUint16(2 * (c * rows + r), true)),
  );
}

/** Return bytes that are packed as base64. */
export function unpackBytes(data) {
  return Uint8Array.from(atob(data), (letter) => letter.charCodeAt(0));
}

/** What was packed of a trial, unpacked when it is first asked for. */
export class Recorded {
  constructor(trial, hands) {
    this.trial = trial;
    this.hand = hands[trial.hand];
    this.rows = trial.rows;
  }

  get columns() {
    this.unpacked ??= unpack(this.trial.packed);
    return this.unpacked;
  }

  get touching() {
    this.bits ??= unpackBytes(this.trial.contact);
    return this.bits;
  }

  /** Return the time of a row [s], 0 where manipulation begins. */
  time(row) {
    return (row - this.trial.start) * this.trial.period;
  }

  /** Return the row at a time [s], which may lie between two. */
  rowAt(time) {
    return Math.min(Math.max(time / this.trial.period + this.trial.start, 0), this.rows - 1);
  }

  value(column, row) {
    const low = Math.floor(row);
    const high = Math.min(low + 1, this.rows - 1);
    const values = this.columns[column];
    return values[low] + (row - low) * (values[high] - values[low]);
  }
}

/** One trial in the plane. */
export class Motion extends Recorded {
  constructor(trial, hands, objects) {
    super(trial, hands);
    this.object = objects[trial.object];
    this.joints = this.hand.fingers.reduce((count, finger) => count + finger.lengths.length, 0);
    this.straight = trial.angle !== null;
  }

  /** Return the size of a finger's force on the object at a row [N]. */
  force(number, row) {
    const { fx, fy } = this.contact(number, row);
    return Math.hypot(fx, fy);
  }

  /** Return where the object is at a row: x, y [mm] and its angle [rad]. */
  pose(row) {
    return [0, 1, 2].map((k) => this.value(this.joints + k, row));
  }

  /** Return where each link of a finger begins at a row [mm], the angle that it has [rad], and where the tip is. */
  chain(number, row) {
    const finger = this.hand.fingers[number];
    let [x, y] = finger.base;
    let angle = 0;
    const links = finger.lengths.map((length, i) => {
      angle += this.value(finger.first + i, row);
      const found = { x, y, angle };
      x -= length * Math.sin(angle);
      y += length * Math.cos(angle);
      return found;
    });
    return { links, tip: [x, y] };
  }

  /** Return the point of a finger nearest to the object [mm], the force on the object there [N], and whether it touches. */
  contact(number, row) {
    const first = this.joints + 3 + 4 * number;
    const [x, y, fx, fy] = [0, 1, 2, 3].map((k) => this.value(first + k, row));
    return { x, y, fx, fy, held: ((this.touching[Math.floor(row)] >> number) & 1) === 1 };
  }

  /** Return where the object was from its start up to a row: points [mm]. */
  trail(row) {
    const [xs, ys] = [this.columns[this.joints], this.columns[this.joints + 1]];
    const points = [];
    for (let r = this.trial.start; r <= Math.floor(row); r += 1) points.push([xs[r], ys[r]]);
    if (row > this.trial.start) points.push(this.pose(row).slice(0, 2));
    return points;
  }

  /** Return the way along the direction, across it [mm] and the angle turned [deg] since manipulation began. */
  progress(row) {
    const [x0, y0, a0] = this.pose(Math.min(this.trial.start, this.rows - 1));
    const [x, y, a] = this.pose(row);
    const turned = ((a - a0) * 180) / Math.PI;
    if (this.trial.angle === null) return { along: Math.hypot(x - x0, y - y0), across: null, turned };
    const [cos, sin] = [Math.cos((this.trial.angle * Math.PI) / 180), Math.sin((this.trial.angle * Math.PI) / 180)];
    return { along: cos * (x - x0) + sin * (y - y0), across: -sin * (x - x0) + cos * (y - y0), turned };
  }
}
