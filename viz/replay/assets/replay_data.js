"use strict";
// Unpacks the page's data and answers "what was the robot doing at time t".

async function unpack(text) {
  const bytes = Uint8Array.from(atob(text.trim()), (letter) => letter.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
  return new Response(stream).arrayBuffer();
}

function unpackElement(id) {
  return unpack(document.getElementById(id).textContent);
}

const ARRAY_TYPES = { Float32Array, Uint32Array, Uint16Array, Int16Array, Int8Array, Uint8Array };

// A JSON header and named arrays.
class Pack {
  constructor(buffer) {
    const length = new DataView(buffer).getUint32(0, true);
    this.header = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length)));
    this.buffer = buffer;
    this.start = Math.ceil((4 + length) / 8) * 8;
  }

  // A stored array; quantised ones come back as numbers in their unit.
  array(name) {
    const entry = this.header.arrays[name];
    const count = entry.shape.reduce((a, b) => a * b, 1);
    const stored = new ARRAY_TYPES[entry.type](this.buffer, this.start + entry.offset, count);
    if (!entry.low) return stored;
    const columns = entry.low.length;
    const values = new Float32Array(count);
    for (let i = 0; i < count; i += columns) {
      for (let k = 0; k < columns; k++) values[i + k] = entry.low[k] + entry.scale[k] * stored[i + k];
    }
    return values;
  }
}

// One movement at even steps; outside its time the ends are held.
class Run {
  /** @type {number} */ rate;
  /** @type {number} */ frames;
  /** @type {number} */ end;
  /** @type {Float32Array} */ q;

  constructor(pack, prefix, { rate, frames }) {
    Object.assign(this, { rate, frames, end: (frames - 1) / rate });
    for (const name of ["q", "feet", "com", "target", "forces", "stance", "margin", "torque"]) {
      this[name] = pack.array(prefix + name);
    }
    this.height = Float32Array.from({ length: frames }, (_, i) => this.q[19 * i + 2]);
  }

  // Nearest frame.
  frameAt(t) {
    return Math.min(Math.max(Math.round(t * this.rate), 0), this.frames - 1);
  }

  // Linear interpolation of `count` values starting at `column` of an array with rows of `width`.
  interpolate(values, width, column, count, t, out) {
    const x = Math.min(Math.max(t, 0), this.end) * this.rate;
    const row = Math.min(Math.floor(x), this.frames - 2);
    const share = x - row;
    for (let k = 0; k < count; k++) {
      const a = values[row * width + column + k];
      const b = values[(row + 1) * width + column + k];
      out[k] = a + share * (b - a);
    }
    return out;
  }
}

// The movement that is shown, its plan and what was written (or null), and what there is to say.
class ReplayData extends Run {
  constructor(buffer, scene) {
    const pack = new Pack(buffer);
    super(pack, "", pack.header);
    Object.assign(this, { buffer, scene });
    this.header = { ...scene.header, ...pack.header };
    this.ghost = pack.header.ghost ? new Run(pack, "ghost.", pack.header.ghost) : null;
    this.written = pack.header.written ? new Run(pack, "written.", pack.header.written) : null;
    this.duration = Math.max(...[this, this.ghost, this.written].map((run) => (run ? run.end : 0)));
    this.ground = pack.header.ground ? { ...pack.header.ground, heights: pack.array("ground") } : null;
    this.sound = this.header.has_sound ? pack.array("sound") : null; // an MP3 file
    this.annotations = this.header.verdict ? this.header.verdict.annotations : [];
    const curvesOf = (verdict, prefix) => (verdict ? verdict.curves : []).map((curve, k) => ({
      ...curve,
      ...extremes(pack.array(`${prefix}curve${k}.margin`)),
      time: pack.array(`${prefix}curve${k}.time`),
      worst: pack.array(`${prefix}curve${k}.worst`),
    }));
    this.curves = curvesOf(this.header.verdict, "");
    const { proposal } = this.header; // of the ghost, where that is another motion
    this.proposed = proposal ? new Map(curvesOf(proposal, "proposal.").map((curve) => [curve.name, curve])) : null;
  }

  clampTime(t) {
    return Math.min(Math.max(t, 0), this.duration);
  }

  labelAt(t) {
    const spans = this.header.labels;
    const found = spans.find((span) => t < span[1]);
    return (found || spans[spans.length - 1])[2];
  }

  // Broken limits at time t; an instant is widened so that it can be seen in passing.
  brokenAt(t) {
    return this.annotations.filter((annotation) => annotation.is_broken && annotation.spans.some(
      ([from, to]) => t >= from - INSTANT && t <= to + INSTANT));
  }
}

// A margin with its least value (-Infinity where it is not possible), and the least and largest finite.
function extremes(margin) {
  let [least, low, high] = [Infinity, Infinity, -Infinity];
  for (const value of margin) {
    if (value < least) least = value;
    if (!Number.isFinite(value)) continue;
    if (value < low) low = value;
    if (value > high) high = value;
  }
  return { margin, least, low, high };
}

const INSTANT = 0.04; // s
