"use strict";
// What the check says: the verdict, the findings as a list, and what is left to every limit.

const TIGHT_INK = css("tight-ink"), GOOD = "#16a34a";
const ZERO_SHARE = 0.22; // least share of a curve's height below the limit, so that it shows

class VerdictPanel {
  constructor(data, onJump) {
    this.onJump = onJump;
    this.panel = document.getElementById("verdict");
    this.list = document.getElementById("annotations");
    this.rows = document.getElementById("margins");
    this.time = 0;
    this.large = new MarginCurve(document.querySelector("#chosen canvas"), data, true);
    this.large.canvas.addEventListener("pointermove", (event) => this.hover(event));
    this.large.canvas.addEventListener("pointerleave", () => this.readOut(this.time));
    this.large.onScrub(onJump);
    this.use(data);
  }

  use(data) {
    this.data = data;
    const { verdict } = data.header;
    document.getElementById("app").classList.toggle("judged", verdict !== null);
    const badge = document.getElementById("badge");
    const coarse = verdict?.coarse ?? "";
    badge.textContent = verdict ? `${coarse && "coarse: "}${verdict.text}` : "";
    badge.className = verdict ? `badge ${coarse ? "coarse" : verdict.ok ? "good" : "bad"}` : "badge";
    badge.title = coarse;
    if (!verdict) return;
    showTrust(verdict);
    this.list.replaceChildren(...data.annotations.map((annotation) => this.annotationRow(annotation)));
    if (!data.annotations.length) this.list.append(plainText("li", "No limit is broken, no margin is tight.", "calm"));
    const known = new Map(this.sparks?.map((spark) => [spark.curve.name, spark]));
    this.sparks = data.curves.map((curve) => known.get(curve.name) ?? new MarginRow(curve.name, (name) => this.choose(name), this.onJump));
    this.sparks.forEach((spark, k) => {
      spark.use(data, data.curves[k]);
      if (this.rows.children[k] !== spark.row) this.rows.insertBefore(spark.row, this.rows.children[k] ?? null);
    });
    while (this.rows.children.length > this.sparks.length) this.rows.lastChild.remove();
    const kept = data.curves.find((curve) => curve.name === this.chosen);
    const isWorse = data.curves.length && isBroken(data.curves[0]) && !(kept && isBroken(kept));
    this.choose(kept && !isWorse ? kept.name : (data.curves[0] || {}).name);
  }

  annotationRow(annotation) {
    const row = document.createElement("li");
    const button = document.createElement("button");
    button.className = annotation.is_broken ? "annotation broken" : "annotation tight";
    button.title = "Go there";
    const time = plainText("time", `${annotation.time.toFixed(2)} s`);
    const what = plainText("b", `${annotation.limit}: ${readableSubject(annotation.subject)}`);
    button.append(what, time, plainText("span", annotation.text));
    button.addEventListener("click", () => {
      this.onJump(annotation.time);
      this.choose(annotation.limit);
      button.blur();
    });
    row.append(button);
    return row;
  }

  choose(name) {
    const curve = this.data.curves.find((item) => item.name === name);
    document.getElementById("chosen").hidden = !curve;
    if (!curve) return;
    this.chosen = name;
    for (const { row, curve: { name: own } } of this.sparks) {
      row.classList.toggle("on", own === name);
      if (own === name && !document.querySelector(".studio")) row.scrollIntoView({ block: "nearest" });
    }
    document.querySelector("#chosen h2").textContent = name;
    this.large.draws(this.data, curve);
    this.readOut(this.time);
  }

  hover(event) {
    if (event.buttons) return;
    const x = event.clientX - this.large.canvas.getBoundingClientRect().left;
    this.readOut(this.large.timeAt(x));
  }

  // The margin at time t, and whose it is.
  readOut(t) {
    const { curve } = this.large;
    if (!curve) return;
    const k = nearest(curve.time, t);
    const output = document.querySelector("#chosen output");
    const known = Number.isFinite(curve.margin[k]);
    output.textContent = known
      ? `${readableSubject(curve.subjects[curve.worst[k]])}: ${leftOver(curve.margin[k], curve.unit)}` : "–";
    output.classList.toggle("bad", known && curve.margin[k] < 0);
  }

  show(t) {
    this.time = t;
    if (!this.data.header.verdict) return;
    this.large.show(t);
    this.readOut(t);
    for (const spark of this.sparks) spark.show(t);
    this.list.querySelectorAll(".annotation").forEach((button, k) => {
      const now = this.data.annotations[k].spans.some(([from, to]) => t >= from - INSTANT && t <= to + INSTANT);
      button.classList.toggle("now", now);
    });
  }
}

// One line of the list of limits: name, least margin, small curve.
class MarginRow {
  /** @type {any} */ curve;

  constructor(name, onChoose, onJump) {
    this.row = document.createElement("div");
    const button = document.createElement("button");
    button.title = "Show this one large";
    this.least = plainText("span", "");
    button.append(plainText("b", name), this.least);
    button.addEventListener("click", () => {
      onChoose(name);
      button.blur();
    });
    const canvas = document.createElement("canvas");
    this.row.append(button, canvas);
    this.canvas = new MarginCurve(canvas, null, false);
    this.canvas.onScrub((t) => {
      onChoose(name);
      onJump(t);
    });
  }

  use(data, curve) {
    this.curve = curve;
    this.row.className = `margin ${rank(curve)}`;
    this.least.textContent = Number.isFinite(curve.least) ? leftOver(curve.least, curve.unit) : "not possible";
    this.canvas.draws(data, curve);
  }

  show(t) {
    this.canvas.show(t);
  }
}

// What is left to one limit over time; the limit is the red line, below it the limit is broken.
class MarginCurve extends TimeCanvas {
  constructor(canvas, data, isLarge) {
    super(canvas, data, isLarge ? 40 : 2, 2);
    this.isLarge = isLarge;
  }

  draws(data, curve) {
    this.curve = curve;
    this.other = data.proposed?.get(curve.name);
    const both = [curve, this.other ?? curve];
    const high = Math.max(...both.map((one) => one.high), 1e-9);
    const low = Math.min(...both.map((one) => one.low), 0);
    const span = high - low;
    this.high = high + 0.08 * span;
    this.low = Math.min(low - 0.08 * span, -ZERO_SHARE / (1 - ZERO_SHARE) * this.high);
    if (low === 0) this.low = -ZERO_SHARE / (1 - ZERO_SHARE) * this.high;
    this.use(data);
  }

  yAt(value) {
    return 3 + (this.height - 6) * (this.high - value) / (this.high - this.low);
  }

  draw(paint) {
    paint.clearRect(0, 0, this.width, this.height);
    if (!this.curve) return;
    const zero = this.yAt(0);
    paint.fillStyle = "rgba(220, 38, 38, 0.07)";
    paint.fillRect(this.left, zero, this.width - this.left - this.right, this.height - zero);
    if (this.isLarge) drawGrid(paint, this);
    const color = { broken: BAD, tight: TIGHT_INK, fine: ACCENT }[rank(this.curve)];
    this.fillBroken(paint, zero);
    if (this.other) {
      paint.setLineDash([5, 3]);
      this.stroke(paint, GHOST, this.other);
      paint.setLineDash([]);
    }
    this.stroke(paint, color, this.curve);
    paint.strokeStyle = BAD;
    paint.lineWidth = 1;
    paint.setLineDash([4, 3]);
    line(paint, this.left, zero, this.width - this.right, zero);
    paint.setLineDash([]);
  }

  fillBroken(paint, zero) {
    const { time, margin } = this.curve;
    paint.fillStyle = "rgba(220, 38, 38, 0.35)";
    for (let i = 1; i < time.length; i++) {
      if (!(margin[i] < 0 || margin[i - 1] < 0)) continue;
      const [a, b] = [this.xAt(time[i - 1]), this.xAt(time[i])];
      paint.beginPath();
      paint.moveTo(a, zero);
      paint.lineTo(a, Math.max(this.yAt(margin[i - 1]), zero));
      paint.lineTo(b, Math.max(this.yAt(margin[i]), zero));
      paint.lineTo(b, zero);
      paint.fill();
    }
  }

  // A line; a dot where a value stands alone.
  stroke(paint, color, { time, margin }) {
    paint.strokeStyle = paint.fillStyle = color;
    paint.lineWidth = this.isLarge ? 1.6 : 1.2;
    paint.lineJoin = "round";
    const isKnown = (i) => Number.isFinite(margin[i]);
    const [x, y] = [(i) => this.xAt(time[i]), (i) => this.yAt(margin[i])];
    const alone = (i) => time.length < 3 || !(isKnown(i - 1) || isKnown(i + 1));
    paint.beginPath();
    for (const [from, to] of stretches(time.length, (i) => isKnown(i) && !alone(i))) {
      paint.moveTo(x(from), y(from));
      trace(paint, from, to, x, y);
    }
    paint.stroke();
    for (let i = 0; i < time.length; i++) {
      if (!isKnown(i) || !alone(i)) continue;
      paint.beginPath();
      paint.arc(x(i), y(i), this.isLarge ? 3 : 2, 0, 2 * Math.PI);
      paint.fill();
    }
  }

  drawCursor(paint, x) {
    paint.fillStyle = INK;
    paint.globalAlpha = 0.35;
    paint.fillRect(x - 0.5, 0, 1, this.height);
    paint.globalAlpha = 1;
  }
}

function isBroken(curve) {
  return curve.least < 0;
}

function rank(curve) {
  if (isBroken(curve)) return "broken";
  return curve.least < curve.tight ? "tight" : "fine";
}

function nearest(times, t) {
  let best = 0;
  for (let i = 1; i < times.length; i++) {
    if (Math.abs(times[i] - t) < Math.abs(times[best] - t)) best = i;
  }
  return best;
}

// A margin in words, with three digits.
function leftOver(margin, unit) {
  const size = Number(Math.abs(margin).toPrecision(3)).toString();
  return [size, unit, margin < 0 ? "over" : "left"].filter(Boolean).join(" ");
}

function plainText(tag, text, className = "") {
  const made = document.createElement(tag);
  made.textContent = text;
  if (className) made.className = className;
  return made;
}
