"use strict";
// What goes on meanwhile, with a way to end it; and why a bar is red, where it is seen.

const LAST_CALL = "All home"; // of the palette; the server says where it is missing
const HOME_FIRST = "All home before it"; // in what the server says of a move that starts at home
const LINGERS = 400; // ms, so long it stays after the last word of it

class Doing {
  /** @type {Studio} */ studio;

  constructor(studio) {
    this.studio = studio;
    this.asked = ""; // in words, what is solved
    this.line = element("p", { id: "studio-doing", hidden: true });
    this.text = element("span");
    this.bar = element("progress");
    this.bar.setAttribute("aria-label", "How far it is");
    this.rate = element("span", { className: "rate" });
    const button = element("button", { textContent: "Cancel", title: "Ends it; the motion stays as it was (Esc)" });
    button.addEventListener("click", () => this.cancel());
    this.line.append(this.text, this.rate, this.bar, button);
    this.why = element("p", { id: "studio-why", hidden: true });
  }

  get isOn() {
    return !this.line.hidden;
  }

  // What the server tells of the process that edits, of the one that plays, and of those that count.
  /** @param {Record<string, { what: string, done: number, whole: number, rate: [number, number, number] | null }>} doing */
  use({ edit, play, certify }) {
    const told = edit ?? play ?? certify;
    clearTimeout(this.leaving);
    if (!told) {
      this.leaving = setTimeout(() => { this.line.hidden = true; }, LINGERS);
      return;
    }
    const { what, done, whole, rate } = told;
    const [good, low, high] = rate ?? [0, 0, 1];
    this.rate.replaceChildren(...(rate ? [rateBar([[low, high, "interval"], [good / done, good / done, "rate"]])] : []));
    this.line.hidden = false;
    this.text.textContent = {
      loading: "loading the robot, once…",
      nearing: `looking for the nearest motion, ${done.toFixed(1)} s of at most ${whole.toFixed(0)} s`,
      solving: `${this.asked || "Jump"}: looking for a way to do it, ${done.toFixed(1)} s of at most ${whole.toFixed(0)} s`,
      certifying: rate ? `done in ${good} of ${done} runs, of ${whole}; 95 % interval ${percent(low)} to ${percent(high)}` : `${whole} runs in random worlds: robots get ready…`,
      playing: whole ? `playing in MuJoCo, ${done.toFixed(1)} of ${whole.toFixed(1)} s` : "the robot gets ready in MuJoCo…",
    }[what];
    if (whole) this.bar.value = Math.min(done / whole, 1);
    else this.bar.removeAttribute("value");
  }

  async cancel() {
    this.studio.waiting = null;
    await this.studio.post("cancel", {});
  }

  // The reason of the chosen bar, else what is missing at the end with the button that mends it,
  // else the reason of the first bar that is red, or of the motion as a whole.
  /**
   * @param {Editor} editor
   * @param {any[]} annotations
   */
  explain({ bars }, annotations) {
    const { studio } = this;
    const broken = annotations.filter((one) => one.is_broken);
    const end = broken.find((one) => one.text.includes(LAST_CALL));
    const chosen = studio.bar();
    const bar = chosen?.broken ? chosen : end ? null : bars.find((one) => one.broken);
    const [limit] = broken;
    this.why.hidden = !limit;
    if (!limit) return;
    const text = bar ? `${described(bar)[0]}: ${bar.broken}` : end ? `The motion is not over: ${end.text}` : `${limit.limit}, ${limit.subject}: ${limit.text}`;
    const reason = element("button", { textContent: text, title: `${text}\nGo there` });
    reason.addEventListener("click", () => (bar ? studio.select(bars.indexOf(bar)) : studio.player.scrub((end ?? limit).time)));
    this.why.replaceChildren(reason);
    this.why.append(...buttonsOf(this.missing(annotations)).children);
  }

  // The way home, as a button, where a motion ends without it.
  missing(annotations) {
    if (!annotations.some((one) => one.is_broken && one.text.includes(LAST_CALL))) return [];
    const act = () => this.studio.send({ op: "last", title: LAST_CALL }, true);
    return [{ text: `Add ${LAST_CALL}`, hint: "Puts the call at the end of the motion", act }];
  }

  // What has to start at home gets a button that inserts the way there before it.
  /**
   * @param {Order} order
   * @param {string} error
   */
  refused({ op, title, name }, error) {
    const { studio } = this;
    studio.inspector.forget();
    if (!error.includes(HOME_FIRST)) return;
    const next = () => (op === "insert" ? studio.insert(title) : studio.playBehind(name));
    studio.tools.offer([{
      text: `${LAST_CALL}, then ${readable(String(title ?? name))}`, hint: "Inserts both, one after the other",
      act: async () => { await studio.insert(LAST_CALL); next(); },
    }]);
  }

  // Why an order was refused; of a jump and a split also of what.
  /**
   * @param {Order} order
   * @param {string} [error]
   */
  worded(order, error) {
    const bar = this.studio.editor.bars.find((one) => isAt(one, /** @type {[number, number]} */ (order.site ?? [0, 0])));
    const isOf = bar && (order.op === "split" || bar.parts.includes("robot"));
    if (error && order.op === "insert") return `${order.title}: ${error}`;
    return error && isOf ? `${order.op === "split" ? described(bar)[0] : this.asked}: ${error}` : error;
  }

  // After a jump that was not found: the most of its number that is, with a button that takes it.
  /** @param {Order} order */
  async findMost(order) {
    const { studio, asked } = this;
    const { base, bars } = studio.editor;
    const bar = bars.find((one) => isAt(one, /** @type {[number, number]} */ (order.site)));
    if (!bar) return;
    const told = studio.tools.told;
    studio.tell(`${told} Looking for the most that can be done…`, true);
    const { highest, error } = await studio.post("highest", order);
    if (studio.editor.base !== base || studio.isBusy) return; // something else was done meanwhile
    if (error || highest === null) return studio.tell(error ? told : `${told} Nothing above what it is was found either.`, true);
    const name = String(order.name);
    const most = this.asking(bar, { [name]: highest });
    studio.tell(`${asked} is too much. The most that was found: ${most}.`, true);
    studio.tools.offer([{ text: most, hint: `${name}=${highest}, in the file`, act: () => studio.set(bar, name, highest, true) }]);
  }

  // A call as it would be, in words.
  /**
   * @param {Bar} bar
   * @param {Record<string, number | string>} values
   */
  asking(bar, values) {
    const known = Object.fromEntries(Object.entries(values).map(([name, value]) => {
      const isAngle = bar.slots.find((slot) => slot.name === name)?.is_angle ?? ANGLE_NAMES.includes(name);
      return [name, isAngle && typeof value === "number" ? value * Math.PI / 180 : value];
    }));
    return described({ ...bar, values: { ...bar.values, ...known } })[0];
  }
}
