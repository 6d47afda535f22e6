"use strict";
// What else can be done with a call: each way is shown as the lines of the file that it changes, and
// written only then. What is written in another file is shown there.

const SLOWER = 1.2; // what the whole is slowed down by at first, where that is asked for

class Proposals {
  /** @type {Studio} */ studio;

  constructor(studio) {
    this.studio = studio;
  }

  // Buttons for a bar, such as one that writes out its loop.
  /** @param {Bar} bar */
  async of(bar) {
    const { editor } = this.studio;
    const { site, number } = bar;
    const known = { site, number, bar: editor.bars.indexOf(bar), base: editor.base };
    const answer = await this.studio.post("edit", { op: "offers", ...known });
    const offers = /** @type {(Order & { title: string })[]} */ (answer.offers ?? []);
    const buttons = offers.map(({ title, ...order }) => ({
      text: title, hint: "shows first what it changes in the file", act: () => this.propose(title, { value: SLOWER, ...known, ...order }),
    }));
    if (isOwn(bar)) return buttons;
    return [{ text: `Show ${placeOf(bar)}`, hint: bar.file, act: () => this.read({ ...known, op: "read" }) }, ...buttons];
  }

  /**
   * @param {string} title
   * @param {Order} order
   */
  async propose(title, order) {
    const { studio } = this;
    studio.tell("trying…");
    const { diff, fixed, error } = await studio.post("edit", { op: "propose", proposed: order, base: order.base });
    studio.tell(error ?? "", Boolean(error));
    if (error) return;
    const kinds = { "+": "added", "-": "removed", "@": "skipped" };
    const rows = diff.map((row) => [row.startsWith("@") ? "…" : row, kinds[row[0]] ?? ""]);
    const note = fixed.length ? `What is written out does not follow ${fixed.map(readable).join(", ")} any more.` : "The motion stays the same.";
    this.show(title, order.op === "pace" ? "" : note, rows, () => {
      studio.made = { count: 1 };
      studio.inspector.forget();
      studio.send(order, true);
    });
  }

  /** @param {Order} order */
  async read(order) {
    const { text, line, file, error } = await this.studio.post("edit", order);
    if (error) return this.studio.tell(error, true);
    const rows = text.map((row, index) => [`${String(index + 1).padStart(4)}  ${row}`, index + 1 === line ? "meant" : ""]);
    this.show(file, "", rows);
  }

  // Lines of code in a dialog; `accept` is done by its first button, if there is one.
  /**
   * @param {string} title
   * @param {string} note
   * @param {[string, string][]} rows
   * @param {(() => void)?} accept
   */
  show(title, note, rows, accept = null) {
    const dialog = element("dialog", { id: "proposal" });
    dialog.setAttribute("aria-label", title);
    const code = element("pre", { tabIndex: 0 });
    code.append(...rows.map(([textContent, className]) => element("span", { textContent: `${textContent}\n`, className })));
    const close = { text: accept ? "Leave it as it is" : "Close", hint: "changes nothing (Esc)", act: () => dialog.close() };
    const write = { text: "Write it", hint: "into the file; Undo takes it back", act: () => (dialog.close(), accept()) };
    dialog.append(element("h2", { textContent: title }), element("p", { textContent: note }), code, buttonsOf(accept ? [write, close] : [close]));
    dialog.addEventListener("close", () => dialog.remove());
    document.body.append(dialog);
    dialog.showModal();
    code.querySelector(".meant")?.scrollIntoView({ block: "center" });
  }
}
