"use strict";
// Which part of the time is shown: zoomed by wheel, keys, buttons or two fingers, moved along with
// the player. Bars, contact strip and music share it.

const LEAST_SHOWN = 0.5; // s
const ZOOM_STEP = 1.4; // of a key or a button
const WHEEL_RATE = 0.0022; // of the logarithm, for a pixel
const LEAST_ROOM = 0.4, ROOM = 0.06; // s, and share of the motion: behind its end, into which the last bar is dragged
const MARGIN_OF_BAR = 0.15; // s around a bar that is zoomed to

class TimeView {
  /** @type {Player} */ player;
  /** @type {() => void} */ onChange;
  /** @type {number} */ from;
  /** @type {number} */ length;
  /** @type {boolean} */ isWhole;
  /** @type {[number, number]} */ pinched;

  constructor(player, onChange) {
    Object.assign(this, { player, onChange, from: 0, length: 0, isWhole: true });
    this.box = element("div", { id: "overview" });
    this.box.setAttribute("role", "scrollbar");
    this.box.setAttribute("aria-label", "Part of the time that is shown");
    this.box.setAttribute("aria-controls", "bars");
    this.box.tabIndex = 0;
    this.thumb = element("div");
    this.box.append(this.thumb);
    this.box.addEventListener("pointerdown", (event) => this.grasp(event));
    this.box.addEventListener("keydown", (event) => {
      const side = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
      if (!side) return;
      this.pan(side * this.length / 5);
      event.preventDefault();
      event.stopPropagation();
    });
  }

  get whole() {
    const { duration } = this.player.data;
    return duration + Math.max(LEAST_ROOM, ROOM * duration);
  }

  // After other data have come: what was fitted stays so.
  use() {
    if (this.isWhole) this.from = 0;
    this.set(this.from, this.isWhole ? this.whole : this.length);
  }

  set(from, length) {
    const { whole } = this;
    this.length = Math.min(Math.max(length, Math.min(LEAST_SHOWN, whole)), whole);
    this.isWhole = this.length >= whole - 1e-9;
    this.from = Math.min(Math.max(from, 0), whole - this.length);
    this.box.hidden = this.isWhole;
    this.thumb.style.left = `${100 * this.from / whole}%`;
    this.thumb.style.width = `${100 * this.length / whole}%`;
    this.box.setAttribute("aria-valuemin", 0);
    this.box.setAttribute("aria-valuemax", (whole - this.length).toFixed(2));
    this.box.setAttribute("aria-valuenow", this.from.toFixed(2));
    if (this.isAsked) return;
    this.isAsked = true; // once a frame
    requestAnimationFrame(() => {
      this.isAsked = false;
      this.onChange();
    });
  }

  // By `factor`, around time `t` or where the player is.
  zoom(factor, t = this.player.time) {
    const middle = Math.min(Math.max(t, this.from), this.from + this.length);
    const length = Math.min(Math.max(this.length / factor, LEAST_SHOWN), this.whole);
    this.set(middle - (middle - this.from) * length / this.length, length);
  }

  pan(seconds) {
    this.set(this.from + seconds, this.length);
  }

  fit() {
    this.set(0, this.whole);
  }

  // To the calls that are chosen.
  show([start, end]) {
    this.set(start - MARGIN_OF_BAR, end - start + 2 * MARGIN_OF_BAR);
  }

  // Has time `t` in view, a page further if need be.
  follow(t) {
    if (this.isWhole) return this.fit(); // what was measured may be longer than the plan
    if (t > this.from + this.length + 1e-6 || t < this.from - 1e-6) this.set(t - 0.1 * this.length, this.length);
  }

  // Wheel and fingers on `box`, whose time begins at `left` px and ends `right` px before its edge.
  listen(box, left, right) {
    const timeAt = (x) => {
      const { left: edge, width } = box.getBoundingClientRect();
      return this.from + (x - edge - left) / Math.max(width - left - right, 1) * this.length;
    };
    box.addEventListener("wheel", (event) => {
      const scrolls = box.scrollHeight > box.clientHeight + 1 && !event.ctrlKey && !event.metaKey;
      const sideways = event.shiftKey ? event.deltaX || event.deltaY : event.deltaX;
      if (Math.abs(sideways) > Math.abs(event.shiftKey ? 0 : event.deltaY)) {
        this.pan(sideways / box.clientWidth * this.length);
      } else if (scrolls) return;
      else this.zoom(Math.exp(-event.deltaY * WHEEL_RATE), timeAt(event.clientX));
      event.preventDefault();
    }, { passive: false });
    const fingers = new Map();
    /** @returns {[number, number]} */
    const spread = () => {
      const [a, b] = [...fingers.values()];
      return [Math.max(Math.abs(a - b), 20), timeAt((a + b) / 2)];
    };
    const gone = (event) => {
      fingers.delete(event.pointerId);
      this.pinched = null;
    };
    box.addEventListener("pointerdown", (event) => {
      if (event.pointerType !== "touch") return;
      fingers.set(event.pointerId, event.clientX);
      if (fingers.size === 2) this.pinched = spread();
    }, true);
    window.addEventListener("pointermove", (event) => {
      if (!fingers.has(event.pointerId)) return;
      const passed = event.clientX - fingers.get(event.pointerId);
      fingers.set(event.pointerId, event.clientX);
      const under = /** @type {HTMLElement} */ (event.target);
      if (fingers.size === 1 && under.closest(".lane") && !under.closest(".bar, #music")) {
        this.pan(-passed / box.clientWidth * this.length); // one finger beside the bars
      }
      if (fingers.size !== 2) return;
      const [now, middle] = spread();
      const [before, held] = this.pinched;
      this.zoom(now / before, middle);
      this.pan(held - middle);
      this.pinched = [now, held];
    });
    window.addEventListener("pointerup", gone);
    window.addEventListener("pointercancel", gone);
  }

  grasp(event) {
    const width = this.box.clientWidth;
    const from = this.from;
    const start = event.clientX;
    this.box.setPointerCapture(event.pointerId);
    if (event.target === this.box) this.set((event.offsetX / width) * this.whole - this.length / 2, this.length);
    const base = event.target === this.box ? this.from : from;
    const move = (now) => this.set(base + (now.clientX - start) / width * this.whole, this.length);
    this.box.addEventListener("pointermove", move);
    this.box.addEventListener("lostpointercapture", () => this.box.removeEventListener("pointermove", move), { once: true });
  }
}
