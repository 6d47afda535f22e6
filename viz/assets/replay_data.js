"use strict";
// Unpacks the page's data and answers "what was the robot doing at time t".

async function unpackText(id) {
  const packed = atob(document.getElementById(id).textContent.trim());
  const bytes = Uint8Array.from(packed, (letter) => letter.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
  return new Response(stream).arrayBuffer();
}

const ARRAY_TYPES = { Float32Array, Uint32Array, Uint16Array, Int8Array, Uint8Array };

class ReplayData {
  constructor(buffer) {
    const length = new DataView(buffer).getUint32(0, true);
    this.header = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length)));
    this.buffer = buffer;
    this.start = Math.ceil((4 + length) / 8) * 8;
    const { rate, frames } = this.header;
    this.rate = rate;
    this.frames = frames;
    this.duration = (frames - 1) / rate;
    for (const name of ["q", "feet", "com", "target", "forces", "margin", "torque"]) {
      this[name] = this.array(name);
    }
    this.stance = this.array("stance");
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

  clampTime(t) {
    return Math.min(Math.max(t, 0), this.duration);
  }

  // Nearest frame.
  frameAt(t) {
    return Math.min(Math.round(this.clampTime(t) * this.rate), this.frames - 1);
  }

  // Linear interpolation of `count` values starting at `column` of an array with rows of `width`.
  interpolate(values, width, column, count, t, out) {
    const x = this.clampTime(t) * this.rate;
    const row = Math.min(Math.floor(x), this.frames - 2);
    const share = x - row;
    for (let k = 0; k < count; k++) {
      const a = values[row * width + column + k];
      const b = values[(row + 1) * width + column + k];
      out[k] = a + share * (b - a);
    }
    return out;
  }

  labelAt(t) {
    const spans = this.header.labels;
    const found = spans.find((span) => t < span[1]);
    return (found || spans[spans.length - 1])[2];
  }
}
