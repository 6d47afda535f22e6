"use strict";
// How often the motion is done in random worlds: asked for, told run by run, and kept as a table.

class Certify {
  /** @type {Studio} */ studio;

  constructor(studio) {
    this.studio = studio;
    this.box = element("section", { id: "certified", className: "card", hidden: true });
    this.rows = element("tbody");
    const head = element("tr");
    head.append(...["motion", "world", "done", "95 % interval"].map((word) => element("th", { textContent: word, scope: "col" })));
    const [table, top] = [element("table"), element("thead")];
    top.append(head);
    table.append(top, this.rows);
    this.box.append(element("h2", { textContent: "Certified" }), table);
  }

  async play(runs) {
    const answer = await this.studio.ask("certify", "", { runs: Number(runs) });
    if (!answer.row) return;
    const { motion, n, done, interval: [low, high], world, base, why } = answer.row;
    const told = [readable(motion), world, `${done} of ${n}`, `${percent(low)} to ${percent(high)}`, ...(why ? [why] : [])];
    const row = element("tr", { title: "" });
    row.dataset.base = base;
    row.append(...told.map((text) => element("td", { textContent: text })));
    this.rows.prepend(row);
    this.box.hidden = false;
    this.studio.tell(`certified: done in ${told[2]} runs, 95 % interval ${told[3]}${why && `; ${why}`}`, done < n / 2);
    this.use(this.studio.editor);
  }

  // Whether what is shown stays: beside what was played of the same text its certificate is shown.
  /** @param {ReplayData} data */
  keeps({ header }) {
    const shown = this.studio.player.data.header;
    const { certified } = header.verdict ?? {};
    const [now, then] = [header, shown].map(({ editor: { base, motion, world }, sliders }) => JSON.stringify([base, motion, world, sliders]));
    if (shown.is_plan || !certified || now !== then) return false;
    shown.verdict.certified = certified;
    showTrust(shown.verdict);
    return true;
  }

  // Rows of another text than the present one are pale.
  /** @param {Editor} editor */
  use({ base }) {
    for (const row of this.rows.children) {
      const isOld = /** @type {HTMLElement} */ (row).dataset.base !== base;
      row.classList.toggle("old", isOld);
      /** @type {HTMLElement} */ (row).title = isOld ? "of what the file said then" : "of what the file says now";
    }
  }
}
