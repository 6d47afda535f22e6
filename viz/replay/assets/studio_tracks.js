"use strict";
// A bar for each call, on the lane of what it moves, over the time of the contact strip.

const LEAST_BAR = 0.3; // % of the width

class Tracks {
  constructor(studio) {
    this.studio = studio;
    this.box = document.createElement("div");
    this.box.id = "bars";
    this.box.setAttribute("aria-label", "Calls of the file over time");
  }

  use(data, editor) {
    this.data = data;
    const held = document.activeElement?.dataset?.bar;
    if (this.dragged) return this.follow(editor);
    const lanes = editor.lanes.map((lane) => this.lane(lane, editor)).filter(Boolean);
    this.box.replaceChildren(...lanes);
    if (held !== undefined) this.box.querySelector(`[data-bar="${this.studio.selected ?? held}"]`)?.focus({ preventScroll: true });
    return null;
  }

  lane(lane, { bars }) {
    const own = bars.map((bar, index) => ({ bar, index }))
      .filter(({ bar }) => bar.parts.includes(lane) && bar.name !== "also");
    if (!own.length) return null;
    const row = document.createElement("div");
    row.className = "lane";
    row.append(element("span", { textContent: { trunk: "body", robot: "all" }[lane] ?? lane }));
    const rows = []; // when the last bar of each row ends: bars at once lie below each other
    const strip = element("div");
    for (const { bar, index } of own) {
      let at = rows.findIndex((end) => end <= bar.span[0] + 1e-6);
      if (at < 0) at = rows.push(0) - 1;
      rows[at] = bar.span[2];
      strip.append(this.button(bar, index, at));
    }
    strip.style.setProperty("--rows", rows.length);
    row.append(strip);
    return row;
  }

  button(bar, index, row) {
    const button = element("button");
    button.className = "bar";
    button.dataset.bar = index;
    button.classList.toggle("on", index === this.studio.selected);
    button.classList.toggle("broken", Boolean(bar.broken));
    button.classList.toggle("foreign", !isOwn(bar));
    button.style.setProperty("--row", row);
    const again = bar.runs > 1 ? ` ${bar.number + 1}/${bar.runs}` : "";
    button.append(element("i"), element("span", { textContent: summary(bar) + again }));
    this.place(button, bar.span);
    const where = isOwn(bar) ? `line ${bar.site[0]}` : "in another file";
    button.title = [`${summary(bar)}, ${where}${again ? `, runs ${bar.runs} times` : ""}`, bar.span[1] > bar.span[0] + 0.01 ? "hatched: the trunk shifts over the feet that stay" : "", bar.broken].filter(Boolean).join("\n");
    button.setAttribute("aria-label", button.title);
    if (isOwn(bar) && lengthOf(bar)) button.append(element("em"));
    button.addEventListener("click", () => this.studio.select(index));
    button.addEventListener("keydown", (event) => this.onKey(event, bar, index));
    button.addEventListener("pointerdown", (event) => this.grasp(event, button, bar, index));
    return button;
  }

  place(button, [start, move, end]) {
    const all = (this.dragged ? this.held : this.data).duration;
    button.style.left = `${100 * start / all}%`;
    button.style.width = `${Math.max(100 * (end - start) / all, LEAST_BAR)}%`;
    button.querySelector("i").style.width = `${100 * (move - start) / Math.max(end - start, 1e-6)}%`; // the shift before it
  }

  // The end is dragged to make a call longer, the rest to put it before or behind its neighbour.
  grasp(event, button, bar, index) {
    if (event.button !== 0 || !isOwn(bar)) return;
    const isEdge = event.target.tagName === "EM";
    const from = event.clientX;
    let offset = 0;
    let value = null;
    button.setPointerCapture(event.pointerId);
    this.dragged = null;
    const move = (now) => {
      offset = now.clientX - from;
      if (Math.abs(offset) < 3 && !this.dragged) return;
      this.dragged = { button, index, isEdge };
      button.classList.add("on");
      if (!isEdge) {
        button.style.transform = `translateX(${offset}px)`;
        return;
      }
      const width = button.parentElement.clientWidth;
      const end = this.snapped(bar.span[2] + offset / width * this.held.duration, width);
      value = durationFor(bar, end);
      this.place(button, [bar.span[0], bar.span[1], bar.span[1] + value / ratio(bar)]);
      this.studio.set(bar, lengthOf(bar).name, value, false);
    };
    this.held = this.data;
    const drop = () => {
      button.removeEventListener("pointermove", move);
      button.style.transform = "";
      const was = this.dragged;
      this.dragged = null;
      if (!was) return;
      this.studio.selected = index;
      if (isEdge) this.studio.set(bar, lengthOf(bar).name, value, true);
      else if (Math.abs(offset) > button.offsetWidth / 2) this.studio.act(offset < 0 ? "earlier" : "later");
    };
    button.addEventListener("pointermove", move);
    button.addEventListener("pointerup", drop, { once: true });
    button.addEventListener("pointercancel", drop, { once: true });
  }

  // While a bar is held, the others move as the draft says.
  follow(editor) {
    for (const button of this.box.querySelectorAll(".bar")) {
      const bar = editor.bars[button.dataset.bar];
      button.classList.toggle("broken", Boolean(bar?.broken));
      if (bar && button !== this.dragged.button) this.place(button, bar.span);
    }
    if (this.dragged.isEdge) this.place(this.dragged.button, editor.bars[this.dragged.index].span);
  }

  // `t` [s], or the beat near it.
  snapped(t, width) {
    const room = SNAP * this.data.duration / width;
    return this.data.header.beats.find((beat) => Math.abs(beat - t) < room) ?? t;
  }

  onKey(event, bar, index) {
    const side = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
    if (side && event.shiftKey && isOwn(bar) && lengthOf(bar)) {
      const slot = lengthOf(bar);
      this.studio.selected = index;
      this.studio.set(bar, slot.name, Math.max(rounded(slot.value + side * NUDGE), NUDGE), true);
    } else if (side && event.altKey) {
      this.studio.selected = index;
      this.studio.act(side < 0 ? "earlier" : "later");
    } else if (side && !event.shiftKey) {
      const order = [...this.box.querySelectorAll(".bar")];
      order[order.indexOf(event.currentTarget) + side]?.focus();
    } else if (event.key === "Delete" || event.key === "Backspace" || event.key.toLowerCase() === "d") {
      this.studio.selected = index;
      this.studio.act(event.key.toLowerCase() === "d" ? "duplicate" : "delete");
    } else return;
    event.preventDefault();
    event.stopPropagation();
  }
}

// How much of its argument (seconds or beats) a call has a second: also where it is made slower later.
function ratio(bar) {
  return lengthOf(bar).value / Math.max(bar.span[2] - bar.span[1], 1e-6);
}

function durationFor(bar, end) {
  return Math.max(rounded(ratio(bar) * (end - bar.span[1])), NUDGE);
}

function rounded(value) {
  return Math.round(value / NUDGE) * NUDGE;
}

// A call in few words: its name, and the words among its arguments.
function summary(bar) {
  const words = bar.slots.filter(({ name, value }) => typeof value === "string" && name !== "ease");
  return [readable(bar.name), ...words.map(({ value }) => value)].join(" ");
}
