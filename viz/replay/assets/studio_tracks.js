"use strict";
// A bar for each call, on the lane of what it moves, over the time that is shown. Only bars in view
// are elements, which stay the same ones as long as they are.

const LEAST_BAR = 4; // px
const LANE_LEFT = 44, LANE_RIGHT = 6; // px, as in the contact strip
const ROW = 22; // px
const AHEAD = 40; // px beyond the edges in which bars are kept
const LABEL_FONT = "600 11px Inter, system-ui, -apple-system, 'Segoe UI', Roboto, Arial, sans-serif";

class Tracks {
  /** @type {Studio} */ studio;
  /** @type {TimeView} */ view;
  /** @type {Editor} */ editor;
  /** @type {Map<string, HTMLElement>} */ made;
  /** @type {Map<string, HTMLElement>} */ strips;
  /** @type {{ bar: Bar, index: number, lane: string, row: number, next: number }[]} */ items;
  /** @type {{ index: number, end?: number }} */ dragged;
  /** @type {number} */ goal;
  /** @type {number} */ time;
  /** @type {boolean} */ isAsked;
  /** @type {string} */ drawn;

  constructor(studio, view) {
    Object.assign(this, { studio, view, items: [], made: new Map(), dragged: null });
    this.box = element("div", { id: "bars" });
    this.box.setAttribute("role", "group");
    this.box.setAttribute("aria-label", "Moves over time");
    this.head = element("i", { className: "playhead" });
    this.mark = element("i", { className: "playhead mark", hidden: true });
    this.goal = null; // where what is dragged would go
    this.ruler = document.createElement("canvas").getContext("2d");
    this.ruler.font = LABEL_FONT;
    this.widths = new Map();
    view.listen(this.box, LANE_LEFT, LANE_RIGHT);
    this.box.addEventListener("pointerdown", (event) => this.onPointer(event));
    this.box.addEventListener("click", (event) => this.onClick(event));
    this.box.addEventListener("keydown", (event) => this.onKey(event));
    new ResizeObserver(() => this.draw()).observe(this.box);
  }

  use(data, editor) {
    this.data = data;
    this.editor = editor;
    this.arrange(editor);
    this.draw();
    this.foresee();
  }

  // Lanes, and in them rows: bars that run at once lie below each other.
  /** @param {Editor} editor */
  arrange({ lanes, bars }) {
    this.items = [];
    const found = [];
    for (const lane of lanes) {
      const ends = [];
      const last = []; // of each row
      bars.forEach((bar, index) => {
        if (!lanesOf(bar).includes(lane) || bar.name === "also") return;
        let row = ends.findIndex((end) => end <= bar.span[0] + 1e-6);
        if (row < 0) row = ends.push(0) - 1;
        ends[row] = bar.span[2];
        if (last[row]) last[row].next = bar.span[0];
        this.items.push(last[row] = { bar, index, lane, row, next: Infinity });
      });
      if (ends.length) found.push([lane, ends.length]);
    }
    const shape = JSON.stringify(found);
    if (shape === this.shape) return;
    this.shape = shape;
    this.made.clear();
    this.strips = new Map();
    const empty = element("p", { textContent: "No moves yet: insert one." });
    const rows = found.map(([lane, count]) => this.lane(lane, count));
    this.box.replaceChildren(...(rows.length ? rows : [empty]), this.head, this.mark);
  }

  lane(lane, rows) {
    const row = element("div", { className: "lane" });
    const [name, hint] = LANE_NAMES[lane] ?? [lane, `The ${LEG_NAMES[lane]} foot`];
    const strip = element("div");
    strip.style.height = `${ROW * rows}px`;
    const { legs, leg_colors: colors } = this.data.header;
    if (legs.includes(lane)) row.style.setProperty("--leg", colors[legs.indexOf(lane)]);
    row.append(element("span", { textContent: name, title: hint }), strip);
    this.strips.set(lane, strip);
    return row;
  }

  // Asked for once a drawing: each answer would lay the page out again.
  measure() {
    this.width = Math.max(this.box.clientWidth - LANE_LEFT - LANE_RIGHT, 1);
  }

  xAt(t) {
    return (t - this.view.from) / this.view.length * this.width;
  }

  // To another part of the time.
  follow() {
    const { from, length } = this.view;
    if (this.drawn !== `${from} ${length}`) this.draw();
  }

  draw() {
    if (!this.data) return;
    this.drawn = `${this.view.from} ${this.view.length}`;
    this.measure();
    const { width } = this;
    const seen = new Set();
    for (const item of this.items) {
      const { bar: { span: [start, , end] }, lane, index } = item;
      const key = `${lane}/${index}`;
      const isNear = this.xAt(end) > -AHEAD && this.xAt(start) < width + AHEAD;
      const old = this.made.get(key);
      if (!isNear && !(old && (old === document.activeElement || this.dragged))) continue;
      seen.add(key);
      const button = old ?? this.make(key, lane, index);
      this.fill(button, item);
      this.place(button, item);
    }
    for (const [key, button] of this.made) {
      if (seen.has(key)) continue;
      button.remove();
      this.made.delete(key);
    }
    this.point(this.studio.player.time);
  }

  make(key, lane, index) {
    const button = element("button", { className: "bar" });
    button.dataset.bar = index;
    button.append(element("i"), element("span"));
    this.made.set(key, button);
    this.strips.get(lane).append(button);
    return button;
  }

  // What a bar says; most answers change few.
  /**
   * @param {HTMLElement & { stamp?: string }} button
   * @param {Tracks["items"][number]} item
   */
  fill(button, { bar, index, row, lane }) {
    const { chosen, selected } = this.studio;
    const isOn = chosen.has(index);
    const [first] = lanesOf(bar);
    const isStop = index === (selected ?? 0) && (lane === first || !this.strips.has(first));
    button.tabIndex = isStop ? 0 : -1;
    const stamp = JSON.stringify([bar.name, bar.values, bar.span, bar.broken, bar.is_idle, isOn, row, bar.site]);
    if (button.stamp === stamp) return;
    button.stamp = stamp;
    button.classList.toggle("on", isOn);
    button.classList.toggle("broken", Boolean(bar.broken));
    button.classList.toggle("idle", bar.is_idle);
    button.classList.toggle("foreign", !isOwn(bar));
    button.setAttribute("aria-pressed", String(isOn));
    button.style.top = `${ROW * row + 1}px`;
    button.title = toldOf(bar, this.editor.bars);
    button.setAttribute("aria-label", button.title.replaceAll("\n", " "));
    const hasEdge = isOwn(bar) && lengthOf(bar);
    const edge = button.querySelector("em");
    if (hasEdge && !edge) button.append(element("em"));
    if (!hasEdge && edge) edge.remove();
  }

  place(button, { bar, next }, [start, move, end] = bar.span) {
    const { width } = this;
    const from = Math.max(this.xAt(start), -AHEAD);
    const to = Math.min(this.xAt(end), width + AHEAD);
    const size = Math.max(to - from, LEAST_BAR);
    button.style.left = `${from}px`;
    button.style.width = `${size}px`;
    button.firstChild.style.width = `${Math.min(Math.max(this.xAt(move) - from, 0), size)}px`; // the shift before it
    const hidden = Math.max(-from, 0); // what of it is left of the view
    const inside = Math.min(to, width) - Math.max(from, 0) - 14;
    const beside = Math.min(this.xAt(next), width) - to - 6;
    const [label, isBeside] = this.label(bar, inside, beside);
    const span = button.children[1];
    if (span.textContent !== label) span.textContent = label;
    span.style.left = isBeside ? `${size}px` : `${hidden}px`;
    button.classList.toggle("beside", isBeside);
  }

  // The longest label for which there is room in a bar, else beside it, else none.
  /**
   * @param {Bar} bar
   * @param {number} inside
   * @param {number} beside
   * @returns {[string, boolean]}
   */
  label(bar, inside, beside) {
    const again = bar.runs > 1 ? ` ${bar.number + 1}/${bar.runs}` : "";
    const [long, brief] = described(bar);
    const texts = [...(bar.is_idle ? [`${long}, ${IDLE}`, `${long}, no change`] : []), long + again, long, brief];
    const fits = (room) => texts.find((text) => this.widthOf(text) <= room);
    const within = fits(inside);
    if (within) return [within, false];
    const next = fits(beside);
    if (next) return [next, true];
    if (inside > 30) return [cut(brief, inside, (text) => this.widthOf(text)), false];
    return [inside > 3 ? SIGNS[brief] ?? "" : "", false];
  }

  widthOf(text) {
    if (!this.widths.has(text)) this.widths.set(text, this.ruler.measureText(text).width);
    return this.widths.get(text);
  }

  // As the player's charts, in the frame in which they are drawn.
  show(t) {
    this.time = t;
    if (this.isAsked) return;
    this.isAsked = true;
    requestAnimationFrame(() => {
      this.isAsked = false;
      this.point(this.time);
    });
  }

  // The line is where it is now.
  point(t) {
    const x = this.xAt(t);
    this.head.hidden = x < 0 || x > this.width;
    this.head.style.transform = `translateX(${LANE_LEFT + x}px)`;
  }

  onClick(event) {
    const index = indexOf(event.target);
    if (index === null) return;
    if (this.isDragDone) this.isDragDone = false;
    else this.studio.select(index, event.shiftKey || event.ctrlKey || event.metaKey ? "more" : "");
  }

  // The end is dragged to make a call longer, the rest to put it between others.
  onPointer(event) {
    const index = indexOf(event.target);
    this.isDragDone = false;
    if (event.button !== 0 || index === null || !event.isPrimary) return;
    const bar = this.editor.bars[index];
    if (!isOwn(bar)) return;
    const button = event.target.closest(".bar");
    const isEdge = event.target.tagName === "EM";
    const from = event.clientX;
    const perSecond = this.width / this.view.length;
    const item = this.items.find((one) => one.index === index && this.made.get(`${one.lane}/${index}`) === button);
    let offset = 0;
    let values = null;
    button.setPointerCapture(event.pointerId);
    const move = (now) => {
      if (this.view.pinched) return;
      offset = now.clientX - from;
      if (Math.abs(offset) < 3 && !this.dragged) return;
      if (!this.dragged) this.studio.take(index);
      this.dragged = { index };
      button.classList.add("held");
      if (!isEdge) {
        button.style.transform = `translateX(${offset}px)`;
        this.aim(now.clientX);
        return;
      }
      const before = values;
      values = this.studio.lengthFor(bar, bar.span[2] + offset / perSecond, SNAP / perSecond);
      const [start, begin] = bar.span;
      this.dragged.end = begin + values[lengthOf(bar).name] / ratio(bar);
      this.place(button, item, [start, begin, this.dragged.end]);
      this.foresee();
      if (JSON.stringify(values) !== JSON.stringify(before)) this.studio.setMany(bar, values, false);
    };
    const drop = () => {
      button.removeEventListener("pointermove", move);
      button.style.transform = "";
      button.classList.remove("held");
      const was = this.dragged;
      const { goal } = this;
      this.dragged = this.goal = null;
      this.mark.hidden = true;
      if (!was) return;
      this.isDragDone = true;
      const { name, value } = lengthOf(bar) ?? {};
      if (isEdge && values[name] === value) this.studio.send({ op: "saved" }, true); // not a digit differs
      else if (isEdge) this.studio.setMany(bar, values, true);
      else if (goal !== null && goal !== this.studio.order().place) this.studio.move(goal);
      else this.draw();
    };
    button.addEventListener("pointermove", move);
    button.addEventListener("pointerup", drop, { once: true });
    button.addEventListener("pointercancel", drop, { once: true });
  }

  // What is shown with the dragged end where it is now, until the server has told what comes of it:
  // within the call all is as much later as it is longer, and behind it by the whole.
  foresee() {
    const { index, end } = this.dragged ?? {};
    if (!end) return;
    const { time, scene } = this.studio.player;
    const [, begin, shown] = this.editor.bars[index].span;
    if (time <= begin) return;
    scene.show(time < end ? begin + (time - begin) * (shown - begin) / (end - begin) : time - end + shown);
  }

  // Before which of the other calls the dragged ones would go, with a mark there.
  aim(clientX) {
    const t = this.view.from + (clientX - this.box.getBoundingClientRect().left - LANE_LEFT) / this.width * this.view.length;
    const { others } = this.studio.order();
    this.goal = others.filter(({ span: [start, , end] }) => (start + end) / 2 < t).length;
    const at = this.goal ? others[this.goal - 1].span[2] : others[0]?.span[0] ?? 0;
    this.mark.hidden = false;
    this.mark.style.transform = `translateX(${LANE_LEFT + this.xAt(at)}px)`;
  }

  onKey(event) {
    const index = indexOf(event.target);
    if (index === null) return;
    const { studio } = this;
    const bar = this.editor.bars[index];
    const side = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
    const key = event.key.toLowerCase();
    if (!studio.chosen.has(index) && !(side && !event.altKey)) studio.choose([index]);
    if (side && event.altKey && event.shiftKey) studio.lengthen(side);
    else if (side && event.altKey) studio.act(side < 0 ? "earlier" : "later");
    else if (side && event.shiftKey && event.ctrlKey) return;
    else if (side && event.shiftKey) this.step(index, side, true);
    else if (side) this.step(index, side, false);
    else if (event.key === "ArrowUp" || event.key === "ArrowDown") this.change(event.target, bar, event.key === "ArrowUp" ? -1 : 1);
    else if (event.key === "[" || event.key === "]") studio.lengthen(event.key === "[" ? -1 : 1);
    else if (event.key === "Delete" || event.key === "Backspace") studio.act("delete");
    else if (key === "d" && !event.ctrlKey && !event.metaKey) studio.act("duplicate");
    else return;
    event.preventDefault();
    event.stopPropagation();
  }

  // To the bar before or after, which is chosen besides if `isMore`.
  step(index, side, isMore) {
    const next = index + side;
    if (!this.editor.bars[next]) return;
    if (isMore) this.studio.extend(index, next);
    else this.studio.selected = next;
    this.reveal(next);
  }

  // To the nearest bar of another lane.
  change(from, bar, side) {
    const lanes = [...this.strips.keys()];
    const at = lanes.findIndex((lane) => this.strips.get(lane).contains(from));
    const middle = (bar.span[0] + bar.span[2]) / 2;
    const away = ({ span }) => Math.abs((span[0] + span[2]) / 2 - middle);
    const lane = lanes[at + side];
    const [best] = this.items.filter((item) => item.lane === lane).sort((a, b) => away(a.bar) - away(b.bar));
    if (!best) return;
    this.studio.selected = best.index;
    this.reveal(best.index, lane);
  }

  // Who works with keys goes on at the bar that was made or changed.
  refocus(index) {
    const focused = indexOf(document.activeElement);
    if (focused !== null && index !== null && focused !== index) this.reveal(index);
  }

  // Focus and view go to a bar.
  reveal(index, lane = lanesOf(this.editor.bars[index]).find((part) => this.strips.has(part))) {
    const [start, , end] = this.editor.bars[index].span;
    const { view } = this;
    if (start < view.from || end > view.from + view.length) view.set((start + end - view.length) / 2, view.length);
    this.draw();
    this.made.get(`${lane}/${index}`)?.focus({ preventScroll: false });
  }
}

function indexOf(target) {
  const button = target.closest?.(".bar");
  return button ? Number(button.dataset.bar) : null;
}

// As much of a text as there is room for.
function cut(text, room, widthOf) {
  let length = text.length;
  while (length > 1 && widthOf(`${text.slice(0, length)}…`) > room) length--;
  return length > 1 ? `${text.slice(0, length)}…` : "";
}

// How much of its argument (seconds or beats) a call has a second: also where it is made slower later.
/** @param {Bar} bar */
function ratio(bar) {
  return lengthOf(bar).value / Math.max(bar.span[2] - bar.span[1], 1e-6);
}

// Where a call is drawn: what all four feet do together is one bar, not four that are alike.
/** @param {Bar} bar */
function lanesOf({ parts }) {
  const feet = Object.keys(LEG_NAMES);
  return feet.every((leg) => parts.includes(leg)) ? [...parts.filter((part) => !feet.includes(part)), "robot"] : parts;
}

// Whether a call stands in the file that is open.
/** @param {Bar} bar */
function isOwn(bar) {
  return Boolean(bar) && bar.site[0] > 0;
}

/**
 * @param {Bar} bar
 * @param {[number, number]} site
 */
function isAt(bar, site) {
  return bar.site[0] === site[0] && bar.site[1] === site[1];
}

// The argument that says how long a call lasts; of a walk without one, what it would say.
/**
 * @param {Bar} bar
 * @returns {{ name: string, value: number }}
 */
function lengthOf(bar) {
  const slot = bar.slots.find(({ name }) => ["over", "seconds"].includes(name));
  if (slot) return slot.span ? { name: slot.name, value: Number(slot.value) } : null;
  const takes = bar.more.includes("over") && !bar.parts.includes("robot");
  return takes ? { name: "over", value: bar.span[2] - bar.span[1] } : null;
}
