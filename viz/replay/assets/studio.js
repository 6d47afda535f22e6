"use strict";
// The studio on the page: what is done with bars and arguments goes to the server as an order, and
// comes back as the motion that the file then makes. The page holds no motion of its own.

const NUDGE = 0.05; // s (beats), what a key makes a call longer or shorter
const SNAP = 8; // px, a bar that ends this near a beat ends on it

class Studio {
  constructor(player) {
    this.player = player;
    this.selected = null; // place in `bars`
    this.isBusy = false;
    this.waiting = null; // the order that is sent when the answer is there; the last one wins
    document.getElementById("app").classList.add("studio");
    this.tools = this.makeTools();
    this.tracks = new Tracks(this);
    this.inspector = new Inspector(this);
    document.getElementById("timeline").before(this.tools, this.tracks.box);
    document.getElementById("sliders").before(this.inspector.box);
    window.addEventListener("keydown", (event) => this.onKey(event));
    window.studio = this; // for scripts and tests
    this.use(player.data.header.editor);
  }

  // Shows what is saved; a call that was just changed or made is chosen.
  use(editor, site = null) {
    this.editor = editor;
    const found = editor.bars.findIndex((bar) => site && bar.site[0] === site[0] && bar.site[1] === site[1]);
    if (found >= 0) this.selected = found;
    else if (this.selected !== null && !editor.bars[this.selected]) this.selected = null;
    this.redraw();
  }

  redraw() {
    const { editor, tools } = this;
    const bar = this.bar();
    tools.querySelector("[data-op=undo]").disabled = !editor.undo;
    tools.querySelector("[data-op=redo]").disabled = !editor.redo;
    for (const op of ["duplicate", "delete", "earlier", "later"]) {
      tools.querySelector(`[data-op=${op}]`).disabled = !isOwn(bar);
    }
    tools.querySelector("b").textContent = editor.file;
    tools.querySelector("[data-ask=mend]").hidden = this.player.data.header.verdict?.ok ?? true;
    this.tracks.use(this.player.data, editor);
    this.inspector.use(bar, editor, this.player.data.header.beats.length > 1 ? "beats" : "s");
  }

  makeTools() {
    const tools = element("div", { id: "studio-tools", className: "buttons" });
    tools.append(element("b"));
    for (const [op, text, hint] of [
      ["undo", "Undo", "Ctrl+Z"], ["redo", "Redo", "Ctrl+Shift+Z"],
      ["duplicate", "Duplicate", "D, on a bar"], ["delete", "Delete", "Delete, on a bar"],
      ["earlier", "Earlier", "Alt+left arrow, on a bar"], ["later", "Later", "Alt+right arrow, on a bar"],
    ]) {
      const button = element("button", { textContent: text, title: hint });
      button.dataset.op = op;
      button.addEventListener("click", () => this.act(op));
      tools.append(button);
    }
    const palette = element("select", { title: "Put a move behind the chosen one, or at the end" });
    palette.setAttribute("aria-label", "Insert a move");
    palette.append(new Option("Insert…", ""));
    palette.append(...this.player.data.header.editor.palette.map((title) => new Option(title)));
    palette.addEventListener("change", () => {
      if (palette.value) this.insert(palette.value);
      palette.value = "";
    });
    for (const [name, text, hint] of [
      ["play", "Play in physics", "MuJoCo plays it beside the plan (B)"],
      ["mend", "Make it possible", "Looks for changes after which the robot can do it"],
    ]) {
      const button = element("button", { textContent: text, title: hint });
      button.dataset.ask = name;
      button.addEventListener("click", () => this[name]());
      tools.append(button);
    }
    const out = element("select", { title: "Write a file beside the motion's" });
    out.setAttribute("aria-label", "Export");
    out.append(new Option("Export…", ""), new Option("Offline page", "html"), new Option("Film", "webp"));
    out.addEventListener("change", () => {
      if (out.value) this.export(out.value);
      out.value = "";
    });
    this.say = element("output", { id: "studio-say" });
    this.say.setAttribute("role", "status");
    this.changes = element("div", { id: "studio-changes", className: "buttons" });
    tools.append(palette, out, this.say, this.changes);
    return tools;
  }

  bar() {
    return this.selected === null ? null : this.editor.bars[this.selected];
  }

  select(index) {
    this.selected = index;
    this.player.scrub(this.editor.bars[index].span[2]);
    this.redraw();
    this.inspector.box.parentElement.scrollTop = 0;
  }

  act(op) {
    if (op === "undo" || op === "redo") return this.send({ op }, true);
    const bar = this.bar();
    if (!isOwn(bar)) return null;
    const { site } = bar;
    const step = { earlier: -1, later: 1 }[op];
    return this.send(step ? { op: "swap", site, step } : { op, site }, true);
  }

  insert(title) {
    const { bars } = this.editor;
    const last = bars.reduce((best, bar, k) => (isOwn(bar) && (best < 0 || bar.span[2] >= bars[best].span[2]) ? k : best), -1);
    const index = isOwn(this.bar()) ? this.selected : last;
    if (index < 0) return;
    this.send({ op: "insert", site: bars[index].site, title }, true);
  }

  // A number or word for an argument of the chosen call; a draft is shown, but not saved. Jumps are
  // solved, which takes up to half a minute: only when they are let go.
  set(bar, name, value, isCommitted) {
    if (!isCommitted && bar.parts.includes("robot")) return;
    this.send({ op: "set", site: bar.site, number: bar.number, name, value }, isCommitted);
  }

  async send(order, isCommitted) {
    if (this.isBusy) {
      if (!this.waiting || !this.waiting.isCommitted || isCommitted) this.waiting = { order, isCommitted };
      return;
    }
    this.isBusy = true;
    this.changes.replaceChildren();
    this.tell(isCommitted ? "saving…" : "checking…");
    const body = JSON.stringify({ ...order, base: this.editor.base, commit: isCommitted });
    let answer;
    try {
      const headers = { "Content-Type": "application/json" };
      answer = await (await fetch(`edit${location.search}`, { method: "POST", headers, body })).json();
    } catch {
      answer = { error: "The studio has ended: nothing was saved." };
    }
    if (answer.data) {
      this.player.use(new ReplayData(await unpack(answer.data), this.player.data.scene));
      this.redrawDraft(this.player.data.header.editor);
    }
    this.tell(answer.error ?? (isCommitted ? "saved" : "not saved yet"), Boolean(answer.error));
    if (answer.error) this.inspector.forget();
    if (answer.error || isCommitted) await this.reload(answer.site);
    if (answer.site && order.op !== "set" && this.selected !== null) this.select(this.selected);
    this.isBusy = false;
    if (this.waiting) {
      const next = this.waiting;
      this.waiting = null;
      this.send(next.order, next.isCommitted);
    }
  }

  // What the server shows now: after a save, or instead of a draft that was refused.
  async reload(site) {
    let answer;
    try {
      answer = await fetch(`data${location.search}`);
    } catch {
      return;
    }
    this.player.use(new ReplayData(await unpack(await answer.text()), this.player.data.scene));
    this.use(this.player.data.header.editor, site);
  }

  // A draft moves bars; their places in the file are those of what is saved.
  redrawDraft(draft) {
    if (draft.bars.length !== this.editor.bars.length) return;
    this.tracks.use(this.player.data, { ...this.editor, bars: draft.bars });
  }

  // The motion that is saved, as MuJoCo plays it; the next edit shows the plan again.
  async play() {
    const answer = await this.ask("play", "playing in MuJoCo…");
    if (!answer.data) return;
    this.player.use(new ReplayData(await unpack(answer.data), this.player.data.scene));
    this.tell("");
    document.getElementById("who").prepend(element("b", {
      textContent: `${answer.told}. `, className: answer.told.startsWith("NOT") ? "bad" : "",
    }));
    this.player.play(true);
  }

  async mend() {
    const { changes } = await this.ask("mend", "looking for changes…");
    if (!changes) return;
    this.tell(changes.length ? "one click, and the robot can do it:" : "no change of tempo, size or height is enough", !changes.length);
    this.changes.replaceChildren(...changes.map(([call, meaning], which) => {
      const button = element("button", { textContent: meaning, title: `appends ${call}` });
      button.addEventListener("click", () => this.send({ op: "change", which }, true));
      return button;
    }));
  }

  async export(kind) {
    let answer = await this.ask("export", "writing…", { kind });
    if (answer.exists && window.confirm(`${answer.exists} is there already: write over it?`)) {
      answer = await this.ask("export", "writing…", { kind, again: true });
    }
    this.tell(answer.told ?? answer.error ?? "nothing was written", Boolean(answer.error));
  }

  // An answer that takes seconds; edits go on meanwhile.
  async ask(what, text, order = {}) {
    const button = this.tools.querySelector(`[data-ask=${what}]`) ?? {};
    button.disabled = true;
    this.tell(text);
    let answer;
    try {
      const headers = { "Content-Type": "application/json" };
      answer = await (await fetch(`${what}${location.search}`, { method: "POST", headers, body: JSON.stringify(order) })).json();
    } catch {
      answer = { error: "The studio has ended." };
    }
    button.disabled = false;
    if (answer.error) this.tell(answer.error, true);
    return answer;
  }

  tell(text, isBad = false) {
    this.say.textContent = text;
    this.say.classList.toggle("bad", isBad);
  }

  onKey(event) {
    if (event.key.toLowerCase() === "b" && !event.ctrlKey && !event.target.matches("input, select")) this.play();
    if (event.key === "Escape" && this.selected !== null) {
      this.selected = null;
      this.waiting = null;
      this.inspector.giveUp();
      if (this.say.textContent === "not saved yet") this.tell("as it is saved");
      this.reload();
    }
    if (!(event.ctrlKey || event.metaKey) || event.key.toLowerCase() !== "z") return;
    if (event.target.matches("input")) return; // of the field itself
    event.preventDefault();
    this.act(event.shiftKey ? "redo" : "undo");
  }
}

// Whether a call stands in the file that is open.
function isOwn(bar) {
  return Boolean(bar) && bar.site[0] > 0;
}

// The argument that says how long a call lasts; of a walk without one, what it would say.
function lengthOf(bar) {
  const slot = bar.slots.find(({ name }) => ["over", "seconds"].includes(name));
  if (slot) return slot.span ? slot : null;
  const takes = bar.more.includes("over") && !bar.parts.includes("robot");
  return takes ? { name: "over", value: bar.span[2] - bar.span[1] } : null;
}

function element(kind, properties = {}) {
  return Object.assign(document.createElement(kind), properties);
}
