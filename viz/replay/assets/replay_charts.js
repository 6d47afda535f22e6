"use strict";
// Flat drawings over time: the label strip, the contact strip and the curves.

const [INK, MUTED, LINE, SOFT, ACCENT, BAD] = ["ink", "muted", "line", "soft", "accent", "bad"].map(css);
const FONT = "Inter, system-ui, -apple-system, 'Segoe UI', Roboto, Arial, sans-serif";
const WARN = "#f59e0b", GHOST = "#7c93d6", WRITTEN = "#a8713a";
const BEAT_ROOM = 7; // px, least distance of two lines of the beats
const LANE = 9; // px, height of the strip that shows when limits are broken
const LEG_ALPHA = 0.3; // of a leg's colour behind words
const LABEL_COLORS = IS_DARK.matches ? ["#2a3346", "#3a4458"] : ["#e6eaf1", "#d5dbe6"]; // neither is a leg's

// A canvas with a picture that is drawn once for what it shows, and a cursor drawn over it; at most
// once a frame.
class TimeCanvas {
  /** @type {HTMLCanvasElement} */ canvas;
  /** @type {ReplayData} */ data;
  /** @type {number} */ left;
  /** @type {number} */ right;
  /** @type {number} */ time;
  /** @type {Span} */ view;
  /** @type {string} */ drawn;

  constructor(canvas, data, left, right) {
    Object.assign(this, { canvas, data, left, right, time: 0 });
    this.picture = document.createElement("canvas");
    new ResizeObserver(() => this.resize()).observe(canvas);
  }

  resize() {
    const ratio = window.devicePixelRatio || 1;
    this.width = this.canvas.clientWidth;
    this.height = this.canvas.clientHeight;
    for (const canvas of [this.canvas, this.picture]) {
      canvas.width = Math.round(this.width * ratio);
      canvas.height = Math.round(this.height * ratio);
      canvas.getContext("2d").setTransform(ratio, 0, 0, ratio, 0, 0);
    }
    this.redraw();
  }

  // The part of the time that is shown [s]: all of it, unless a `view` says otherwise.
  get span() {
    return this.view ?? { from: 0, length: this.data.duration };
  }

  xAt(t) {
    const { from, length } = this.span;
    return this.left + (this.width - this.left - this.right) * (t - from) / length;
  }

  timeAt(x) {
    const { from, length } = this.span;
    const share = (x - this.left) / (this.width - this.left - this.right);
    return this.data.clampTime(from + share * length);
  }

  // Draws what may reach beyond the part of the time that is shown.
  inside(paint, draw) {
    paint.save();
    paint.beginPath();
    paint.rect(this.left, 0, this.width - this.left - this.right, this.height);
    paint.clip();
    draw();
    paint.restore();
  }

  show(t) {
    this.time = t;
    if (this.isAsked) return;
    this.isAsked = true;
    requestAnimationFrame(() => this.isAsked && this.paint());
  }

  // Now: all of it if other data, size or time are shown than were, else the cursor alone.
  paint() {
    this.isAsked = false;
    if (!(this.width > 0 && this.height > 0)) return;
    const { from, length } = this.span;
    const shown = `${from} ${length}`;
    if (this.drawn !== shown) this.draw(this.picture.getContext("2d"));
    this.drawn = shown;
    const paint = this.canvas.getContext("2d");
    paint.clearRect(0, 0, this.width, this.height);
    paint.drawImage(this.picture, 0, 0, this.width, this.height);
    const x = this.xAt(this.time);
    if (x > this.left - 1 && x < this.width - this.right + 1) this.drawCursor(paint, x);
  }

  // What is drawn once, and the cursor over it: of each kind of drawing.
  draw(paint) {}

  drawCursor(paint, x) {}

  // Shows other data.
  use(data) {
    this.data = data;
    this.redraw();
  }

  redraw() {
    this.drawn = null;
    this.show(this.time);
  }

  // Calls `scrub(t)` while the pointer is down on the canvas.
  onScrub(scrub) {
    const move = (event) => scrub(this.timeAt(event.clientX - this.canvas.getBoundingClientRect().left));
    this.canvas.addEventListener("pointerdown", (event) => {
      this.canvas.setPointerCapture(event.pointerId);
      move(event);
    });
    this.canvas.addEventListener("pointermove", (event) => event.buttons & 1 && move(event));
  }
}

// Seconds between ticks, so that about `room / 80` fit.
function tickStep(duration, room) {
  const wanted = duration / Math.max(room / 80, 1);
  const base = 10 ** Math.floor(Math.log10(wanted));
  return [1, 2, 5, 10].map((k) => k * base).find((step) => step >= wanted);
}

class Timeline extends TimeCanvas {
  constructor(canvas, data) {
    super(canvas, data, 34, 6);
  }

  draw(paint) {
    paint.clearRect(0, 0, this.width, this.height);
    const [labels, axis] = [22, 18];
    const top = labels + 6 + (this.data.annotations.length ? LANE + 5 : 0);
    const row = (this.height - top - axis) / 4;
    this.drawNames(paint, top, row, labels + 5);
    this.inside(paint, () => {
      this.drawLabels(paint, labels);
      this.drawAnnotations(paint, labels + 5);
      this.data.header.legs.forEach((_, k) => this.drawLeg(paint, k, top + k * row, row - 3));
      this.drawBeats(paint, this.height - axis);
    });
    this.drawAxis(paint, this.height - axis);
  }

  // The beats that the motion counts in: a line for each, a longer and darker one where a bar
  // begins. Where they would crowd, only bars, or every fourth bar (third of a waltz) ... are drawn.
  drawBeats(paint, bottom) {
    const { beats, bar: [metre, downbeat] } = this.data.header;
    if (beats.length < 2) return;
    const apart = (this.xAt(beats[beats.length - 1]) - this.xAt(beats[0])) / (beats.length - 1);
    const every = metre ** Math.max(0, Math.ceil(Math.log(BEAT_ROOM / apart) / Math.log(metre)));
    paint.fillStyle = INK;
    for (let k = downbeat % every; k < beats.length; k += every) {
      const isFirst = (k - downbeat) % (metre * every) === 0;
      const top = isFirst ? 22 : 26;
      paint.globalAlpha = isFirst ? 0.42 : 0.2;
      paint.fillRect(Math.round(this.xAt(beats[k])) - 0.5, top, 1, bottom - top + (isFirst ? 4 : 0));
    }
    paint.globalAlpha = 1;
  }

  drawLabels(paint, height) {
    const { labels, legs, leg_colors: colors } = this.data.header;
    const others = [...new Set(labels.map((span) => span[2]).filter((label) => !legs.includes(label.split(" ")[0])))];
    paint.textBaseline = "middle";
    paint.textAlign = "left";
    for (const [start, end, label] of labels) {
      const [x, room] = [this.xAt(start), this.xAt(end) - this.xAt(start)];
      const width = Math.max(room - Math.min(1.5, 0.2 * room), 0.5);
      const leg = legs.indexOf(label.split(" ")[0]); // "FL up" is of that leg
      paint.fillStyle = leg < 0 ? LABEL_COLORS[others.indexOf(label) % LABEL_COLORS.length] : colors[leg];
      paint.globalAlpha = leg < 0 ? 1 : LEG_ALPHA;
      roundedBox(paint, x, 0, width, height, 5);
      paint.globalAlpha = 1;
      const text = fitted(paint, readable(label), width - 4);
      paint.fillStyle = INK;
      paint.fillText(text, x + Math.min(7, (width - paint.measureText(text).width) / 2), height / 2 + 0.5);
    }
  }

  // When limits are nearly broken (amber) and broken (red).
  drawAnnotations(paint, top) {
    if (!this.data.annotations.length) return;
    paint.fillStyle = SOFT;
    paint.fillRect(this.left, top, this.width - this.left - this.right, LANE);
    const sorted = [...this.data.annotations].sort((a, b) => a.is_broken - b.is_broken);
    for (const { is_broken: isBroken, spans } of sorted) {
      paint.fillStyle = isBroken ? BAD : WARN;
      for (const [from, to] of spans) {
        const width = Math.max(this.xAt(to) - this.xAt(from), 3);
        roundedBox(paint, this.xAt((from + to) / 2) - width / 2, top, width, LANE, 2);
      }
    }
  }

  // What each row is of, to the left of it.
  drawNames(paint, top, row, notes) {
    const { annotations, header: { legs, leg_colors: colors, verdict } } = this.data;
    paint.textAlign = "left";
    paint.textBaseline = "middle";
    paint.font = `700 12px ${FONT}`;
    paint.fillStyle = verdict?.ok ? WARN : BAD;
    if (annotations.length) paint.fillText("!", 9, notes + LANE / 2 + 0.5);
    paint.font = `700 11px ${FONT}`;
    legs.forEach((leg, k) => {
      paint.fillStyle = IS_DARK.matches ? INK : colors[k];
      paint.fillText(leg, 4, top + k * row + (row - 3) / 2 + 0.5);
    });
  }

  // Planned stance as a pale block, measured force as a filled curve in it.
  drawLeg(paint, k, top, height) {
    const { data } = this;
    const color = data.header.leg_colors[k];
    paint.fillStyle = SOFT;
    paint.fillRect(this.left, top, this.width - this.left - this.right, height);
    const half = 0.5 / data.rate;
    paint.globalAlpha = 0.22;
    paint.fillStyle = color;
    for (const [first, last] of stances(data, k)) {
      const from = this.xAt(Math.max(first / data.rate - half, 0));
      const to = this.xAt(Math.min(last / data.rate + half, data.duration));
      paint.fillRect(from, top, to - from, height);
    }
    paint.globalAlpha = 0.9;
    paint.beginPath();
    paint.moveTo(this.left, top + height);
    this.traceForce(paint, data, k, top, height);
    paint.lineTo(this.xAt(data.end), top + height);
    paint.fill();
    paint.globalAlpha = 1;
    if (!data.ghost) return;
    paint.strokeStyle = INK;
    paint.lineWidth = 1;
    paint.beginPath();
    this.traceForce(paint, data.ghost, k, top, height);
    paint.stroke();
  }

  traceForce(paint, run, k, top, height) {
    const share = (i) => Math.min(run.forces[4 * i + k] / this.data.header.force_scale, 1);
    trace(paint, 0, run.frames - 1, (i) => this.xAt(i / run.rate), (i) => top + height * (1 - share(i)));
  }

  drawAxis(paint, top) {
    const { from, length } = this.span;
    const step = tickStep(length, this.width - this.left);
    const digits = Math.max(0, -Math.floor(Math.log10(step)));
    paint.fillStyle = MUTED;
    paint.font = `11px ${FONT}`;
    paint.textBaseline = "top";
    for (let k = Math.ceil(from / step - 1e-9); k * step <= from + length + 1e-9; k++) {
      const x = this.xAt(k * step);
      paint.textAlign = x < this.left + 12 ? "left" : x > this.width - 24 ? "right" : "center";
      paint.fillRect(Math.min(x, this.width - 1), top, 1, 3);
      paint.fillText(`${(k * step).toFixed(digits)} s`, x, top + 5);
    }
  }

  drawCursor(paint, x) {
    paint.fillStyle = ACCENT;
    paint.fillRect(x - 1, 0, 2, this.height - 17);
    paint.beginPath();
    paint.moveTo(x - 6, 0);
    paint.lineTo(x + 6, 0);
    paint.lineTo(x, 8);
    paint.fill();
  }
}

class Curve extends TimeCanvas {
  // `style`: name of a run's values, scale (display unit per SI unit), unit, digits, limit (SI,
  // drawn as a line), least room above and below, isBad(value).
  constructor(card, data, style) {
    super(card.querySelector("canvas"), data, 30, 2);
    this.output = card.querySelector("output");
    this.style = style;
    this.use(data);
  }

  use(data) {
    const { style } = this;
    const runs = [data, ...this.others(data).map(([run]) => run)];
    const finite = runs.flatMap((run) => Array.from(run[style.name]))
      .filter(Number.isFinite).map((v) => v * style.scale);
    if (style.limit !== undefined) finite.push(style.limit * style.scale);
    const low = finite.reduce((a, b) => Math.min(a, b), Infinity);
    const high = finite.reduce((a, b) => Math.max(a, b), -Infinity);
    const room = Math.max((high - low) * 0.08, style.least || 1e-6);
    this.low = Number.isFinite(low) ? low - room : 0;
    this.high = Number.isFinite(high) ? high + room : 1;
    super.use(data);
  }

  // The plan, and what was written, with their colours; of the latter only the movement is known.
  others(data) {
    const written = this.style.name === "height" ? data.written : null;
    return [[data.ghost, GHOST], [written, WRITTEN]].filter(([run]) => run);
  }

  yAt(value) {
    return 6 + (this.height - 14) * (this.high - value) / (this.high - this.low);
  }

  draw(paint) {
    const { style, data } = this;
    paint.clearRect(0, 0, this.width, this.height);
    drawGrid(paint, this);
    if (style.limit !== undefined) {
      paint.strokeStyle = BAD;
      paint.setLineDash([4, 3]);
      this.horizontal(paint, style.limit * style.scale);
      paint.setLineDash([]);
    }
    paint.setLineDash([5, 3]);
    this.others(data).forEach(([run, color]) => this.drawRun(paint, run, color));
    paint.setLineDash([]);
    this.drawRun(paint, data, ACCENT);
  }

  drawRun(paint, run, color) {
    const { name, scale } = this.style;
    paint.strokeStyle = color;
    paint.lineWidth = 1.5;
    paint.lineJoin = "round";
    paint.beginPath();
    const [x, y] = [(i) => this.xAt(i / run.rate), (i) => this.yAt(run[name][i] * scale)];
    for (const [from, to] of stretches(run.frames, (i) => Number.isFinite(run[name][i]))) {
      paint.moveTo(x(from), y(from));
      trace(paint, from, to, x, y);
    }
    paint.stroke();
    paint.lineWidth = 1;
  }

  horizontal(paint, value) {
    const y = Math.round(this.yAt(value)) + 0.5;
    line(paint, this.left, y, this.width - this.right, y);
  }

  show(t) {
    super.show(t);
    const value = this.data[this.style.name][this.data.frameAt(t)];
    const isKnown = Number.isFinite(value);
    this.output.textContent = isKnown
      ? `${(value * this.style.scale).toFixed(this.style.digits)} ${this.style.unit}` : "–";
    this.output.classList.toggle("bad", isKnown && this.style.isBad(value));
  }

  drawCursor(paint, x) {
    paint.fillStyle = INK;
    paint.globalAlpha = 0.35;
    paint.fillRect(x - 0.5, 0, 1, this.height);
    paint.globalAlpha = 1;
    const value = this.data[this.style.name][this.data.frameAt(this.time)] * this.style.scale;
    if (!Number.isFinite(value)) return;
    paint.fillStyle = ACCENT;
    paint.beginPath();
    paint.arc(x, this.yAt(value), 3.5, 0, 2 * Math.PI);
    paint.fill();
  }
}

// A line on through the points from one to another: of those in one column of pixels the first, the
// lowest, the highest and the last, which look as all do.
function trace(paint, from, to, xAt, yAt) {
  let [column, low, high, lastX, lastY] = [NaN, 0, 0, 0, 0];
  const close = () => {
    if (low < high) for (const y of [low, high, lastY]) paint.lineTo(lastX, y);
  };
  for (let i = from; i <= to; i++) {
    const [x, y] = [xAt(i), yAt(i)];
    if (Math.floor(x) !== column) {
      close();
      paint.lineTo(x, y);
      [column, low, high] = [Math.floor(x), y, y];
    }
    [low, high, lastX, lastY] = [Math.min(low, y), Math.max(high, y), x, y];
  }
  close();
}

// Lines and numbers of a canvas with a scale from `low` to `high`.
function drawGrid(paint, chart) {
  const step = tickStep(chart.high - chart.low, chart.height * 2.2);
  const digits = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
  paint.font = `10px ${FONT}`;
  paint.textAlign = "right";
  paint.textBaseline = "middle";
  for (let k = Math.ceil(chart.low / step); k * step <= chart.high; k++) {
    const y = Math.round(chart.yAt(k * step)) + 0.5;
    paint.strokeStyle = LINE;
    line(paint, chart.left, y, chart.width - chart.right, y);
    paint.fillStyle = MUTED;
    paint.fillText((k * step).toFixed(digits), chart.left - 5, Math.min(Math.max(y, 6), chart.height - 5));
  }
}

function line(paint, x0, y0, x1, y1) {
  paint.beginPath();
  paint.moveTo(x0, y0);
  paint.lineTo(x1, y1);
  paint.stroke();
}

function roundedBox(paint, x, y, width, height, radius) {
  const r = Math.min(radius, width / 2);
  paint.beginPath();
  paint.moveTo(x + r, y);
  paint.arcTo(x + width, y, x + width, y + height, r);
  paint.arcTo(x + width, y + height, x, y + height, r);
  paint.arcTo(x, y + height, x, y, r);
  paint.arcTo(x, y, x + width, y, r);
  paint.fill();
}

// As much of a text as fits in `room`, small if need be; sets the font. Two letters say nothing.
function fitted(paint, text, room) {
  for (const size of [11, 9]) {
    paint.font = `600 ${size}px ${FONT}`;
    if (paint.measureText(text).width <= room) return text;
  }
  let length = text.length;
  while (length && paint.measureText(text.slice(0, length)).width > room) length--;
  return length > 2 ? text.slice(0, length) : "";
}

function readable(label) {
  const words = label.replaceAll("_", " ").trim();
  return words.charAt(0).toUpperCase() + words.slice(1);
}
