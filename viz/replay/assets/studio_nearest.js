"use strict";
// The nearest motion that the robot can do, beside one's own until it is taken or left: its ghost,
// its curves, how far it is, and the lines of the file that it changes. A change of all of it is
// seen so while its button is pointed at, or has the focus.

class Nearest {
  /** @type {Studio} */ studio;
  /** @type {ReplayData[]} */ peeked;
  /** @type {number} */ which;

  constructor(studio) {
    Object.assign(this, { studio, peeked: [], which: null }); // what is peeked at, and what was shown
    this.box = element("section", { id: "nearest", className: "card", hidden: true, tabIndex: -1 });
    this.box.setAttribute("aria-label", "Proposal: the nearest motion");
  }

  get isOn() {
    return !this.box.hidden;
  }

  // What is shown from now on; a proposal is over when anything else is.
  /** @param {ReplayData} data */
  use(data) {
    if (!data.proposed) this.box.hidden = true;
    if (!this.peeked.includes(data)) this.peeked = [];
  }

  // The motion with a change that is one of those that were offered, beside one's own.
  /**
   * @param {number} which
   * @param {string} meaning
   */
  async peek(which, meaning) {
    const { studio } = this;
    const { base } = studio.editor;
    this.which = which;
    const { data, error } = await studio.post("beside", { which });
    if (this.which !== which || studio.editor.base !== base || studio.isBusy) return;
    if (error) return studio.tell(error, true);
    this.peeked = [data, this.peeked[1] ?? studio.player.data];
    studio.player.use(data);
    const { text, chance } = data.header.proposal;
    document.getElementById("who").textContent = `Solid: the plan. Blue: ${meaning}; ${text}, chance ${percent(chance, 0)}.`;
    document.querySelector("[data-ghost=ghost]").firstChild.textContent = "Changed";
  }

  // Back to what was shown before.
  unpeek() {
    this.which = null;
    const [, before] = this.peeked;
    if (!before) return;
    this.studio.player.use(before);
    this.peeked = [];
  }

  // What is missing at the end; changes of all of it as buttons; then the nearest motion, which takes
  // longer, beside one's own.
  async mend() {
    const { studio } = this;
    const { editor: { base }, player } = studio;
    if (player.data.header.verdict?.ok) return studio.tell("the robot can do it");
    const home = studio.doing.missing(player.data.annotations); // which has its button beside the reason
    if (home.length && player.data.annotations.filter((one) => one.is_broken).length === 1) {
      /** @type {HTMLElement} */ (studio.doing.why.lastChild).focus();
      return studio.tell("only its way home is missing: one click adds that");
    }
    const { changes } = await studio.ask("mend", "looking for changes…");
    if (!changes || studio.editor.base !== base || studio.isBusy) return null;
    studio.tools.offer(changes.map(([call, meaning], which) => ({
      text: meaning, hint: `appends ${call}`, act: () => studio.send({ op: "change", which }, true),
      peek: () => this.peek(which, meaning), unpeek: () => this.unpeek(),
    })));
    const found = home.length ? "it does not end at home: add that first"
      : changes.length ? "one click, and the robot can do it" : "no change of tempo, size or height is enough";
    studio.tell(`${found}; looking for the nearest motion, too…`);
    return this.look();
  }

  // Looks for it; an edit, and Cancel, end that.
  async look() {
    const { studio } = this;
    const { base } = studio.editor;
    const { told, diff, data, error } = await studio.post("nearest", {});
    if (studio.editor.base !== base || studio.isBusy) return; // something else was done meanwhile
    if (error) return studio.tell(error, true);
    this.which = null; // what a resting pointer asked for meanwhile
    studio.player.use(data);
    this.show(told, diff);
  }

  /**
   * @param {string} told
   * @param {string[]} diff
   */
  show(told, diff) {
    const { studio } = this;
    const { verdict, proposal } = studio.player.data.header;
    studio.tell("beside yours, in blue: the nearest motion that the robot can do");
    const code = element("pre", { tabIndex: 0 });
    code.setAttribute("aria-label", "Lines of the file that it changes");
    const kinds = { "+": "added", "-": "removed" };
    const rows = diff.filter((row) => row[0] in kinds);
    code.append(...rows.map((row) => element("span", { textContent: `${row}\n`, className: kinds[row[0]] })));
    const chances = `Yours: ${verdict.text}. This one: ${proposal.text}, chance ${percent(proposal.chance, 0)}.`;
    const buttons = buttonsOf([
      { text: "Take it (Y)", hint: "writes these lines; Undo takes them back (Y)", act: () => this.take() },
      { text: "Leave it (Esc)", hint: "changes nothing (Esc)", act: () => this.leave() },
    ]);
    this.box.replaceChildren(
      element("h2", { textContent: "Proposal: the nearest motion" }),
      element("p", { textContent: `It is ${told}.` }), element("p", { textContent: chances }), code, buttons);
    this.box.hidden = false;
    this.box.parentElement.scrollTop = 0;
    buttons.querySelector("button").focus();
  }

  take() {
    this.studio.send({ op: "nearest" }, true);
  }

  leave() {
    this.box.hidden = true;
    this.studio.tell("as it is saved");
    this.studio.reload();
  }
}
