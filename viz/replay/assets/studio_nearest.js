"use strict";
// The nearest motion that the robot can do, beside one's own until it is taken or left: its ghost,
// its curves, how far it is, and the lines of the file that it changes.

class Nearest {
  /** @type {Studio} */ studio;

  constructor(studio) {
    this.studio = studio;
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
  }

  // Looks for it; an edit, and Cancel, end that.
  async look() {
    const { studio } = this;
    const { base } = studio.editor;
    const { told, diff, data, error } = await studio.post("nearest", {});
    if (studio.editor.base !== base || studio.isBusy) return; // something else was done meanwhile
    if (error) return studio.tell(error, true);
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
