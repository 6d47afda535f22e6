"use strict";
// What was in the way: a lane for each leg, in it the limits of the whole-body QP that bound.

const KINDS = { torque: "#a855f7", friction: "#f59e0b", force: "#0ea5e9", joint: "#10b981", contact: "#ec4899" };

// "torque limit of FL_calf" is of a kind and of a leg.
function kindOf(name) {
  return Object.keys(KINDS).find((kind) => name.includes(kind)) || "joint";
}

class Binding extends TimeCanvas {
  constructor(box, data) {
    super(box.querySelector("canvas"), data, 34, 6);
    this.box = box;
    this.line = box.querySelector("p");
    this.use(data);
  }

  use(data) {
    const { legs, binding } = data.header;
    this.box.hidden = !binding;
    this.spans = (binding || []).map(([from, to, name]) => {
      const leg = legs.indexOf((name.split(" of ")[1] || "").slice(0, 2));
      return { from, to, name, leg, color: leg < 0 ? BAD : KINDS[kindOf(name)] };
    });
    super.use(data);
  }

  draw(paint) {
    const { legs } = this.data.header;
    const row = this.height / legs.length;
    const width = this.width - this.left - this.right;
    paint.clearRect(0, 0, this.width, this.height);
    paint.font = `700 ${Math.min(10, row)}px ${FONT}`;
    paint.textBaseline = "middle";
    legs.forEach((leg, k) => {
      paint.fillStyle = MUTED;
      paint.fillText(leg, 4, (k + 0.5) * row + 0.5);
      paint.fillStyle = SOFT;
      paint.fillRect(this.left, k * row, width, row - 2);
    });
    this.inside(paint, () => {
      for (const { from, to, leg, color } of this.spans) {
        const x = this.xAt(from);
        paint.fillStyle = color;
        const [top, height] = leg < 0 ? [0, this.height - 2] : [leg * row, row - 2];
        paint.fillRect(x, top, Math.max(this.xAt(to) - x, 1.5), height);
      }
    });
  }

  show(t) {
    super.show(t);
    const half = 0.5 / this.data.rate;
    const now = this.spans.filter(({ from, to }) => t >= from - half && t <= to + half);
    const key = now.map(({ name }) => name).join(", ");
    if (key === this.key) return;
    this.key = key;
    const item = (text, color) => {
      const span = document.createElement("span");
      span.textContent = text;
      span.style.setProperty("--kind", color);
      return span;
    };
    const told = now.map(({ name, color }) => item(name, color));
    const legend = Object.entries(KINDS).map(([kind, color]) => item(kind, color));
    this.line.replaceChildren(...(now.length ? ["In the way: ", ...told]
      : ["In the way: none ", ...legend]));
    this.line.title = key;
  }

  drawCursor(paint, x) {
    paint.fillStyle = ACCENT;
    paint.fillRect(x - 1, 0, 2, this.height - 2);
  }
}
