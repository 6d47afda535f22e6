"use strict";
// The bar of buttons, the motions of the file as tabs, what is said, and the list of keys.

const KEYS = [
  ["Space", "play or pause"], ["L", "to the bars"], ["← →", "the bar before, after; elsewhere a frame back, on"],
  ["↑ ↓", "the lane above, below"], ["Shift + ← →", "choose several"], ["Ctrl + A", "choose all"],
  ["[ ]", "shorter, longer"], ["Alt + ← →", "earlier, later"], ["D", "duplicate"], ["K", "split at the playhead"], [", .", "the playhead 0.05 s back, on"],
  ["Delete", "delete"],
  ["Ctrl + C, X, V", "copy, cut, paste; also into another motion"], ["Ctrl + Z, Y", "undo, redo"],
  ["I", "insert a move"], ["A", "play a motion of the library"], ["E", "to the numbers of the bar"], ["Esc", "as it is saved, nothing chosen"],
  ["+ −", "zoom the time; also wheel or two fingers"], ["0", "all of the time"], ["Z", "zoom to what is chosen"],
  ["H", "onion skins: the robot before and after"],
  ["R", "make it possible: changes, and the nearest motion beside yours"], ["Y, Esc", "take, leave what is proposed"],
  ["B", "play in physics"], ["V", "certify: play it in random worlds, and count"], ["W", "the world that it is checked and played in"], ["T", "tap the tempo"], ["1 2 3 4", "view from the corner, side, front, above"],
  ["N", "to the next limit that is broken or tight"],
];

class Tools {
  /** @type {Studio} */ studio;

  constructor(studio) {
    this.studio = studio;
    this.box = element("div", { id: "studio-tools" });
    this.tabs = element("div", { id: "motions", className: "buttons" });
    this.tabs.setAttribute("role", "tablist");
    this.tabs.setAttribute("aria-label", "Motions of the file");
    this.row = element("div", { className: "buttons row" });
    this.say = element("output", { id: "studio-say" });
    this.say.setAttribute("role", "status");
    this.changes = element("div", { id: "studio-changes", className: "buttons" });
    this.fill(studio);
    this.notes = element("p", { id: "studio-notes" });
    this.show = this.button("do", "show", "Make a show", "Writes a motion that plays the others one after the other, in the order of the file");
    const status = element("div", { id: "studio-status" }); // of one height: bars and buttons stay where they are
    status.append(this.say, studio.doing.line, studio.doing.why);
    this.box.append(this.tabs, this.show, this.robot, studio.world.box, this.row, status, this.changes, this.notes);
  }

  fill(studio) {
    const { palette, exports, runs } = studio.player.data.header.editor;
    this.row.append(
      this.group("History", this.button("op", "undo", "Undo", "Ctrl+Z"), this.button("op", "redo", "Redo", "Ctrl+Y")),
      this.group("Moves",
        this.list("Insert a move", "Insert…", "Puts a move behind the chosen one; with none chosen at the playhead, or at the end while that is at the start (I)", palette, (title) => studio.insert(title)),
        this.button("ask", "library", "Library…", "Plays a motion of the library behind the chosen move, or where Insert would put one (A)"),
        this.button("op", "duplicate", "Duplicate", "Once more, behind it (D)"),
        this.button("do", "split", "Split", "Makes two of a move, at the playhead (K)"),
        this.button("op", "delete", "Delete", "Delete"),
        this.button("op", "earlier", "Earlier", "Before the move that comes before it (Alt+left arrow)"),
        this.button("op", "later", "Later", "Behind the move that comes after it (Alt+right arrow)"),
        this.button("do", "copy", "Copy", "Ctrl+C"), this.button("do", "paste", "Paste", "Behind the chosen move, also in another motion of the file (Ctrl+V)")),
      this.group("Time",
        this.icon("zoomOut", "−", "Show more of the time (-)"), this.icon("zoomIn", "+", "Show less of the time, larger (+); also wheel or two fingers"),
        this.button("do", "fit", "Fit", "Show all of the time (0)"),
        this.button("do", "onion", "Onion skins", "The robot 0.3 and 0.6 s before the playhead, blue, and after it, orange (H)")),
      studio.music.buttons);
    this.robot = this.group("Robot",
      this.button("ask", "play", "Play in physics", "MuJoCo plays it beside the plan (B)"),
      this.button("ask", "mend", "Make it possible", "Looks for changes after which the robot can do it, and for the nearest motion that it can (R)"),
      this.list("Certify", "Certify…", "Plays it in MuJoCo in random worlds around the one that is chosen, and counts how often it is done (V)", runs.map((count) => [String(count), `${count} runs`]), (count) => studio.certify.play(count)),
      this.list("Export", "Export…", "Writes a file beside the motion's", Object.entries(exports), (kind) => studio.export(kind)),
      this.icon("help", "?", "Keys, and the tour (?)"));
  }

  group(name, ...parts) {
    const box = element("div", { className: "buttons" });
    box.setAttribute("role", "group");
    box.setAttribute("aria-label", name);
    box.append(...parts);
    return box;
  }

  button(kind, name, text, hint) {
    const button = element("button", { textContent: text, title: hint });
    button.dataset[kind] = name;
    const { studio } = this;
    const acts = {
      show: () => studio.send({ op: "show" }, true), split: () => studio.split(), onion: () => studio.onion.toggle(), copy: () => studio.copy(), paste: () => studio.paste(), fit: () => studio.view.fit(),
      zoomIn: () => studio.view.zoom(ZOOM_STEP), zoomOut: () => studio.view.zoom(1 / ZOOM_STEP), help: () => this.help(),
    };
    button.addEventListener("click", () => {
      if (kind === "op") studio.act(name);
      else if (name === "library") studio.library.open();
      else if (kind === "ask") studio[name]();
      else acts[name]();
    });
    return button;
  }

  icon(name, text, hint) {
    const button = this.button("do", name, text, hint);
    button.setAttribute("aria-label", hint);
    return button;
  }

  // A list that acts at once, and then shows its title again; of words, or of what they mean and them.
  list(label, title, hint, words, act) {
    const list = element("select", { title: hint });
    list.setAttribute("aria-label", label);
    list.append(new Option(title, ""), ...words.map((word) => (typeof word === "string" ? new Option(word) : new Option(word[1], word[0]))));
    list.addEventListener("change", () => {
      if (list.value) act(list.value);
      list.value = "";
    });
    return list;
  }

  focus(label) {
    this.box.querySelector(`[aria-label="${label}"]`).focus();
  }

  /**
   * @param {Editor} editor
   * @param {any} header
   */
  use(editor, header) {
    const count = this.studio.own().length;
    const enable = (name, isPossible) => {
      this.box.querySelector(`[data-op=${name}], [data-do=${name}]`).disabled = !isPossible;
    };
    enable("undo", editor.undo);
    enable("redo", editor.redo);
    for (const name of ["duplicate", "delete", "earlier", "later", "copy"]) enable(name, count);
    this.notes.textContent = (editor.notes ?? []).join(" ");
    this.box.querySelector("[data-ask=mend]").hidden = header.verdict?.ok ?? true;
    const tabs = editor.motions.map((motion) => {
      const tab = element("button", { textContent: readable(motion), title: `The motion ${motion}() of ${editor.file}` });
      tab.setAttribute("role", "tab");
      tab.setAttribute("aria-selected", motion === editor.motion);
      tab.classList.toggle("on", motion === editor.motion);
      tab.addEventListener("click", () => motion !== this.studio.editor.motion && this.studio.open(motion));
      return tab;
    });
    this.show.hidden = tabs.length < 2;
    const name = element("b", { textContent: editor.file });
    name.setAttribute("role", "presentation");
    if (this.shape === `${editor.motion} ${editor.motions}`) return;
    this.shape = `${editor.motion} ${editor.motions}`;
    this.tabs.replaceChildren(...tabs);
    this.tabs.before(name);
    this.box.querySelectorAll(":scope > b").forEach((old) => old !== name && old.remove());
  }

  // Changes that are proposed, each with a button that makes it.
  offer(changes) {
    this.changes.replaceChildren(...buttonsOf(changes).children);
  }

  get told() {
    return this.say.textContent;
  }

  tell(text, isBad) {
    this.say.textContent = this.say.title = text;
    this.say.classList.toggle("bad", isBad);
  }

  help() {
    const dialog = element("dialog", { id: "keys" });
    dialog.setAttribute("aria-label", "Keys");
    const list = element("dl");
    for (const [key, what] of KEYS) list.append(element("dt", { textContent: key }), element("dd", { textContent: what }));
    const [tour, close] = ["Take the tour", "Close"].map((textContent) => element("button", { textContent }));
    tour.addEventListener("click", () => {
      dialog.close();
      this.studio.tour.start();
    });
    close.addEventListener("click", () => dialog.close());
    const buttons = element("div", { className: "buttons" });
    buttons.append(tour, close);
    dialog.append(element("h2", { textContent: "Keys" }), list, buttons);
    dialog.addEventListener("close", () => dialog.remove());
    document.body.append(dialog);
    dialog.showModal();
  }
}

function buttonsOf(changes) {
  const box = element("div", { className: "buttons" });
  box.append(...changes.map(({ text, hint, act, peek, unpeek }) => {
    const button = element("button", { textContent: text, title: hint });
    button.addEventListener("click", act);
    for (const kind of peek ? ["pointerenter", "focus"] : []) button.addEventListener(kind, peek);
    for (const kind of peek ? ["pointerleave", "blur"] : []) button.addEventListener(kind, unpeek);
    return button;
  }));
  return box;
}
