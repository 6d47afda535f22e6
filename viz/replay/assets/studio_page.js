"use strict";
// The studio on the page: what is done with bars and arguments goes to the server as an order, and
// comes back as the motion that the file then makes. The page holds no motion of its own.

const NUDGE = 0.05; // s, what a key makes a call longer or shorter
const BEAT_NUDGE = 0.25; // beats, the same where the motion counts in beats
const LIFT_AND_DOWN = "Lift and put down"; // of the palette, two calls
const SNAP = 8; // px, a bar that ends this near a beat ends on it

class Studio {
  /** @type {Editor} */ editor;
  /** @type {number} */ selected;
  /** @type {Set<number>} */ chosen;

  constructor(player) {
    this.player = player;
    this.selected = null; // place in `bars` of the bar that is edited
    this.chosen = new Set(); // places of all that are moved, copied or deleted together
    this.isBusy = false;
    this.waiting = null; // the order that is sent when the answer is there; the last one wins
    document.getElementById("app").classList.add("studio");
    this.view = new TimeView(player, () => this.drawTime());
    this.coarse = new Coarse(player.scene.viewer);
    this.tracks = new Tracks(this, this.view);
    this.music = new Music(this);
    this.doing = new Doing(this);
    this.world = new World(this);
    this.tools = new Tools(this);
    this.inspector = new Inspector(this);
    this.proposals = new Proposals(this);
    this.nearest = new Nearest(this);
    this.certify = new Certify(this);
    this.hands = new Hands(this);
    this.onion = new Onion(this);
    this.library = new Library(this);
    document.getElementById("timeline").before(this.tools.box, this.music.box, this.tracks.box, this.view.box);
    document.getElementById("sliders").before(this.nearest.box, this.inspector.box);
    this.charts = player.charts.filter(({ canvas }) => canvas.closest("footer"));
    document.getElementById("trust").after(this.certify.box);
    for (const chart of this.charts) {
      chart.view = this.view;
      chart.left = LANE_LEFT;
      this.view.listen(chart.canvas, LANE_LEFT, LANE_RIGHT);
    }
    player.charts.push(this);
    window.addEventListener("keydown", (event) => this.onKey(event), true);
    window.studio = this; // for scripts and tests
    this.use(player.data.header.editor);
    this.tour = new Tour(this);
  }

  // Shows what is saved, or what the player has got; calls that were just changed or made are chosen.
  /**
   * @param {any} editor
   * @param {[number, number]} site
   */
  use(editor, site = null) {
    if (editor instanceof ReplayData) return this.nearest.use(editor); // as a chart of it: see `show`
    if (!editor?.bars) return;
    const isOther = this.editor && this.editor.motion !== editor.motion;
    this.editor = editor;
    const found = site ? editor.bars.findIndex((bar) => isAt(bar, site)) : -1;
    if (found >= 0) {
      this.choose(this.around(found));
      if (this.made?.isFirst) this.selected = Math.min(...this.chosen);
    }
    else if (isOther) this.choose([]);
    else this.choose([...this.chosen].filter((index) => editor.bars[index]));
    if (isOther) this.view.fit();
    this.redraw();
  }

  // As the player's charts.
  show(t) {
    if (this.player.isPlaying) {
      this.view.follow(t);
      this.coarse.use(true);
    }
    this.tracks.show(t);
    this.hands.show(t);
    this.onion.show(t);
  }

  onScrub() {}

  redraw() {
    const { editor } = this;
    this.view.use();
    this.tools.use(editor, this.player.data.header);
    this.doing.explain(editor, this.player.data.annotations);
    this.tracks.use(this.player.data, editor);
    this.music.use(editor);
    this.world.use(editor);
    this.certify.use(editor);
    this.inspector.use(this.bar(), editor, this.timeUnit, this.chosen.size);
    this.hands.use();
  }

  drawTime() {
    for (const chart of this.charts) chart.paint();
    this.tracks.follow();
    this.music.draw();
  }

  get timeUnit() {
    return this.player.data.header.beats.length > 1 ? "beats" : "s";
  }

  // What lies on the grid: the beats that the motion counts in, or those of the music.
  get beats() {
    const { beats } = this.player.data.header;
    return beats.length > 1 ? beats : this.music.beats;
  }

  bar() {
    return this.selected === null ? null : this.editor.bars[this.selected] ?? null;
  }

  own() {
    return [...this.chosen].sort((a, b) => a - b).map((index) => this.editor.bars[index]).filter(isOwn);
  }

  choose(indexes) {
    this.chosen = new Set(indexes);
    if (!this.chosen.has(this.selected)) this.selected = indexes[indexes.length - 1] ?? null;
  }

  // What the hand is at is what the inspector shows; the picture stays where it is.
  take(index) {
    if (!this.chosen.has(index)) this.choose([index]);
    this.selected = index;
    this.inspector.use(this.bar(), this.editor, this.timeUnit, this.chosen.size);
  }

  // `how` "more" adds a bar to what is chosen, or takes it out.
  select(index, how = "") {
    if (how === "more" && this.chosen.has(index) && this.chosen.size > 1) {
      this.chosen.delete(index);
      this.choose([...this.chosen]);
    } else {
      this.chosen = new Set(how === "more" ? [...this.chosen, index] : [index]);
      this.selected = index;
    }
    this.player.scrub(this.editor.bars[this.selected].span[2]);
    this.redraw();
    this.inspector.box.parentElement.scrollTop = 0;
  }

  // All from one bar to the next, in time.
  extend(from, to) {
    this.chosen.add(from);
    if (this.chosen.has(to)) this.chosen.delete(from);
    this.chosen.add(to);
    this.selected = to;
    this.redraw();
  }

  all() {
    this.choose(this.editor.bars.map((_, index) => index));
    this.redraw();
  }

  // How many bars from `found` on were changed or made by the last order.
  around(found) {
    const { count = 1, isLast } = this.made ?? {};
    const first = isLast ? found - count + 1 : found;
    return Array.from({ length: count }, (_, k) => first + k).filter((index) => this.editor.bars[index]);
  }

  act(op) {
    if (this.doing.isOn && op === "undo") return this.doing.cancel();
    if (op === "undo" || op === "redo") return this.send({ op }, true);
    const bars = this.own();
    const sites = [...new Map(bars.map((bar) => [String(bar.site), bar.site])).values()];
    if (!sites.length) return null;
    const step = { earlier: -1, later: 1 }[op];
    if (step) return this.move(this.order().place + step);
    this.made = { count: op === "delete" ? 0 : sites.length, isLast: true };
    const last = sites[sites.length - 1];
    if (op === "duplicate" && sites.length > 1) return this.send({ op: "copies", sites, site: last }, true);
    const orders = sites.map((site) => ({ op, site }));
    return this.send(orders.length > 1 ? { op: "many", orders } : orders[0], true);
  }

  // The chosen call, or the one that runs there, is made two where the playhead is.
  split() {
    const { time } = this.player;
    const isUnder = ({ span: [start, , end] }) => start < time && time < end;
    const bar = this.own().find(isUnder) ?? this.editor.bars.find((one) => isOwn(one) && isUnder(one)) ?? this.bar();
    if (!bar) return this.tell("put the playhead into a move, to make two of it", true);
    this.made = { count: 2, isLast: true };
    return this.send({ op: "split", site: bar.site, number: bar.number, time }, true);
  }

  // The calls of the file that are not chosen, by their starts, and before which of them the chosen are.
  order() {
    const sites = new Set(this.own().map((bar) => String(bar.site)));
    const known = new Set();
    const bars = this.editor.bars.filter((bar) => isOwn(bar) && !known.has(String(bar.site)) && known.add(String(bar.site)));
    const others = bars.filter((bar) => !sites.has(String(bar.site)));
    const first = bars.findIndex((bar) => sites.has(String(bar.site)));
    return { others, place: bars.slice(0, Math.max(first, 0)).filter((bar) => others.includes(bar)).length, sites: bars.filter((bar) => !others.includes(bar)).map((bar) => bar.site) };
  }

  // What is chosen goes before the `place`-th of the others.
  move(place) {
    const { others, place: was, sites } = this.order();
    if (place === was || place < 0 || place > others.length || !others.length) return;
    this.made = { count: sites.length, isLast: true };
    const step = Math.abs(place - was) === 1 ? place - was : 0;
    const target = others[Math.max(place - 1, 0)].site;
    this.send({ op: "move", sites, site: target, step, is_ahead: place === 0 }, true);
  }

  async copy(isCut = false) {
    const sites = this.own().map((bar) => bar.site);
    if (!sites.length) return;
    this.copied = sites.length;
    const answer = await this.ask("copy", "copying…", { sites });
    if (answer.told) this.tell(answer.told);
    if (answer.told && isCut) this.act("delete");
  }

  paste() {
    const site = this.placeOfNew();
    this.made = { count: this.copied ?? 1, isLast: true };
    if (site) this.send({ op: "paste", site }, true);
  }

  // A move of the palette; `values` are arguments that differ from what it has at first.
  insert(title, values = {}) {
    const site = this.placeOfNew();
    const isPair = title === LIFT_AND_DOWN; // the first of it is what is pulled
    this.made = { count: isPair ? 2 : 1, isLast: true, isFirst: isPair };
    this.doing.asked = title;
    return this.send(site ? { op: "insert", site, title, values } : { op: "begin", title }, true);
  }

  // A motion of the library; the robot must be at home there.
  playBehind(name) {
    this.made = { count: 1, isLast: true };
    this.send({ op: "library", site: this.placeOfNew() ?? null, name }, true);
  }

  // The call behind which something new is put: the last that is chosen, else the last that has
  // begun where the playhead is, else, with it at the start or on its way, the last of all.
  placeOfNew() {
    const chosen = this.own();
    if (chosen.length) return chosen[chosen.length - 1].site;
    const { time, isPlaying } = this.player;
    const own = this.editor.bars.filter(isOwn).sort((a, b) => a.span[2] - b.span[2]);
    const begun = isPlaying ? [] : own.filter(({ span }) => span[0] < time - 1e-6);
    return (begun.pop() ?? own.pop())?.site;
  }

  // A number or word for an argument of the chosen call; a draft is shown, but not saved. Jumps are
  // solved, which takes up to half a minute: only when they are let go.
  /** @param {Bar} bar */
  set(bar, name, value, isCommitted) {
    this.setMany(bar, { [name]: value }, isCommitted);
  }

  /**
   * @param {Bar} bar
   * @param {Record<string, number | string>} values
   * @param {boolean} isCommitted
   */
  setMany(bar, values, isCommitted) {
    this.inspector.follow(values);
    this.doing.asked = this.doing.asking(bar, values);
    if (!isCommitted && bar.parts.includes("robot")) return;
    const { site, number } = bar;
    const entries = Object.entries(values);
    this.made = { count: 1 };
    if (entries.length > 1) this.send({ op: "set_many", site, number, values }, isCommitted);
    else this.send({ op: "set", site, number, name: entries[0][0], value: entries[0][1] }, isCommitted);
  }

  // All that is chosen, by one step of the clock.
  lengthen(side) {
    const nudge = this.timeUnit === "beats" ? BEAT_NUDGE : NUDGE;
    const orders = this.own().filter(lengthOf).map((bar) => {
      const { name, value } = lengthOf(bar);
      return { op: "set", site: bar.site, number: bar.number, name, value: Math.max(rounded(value + side * nudge, nudge), nudge) };
    });
    this.made = { count: orders.length, isLast: false };
    if (orders.length) this.send(orders.length > 1 ? { op: "many", orders } : orders[0], true);
  }

  // The arguments with which a call ends at `end` [s], or on a beat at most `room` [s] away.
  /**
   * @param {Bar} bar
   * @param {number} end
   * @param {number} room
   */
  lengthFor(bar, end, room) {
    const beat = this.beats.find((one) => Math.abs(one - end) < room);
    const nudge = this.timeUnit === "beats" ? BEAT_NUDGE : NUDGE;
    const exact = ratio(bar) * ((beat ?? end) - bar.span[1]);
    const was = lengthOf(bar).value;
    if (Math.abs(exact - was) < (beat === undefined ? nudge / 2 : 1e-6)) return { [lengthOf(bar).name]: was }; // back again
    const isOff = this.timeUnit === "s" && beat !== undefined; // the song's beats fit no step
    const value = Math.max(isOff ? Math.round(1000 * exact) / 1000 : rounded(exact, nudge), nudge);
    const isAccent = this.music.isSharp && beat !== undefined && bar.name in ACCENTS && bar.more.includes("ease");
    return { [lengthOf(bar).name]: value, ...(isAccent ? { ease: ACCENTS[bar.name] } : {}) };
  }

  /**
   * @param {Order} order
   * @param {boolean} isCommitted
   */
  async send(order, isCommitted) {
    if (this.isBusy) {
      if (!this.waiting || !this.waiting.isCommitted || isCommitted) this.waiting = { order, isCommitted };
      return;
    }
    this.isBusy = true;
    this.coarse.use(!isCommitted);
    this.tools.offer([]);
    this.tell(isCommitted ? "saving…" : "checking…");
    const asked = performance.now();
    const chosen = String([...this.chosen]);
    const answer = await this.post("edit", { base: this.editor.base, ...order, commit: isCommitted });
    if (answer.data) {
      this.player.use(answer.data);
      this.redrawDraft(this.player.data.header.editor);
      this.took = performance.now() - asked; // ms, for scripts that measure
    }
    this.tell(this.doing.worded(order, answer.error) ?? (isCommitted ? "saved" : "not saved yet"), Boolean(answer.error));
    if (answer.error) this.doing.refused(order, answer.error);
    const isSame = String([...this.chosen]) === chosen; // else another bar has been chosen meanwhile
    if (answer.error || isCommitted) await this.reload(isSame ? answer.site : null);
    if (answer.site && !order.op.startsWith("set") && this.selected !== null && this.chosen.size === 1) this.select(this.selected);
    this.tracks.refocus(this.selected);
    this.isBusy = false;
    if (this.waiting) {
      const next = this.waiting;
      this.waiting = null;
      this.send(next.order, next.isCommitted);
    } else if (answer.unsolved !== undefined && order.op === "set") this.doing.findMost(order);
  }

  async post(path, order) {
    try {
      const headers = { "Content-Type": "application/json" };
      const known = this.player.data;
      const body = JSON.stringify({ ...order, has: known.header.version });
      const answer = await fetch(`${path}${location.search}`, { method: "POST", headers, body });
      if (answer.headers.get("Content-Type") === "application/json; charset=utf-8") return await answer.json();
      return patched(await answer.arrayBuffer(), known);
    } catch {
      return { error: "The studio has ended: nothing was saved." };
    }
  }

  // What the server shows now: after a save, or instead of a draft that was refused.
  async reload(site) {
    let data;
    try {
      data = await fetched(this.player.data);
    } catch {
      return;
    }
    if (data !== this.player.data) this.player.use(data);
    this.use(this.player.data.header.editor, site);
  }

  // A draft moves bars; their arguments and places in the file are those of what is saved.
  /** @param {{ bars: Partial<Bar>[] }} draft */
  redrawDraft(draft) {
    if (draft.bars.length !== this.editor.bars.length) return;
    this.view.use();
    const bars = draft.bars.map((bar, index) => ({ ...this.editor.bars[index], ...bar }));
    this.tracks.use(this.player.data, { ...this.editor, bars });
    this.hands.use(bars[this.selected]);
    this.inspector.entitle(bars[this.selected]);
  }

  // The motion that is saved, as MuJoCo plays it; the next edit shows the plan again.
  async play() {
    const answer = await this.ask("play", "playing in MuJoCo…");
    if (!answer.data) return;
    this.player.use(answer.data);
    this.tell("");
    document.getElementById("who").prepend(element("b", {
      textContent: `${answer.told}. `, className: answer.told.startsWith("NOT") ? "bad" : "",
    }));
    this.player.play(true);
  }

  mend() {
    return this.nearest.mend();
  }

  async export(kind) {
    const song = this.music.song?.name ?? null; // a film has no sound
    let answer = await this.ask("export", "writing…", { kind, song });
    if (answer.exists && window.confirm(`${answer.exists} is there already: write over it?`)) {
      answer = await this.ask("export", "writing…", { kind, song, again: true });
    }
    if (!answer.file) return this.tell(answer.error ?? "nothing was written", Boolean(answer.error));
    const link = element("a", { textContent: answer.file, href: `files/${encodeURIComponent(answer.file)}${location.search}`, target: "_blank" });
    const [before, after] = answer.told.split(answer.file);
    this.tell(before);
    this.tools.say.append(link, ` in ${answer.folder}`, after);
    if (answer.then) this.tools.say.append("; next: ", element("code", { textContent: answer.then }));
  }

  // Another motion of the file; what was copied can be pasted there.
  async open(motion) {
    const answer = await this.ask("choose", `opening ${motion}…`, { motion });
    if (answer.error) return;
    this.tell("");
    await this.reload();
  }

  // An answer that takes seconds; edits go on meanwhile.
  async ask(what, text, order = {}) {
    const button = this.tools.box.querySelector(`[data-ask=${what}]`) ?? {};
    button.disabled = true;
    this.tell(text);
    const answer = await this.post(what, order);
    button.disabled = false;
    if (answer.error) this.tell(answer.error, true);
    return answer;
  }

  tell(text, isBad = false) {
    this.tools.tell(text, isBad);
  }

  // Back to what is saved, nothing chosen.
  giveUp() {
    this.choose([]);
    this.waiting = null;
    this.inspector.giveUp();
    if (this.tools.told === "not saved yet") this.tell("as it is saved");
    this.reload();
  }

  onKey(event) {
    const key = event.key.toLowerCase();
    const isTyping = event.target.matches("input, select, textarea");
    const isCommand = event.ctrlKey || event.metaKey;
    if (document.querySelector("dialog[open]")) return;
    if (event.key === "Escape" && this.nearest.isOn) return void this.nearest.leave();
    if (event.key === "Escape" && this.doing.isOn) return void this.doing.cancel();
    if (event.key === "Escape" && this.selected !== null) return void this.giveUp();
    if (isTyping || (!isCommand && event.altKey)) return;
    const bare = {
      b: () => this.play(), "+": () => this.view.zoom(ZOOM_STEP), "=": () => this.view.zoom(ZOOM_STEP),
      "-": () => this.view.zoom(1 / ZOOM_STEP), 0: () => this.view.fit(), z: () => this.zoomToChosen(),
      t: () => this.music.tap(), i: () => this.tools.focus("Insert a move"), "?": () => this.tools.help(),
      e: () => this.inspector.focus(), l: () => this.focusBars(), k: () => this.split(),
      h: () => this.onion.toggle(), a: () => this.library.open(), w: () => this.world.open(),
      v: () => this.tools.focus("Certify"), r: () => this.mend(), ...(this.nearest.isOn ? { y: () => this.nearest.take() } : {}),
      ",": () => this.nudge(-1), ".": () => this.nudge(1),
    };
    const commanded = {
      z: () => this.act(event.shiftKey ? "redo" : "undo"), y: () => this.act("redo"), a: () => this.all(),
      c: () => this.copy(), x: () => this.copy(true), v: () => this.paste(),
    };
    const act = (isCommand ? commanded : bare)[key];
    if (!act || (isCommand && key === "c" && !this.chosen.size)) return;
    act();
    event.preventDefault();
    event.stopPropagation();
  }

  // The playhead a step of the clock on, or back.
  nudge(side) {
    this.player.scrub(rounded(this.player.time + side * NUDGE, NUDGE));
  }

  focusBars() {
    this.tracks.reveal(this.selected ?? 0);
  }

  zoomToChosen() {
    const spans = [...this.chosen].map((index) => this.editor.bars[index].span);
    if (!spans.length) return;
    this.view.show([Math.min(...spans.map(([start]) => start)), Math.max(...spans.map((span) => span[2]))]);
  }
}

function rounded(value, step) {
  return Number((Math.round(value / step) * step).toFixed(6));
}

function element(kind, properties = {}) {
  return Object.assign(document.createElement(kind), properties);
}
