"use strict";
// The arguments of the chosen call: numbers with their units, words, and what is computed.

const DRAFT_REST = 60; // ms after the last key that a draft is shown

class Inspector {
  /** @type {Studio} */ studio;
  /** @type {Bar} */ bar;

  constructor(studio) {
    this.studio = studio;
    this.box = element("section", { id: "inspector", className: "card" });
    this.box.append(element("h2"), element("div"));
  }

  /**
   * @param {Bar} bar
   * @param {Editor} editor
   * @param {string} timeUnit
   * @param {number} count
   */
  use(bar, editor, timeUnit, count) {
    if (this.box.contains(document.activeElement) && bar && this.shape === shapeOf(bar)) {
      return this.refresh(bar);
    }
    this.shape = bar ? shapeOf(bar) : "";
    const [title, rows] = this.box.children;
    if (!bar) {
      title.textContent = "Choose a bar, or insert a move";
      return rows.replaceChildren();
    }
    const times = bar.runs > 1 ? `, runs ${bar.runs} times` : "";
    this.more = count > 1 ? ` and ${count - 1} more` : "";
    const where = isOwn(bar) ? `line ${bar.site[0]}${times}` : `in ${placeOf(bar)}`;
    title.replaceChildren(element("b", { textContent: described(bar)[0] + this.more }), ` ${bar.name}(), ${where}`);
    rows.replaceChildren(...bar.slots.map((slot) => this.row(bar, slot, editor, timeUnit)));
    if (!isOwn(bar)) rows.append(element("p", { textContent: elsewhere(bar, editor.bars) }));
    if (bar.is_idle) rows.append(element("p", { className: "idle", textContent: `It ${IDLE}.` }));
    if (bar.broken) rows.append(element("p", { className: "broken", textContent: bar.broken }));
    if (isOwn(bar) && bar.more.length) rows.append(this.adder(bar, editor));
    this.offer(bar, rows);
    return null;
  }

  // Ways to make what is computed a number of its own, asked for where there is such.
  async offer(bar, rows) {
    const { shape } = this;
    if (isOwn(bar) && bar.runs < 2 && bar.slots.every((slot) => slot.span)) return;
    const offers = await this.studio.proposals.of(bar);
    if (shape === this.shape && offers.length) rows.append(buttonsOf(offers));
  }

  // What is typed is not meant: leaving the field would save it.
  giveUp() {
    this.isGivenUp = true;
    clearTimeout(this.resting);
    /** @type {HTMLElement} */ (document.activeElement).blur();
    this.isGivenUp = false;
    this.forget();
  }

  focus() {
    const field = this.box.querySelector("input, select");
    field?.focus();
    field?.select?.();
  }

  // The next call is shown anew, whatever is typed into.
  forget() {
    this.shape = "";
  }

  // While a hand is at it, before the server has answered.
  follow(values) {
    for (const [name, value] of Object.entries(values)) {
      const input = this.box.querySelector(`[data-slot="${name}"]`);
      if (input && input !== document.activeElement) input.value = shownAs(value, input.dataset.scale);
    }
  }

  // Other values in the same fields; the one that is typed into stays.
  /** @param {Bar} bar */
  refresh(bar) {
    this.bar = bar;
    this.entitle(bar);
    this.follow(Object.fromEntries(bar.slots.map(({ name, value }) => [name, value])));
  }

  // What the call does with the values that it has now.
  /** @param {Bar} [bar] */
  entitle(bar) {
    const title = this.box.querySelector("h2 b");
    if (bar && title) title.textContent = described(bar)[0] + this.more;
  }

  /**
   * @param {Bar} bar
   * @param {Slot} slot
   * @param {Editor} editor
   * @param {string} timeUnit
   */
  row(bar, slot, editor, timeUnit) {
    this.bar = bar;
    const row = element("label");
    const [name, hint = ""] = ARGUMENTS[slot.name] ?? [readable(slot.name), ARGUMENTS[slot.of]?.[1]];
    const [unit, scale, digits] = unitOf(slot, timeUnit);
    row.title = [`${slot.name}: ${hint || name.toLowerCase()}`, unit && `in ${unitName(unit)}`].filter(Boolean).join(", ");
    row.append(element("span", { textContent: name }));
    if (!slot.span) {
      row.append(element("code", { textContent: slot.code, title: slot.why }), element("small", { textContent: "computed", title: slot.why }));
      return row;
    }
    const isWord = typeof slot.value === "string";
    const words = isWord ? [`${bar.name}.${slot.name}`, slot.name, slot.of].map((key) => editor.words[key]).find(Boolean) : null;
    const input = element(words ? "select" : "input");
    if (words) input.append(...[...new Set([...words, slot.value])].map((word) => new Option(String(word))));
    else Object.assign(input, isWord ? { type: "text" } : { type: "number", step: stepOf(slot) });
    input.dataset.slot = slot.name;
    input.dataset.scale = scale;
    input.value = shownAs(slot.value, scale);
    const value = () => (isWord ? input.value : Number((input.valueAsNumber / scale).toFixed(digits)));
    const send = (isCommitted) => {
      clearTimeout(this.resting);
      if (isWord || Number.isFinite(value())) this.studio.set(this.bar, slot.name, value(), isCommitted);
    };
    input.addEventListener("input", () => {
      clearTimeout(this.resting);
      if (!isWord) this.resting = setTimeout(() => send(false), DRAFT_REST);
    });
    input.addEventListener("change", () => this.isGivenUp || send(true));
    const plays = { true: "this one plays", false: "does not play now" }[String(slot.plays)];
    const note = [plays, unit, slot.place].filter(Boolean).join(" · ");
    row.append(input, element("small", { textContent: note, title: note }));
    return row;
  }

  /**
   * @param {Bar} bar
   * @param {Editor} editor
   */
  adder(bar, editor) {
    const select = element("select", { className: "adder" });
    select.setAttribute("aria-label", "Add an argument");
    select.append(new Option("Add an argument…", ""), ...bar.more.map((name) => new Option(ARGUMENTS[name]?.[0] ?? readable(name), name)));
    select.addEventListener("change", () => {
      const name = select.value;
      if (name) this.studio.set(bar, name, firstValue(bar, name, editor), true);
    });
    return select;
  }
}

/** @param {Bar} bar */
function shapeOf(bar) {
  return JSON.stringify([bar.name, bar.site[0], bar.number, bar.runs, bar.slots.map(({ name, span }) => [name, Boolean(span)])]);
}

function stepOf(slot) {
  return { "°": 1, cm: 0.5 }[unitOf(slot, "s")[0]] ?? 0.05;
}

// A number of the file in the unit of its field.
function shownAs(value, scale) {
  return typeof value === "number" ? Number((value * scale).toPrecision(6)) : value;
}

// What an argument is at first when it is added; angles in degrees.
/**
 * @param {Bar} bar
 * @param {string} name
 * @param {Editor} editor
 */
function firstValue(bar, name, editor) {
  const words = editor.words[`${bar.name}.${name}`] ?? editor.words[name];
  if (words) return words[0];
  if (name === "name") return "here";
  if (["roll", "pitch", "yaw", "angle", "turn"].includes(name)) return 5;
  return LENGTHS.includes(name) ? 0.02 : 0.5;
}
