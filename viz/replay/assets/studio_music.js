"use strict";
// A song's waveform, beats and bars over the time that is shown, and the tempo that is tapped.

const MUSIC_HEIGHT = 40; // px
const TAP_PAUSE = 2500, LEAST_TAPS = 4, MOST_TAPS = 12; // ms after which tapping begins anew

class Music {
  /** @type {Studio} */ studio;
  /** @type {number[]} */ beats;
  /** @type {Song} */ song;
  /** @type {number[]} */ taps;
  /** @type {number} */ metre;
  /** @type {number} */ downbeat;
  /** @type {boolean} */ isSharp;

  constructor(studio) {
    Object.assign(this, { studio, beats: [], song: null, taps: [], metre: 4, downbeat: 0, isSharp: false });
    this.box = element("div", { id: "music", className: "lane", hidden: true });
    this.canvas = element("canvas");
    this.box.append(element("span", { textContent: "Music", title: "The song, its beats, and longer lines where a bar begins" }), this.canvas);
    this.grid = element("canvas", { id: "grid" }); // over the bars
    this.list = element("select", { title: "A sound file beside the motion's: its beats become the grid, and it plays in step" });
    this.list.setAttribute("aria-label", "Music");
    this.list.addEventListener("change", () => this.choose(this.list.value));
    this.tapper = element("button", { textContent: "Tap", title: "Tap the tempo, four times or more (T)" });
    this.tapper.addEventListener("click", () => this.tap());
    this.first = element("select", { title: "On which beat the first whole bar begins, with a longer line. It is taken from the song's accents; where it is wrong, as behind a pick-up, choose it here" });
    this.first.setAttribute("aria-label", "Bars begin on");
    this.first.addEventListener("change", () => {
      this.downbeat = Number(this.first.value);
      this.draw();
    });
    this.accent = element("button", { textContent: "Accent", title: "What you end on a beat gets the ease with which it is seen there: ease=\"cubic\" for the trunk, \"in\" for a foot that is put down" });
    this.accent.addEventListener("click", () => this.sharpen(!this.isSharp));
    this.sharpen(false);
    this.tempo = element("output", { id: "tempo" });
    this.buttons = element("div", { className: "buttons" });
    this.buttons.setAttribute("role", "group");
    this.buttons.setAttribute("aria-label", "Music and tempo");
    this.buttons.append(this.list, this.tapper, this.first, this.accent, this.tempo);
    studio.view.listen(this.box, LANE_LEFT, LANE_RIGHT);
    new ResizeObserver(() => this.draw()).observe(this.box);
    this.box.addEventListener("pointerdown", (event) => {
      const x = event.clientX - this.canvas.getBoundingClientRect().left;
      studio.player.scrub(studio.view.from + x / this.canvas.clientWidth * studio.view.length);
    });
  }

  /** @param {Editor} editor */
  use({ songs }) {
    const names = ["Music…", ...songs];
    if (this.names !== String(names)) {
      this.names = String(names);
      this.list.replaceChildren(new Option(songs.length ? "Music…" : "No sound file beside it", ""), ...songs.map((name) => new Option(name)));
      this.list.value = this.song?.name ?? "";
    }
    this.draw();
  }

  sharpen(isSharp) {
    this.isSharp = isSharp;
    this.accent.classList.toggle("on", isSharp);
    this.accent.setAttribute("aria-pressed", String(isSharp));
  }

  async choose(name) {
    const { player } = this.studio;
    this.taps = [];
    this.song = null;
    this.beats = [];
    if (name) {
      const answer = await this.studio.ask("music", `listening to ${name}…`, { name });
      if (!answer.beats) this.list.value = "";
      else {
        this.song = { name, ...answer, peaks: bytesOf(answer.peaks) };
        Object.assign(this, { beats: answer.beats, metre: answer.metre, downbeat: answer.downbeat });
        this.sharpen(true);
        this.studio.tell("Accent is on: what you end on a beat gets the ease with which it is seen there");
        player.sound.keep(bytesOf(answer.sound));
      }
    }
    if (!this.song) player.sound.keep(null);
    player.sound.use(player.data);
    this.tellTempo(this.song?.tempo);
    this.studio.redraw();
  }

  // The tempo of the last taps; the grid begins where the playhead was at the first of them.
  tap() {
    const now = performance.now();
    if (this.taps.length && now - this.taps[this.taps.length - 1] > TAP_PAUSE) this.taps = [];
    if (!this.taps.length) this.tapped = this.studio.player.isPlaying ? this.studio.player.time : 0;
    this.taps = [...this.taps, now].slice(-MOST_TAPS);
    if (this.taps.length < LEAST_TAPS) {
      this.tempo.textContent = "tap".concat(".".repeat(this.taps.length));
      return;
    }
    const apart = (this.taps[this.taps.length - 1] - this.taps[0]) / (this.taps.length - 1) / 1000;
    const first = this.tapped % apart;
    const count = Math.floor((this.studio.player.data.duration - first) / apart) + 1;
    Object.assign(this, { beats: Array.from({ length: count }, (_, k) => first + k * apart), metre: 4, downbeat: 0 });
    this.tellTempo(60 / apart);
    this.offerTempo(Math.round(60 / apart));
    this.draw();
  }

  tellTempo(tempo) {
    this.tempo.textContent = tempo ? `${Math.round(tempo)} beats/min` : "";
    const beats = Array.from({ length: this.metre }, (_, k) => new Option(`Bars of ${this.metre}, from beat ${k + 1}`, String(k)));
    this.first.replaceChildren(...beats);
    this.first.value = String(this.downbeat);
  }

  // A file that states its tempo may take the tapped one.
  offerTempo(tempo) {
    const { studio } = this;
    const bar = studio.editor.bars.find((one) => one.name === "bpm" && isOwn(one));
    if (!bar) return;
    studio.tools.offer([{
      text: `Count ${tempo} beats/min`, hint: "changes bpm() in the file",
      act: () => studio.set(bar, "beats_per_minute", tempo, true),
    }]);
  }

  draw() {
    const { view } = this.studio;
    this.box.hidden = this.first.hidden = !this.song && !this.beats.length;
    this.accent.hidden = this.studio.beats.length < 2;
    if (this.box.hidden) {
      this.grid.remove();
      return;
    }
    const width = this.canvas.clientWidth;
    if (!width) return;
    const xAt = (t) => (t - view.from) / view.length * width;
    const paint = fresh(this.canvas, width, MUSIC_HEIGHT);
    if (this.song) this.drawWave(paint, width, view);
    this.drawBeats(paint, xAt, width, 0, MUSIC_HEIGHT);
    const { box } = this.studio.tracks;
    if (this.grid.parentElement !== box) box.append(this.grid);
    const height = [...box.querySelectorAll(".lane")].reduce((sum, lane) => sum + lane.offsetHeight + 3, 0);
    this.drawBeats(fresh(this.grid, width, height), xAt, width, 0, height);
  }

  drawWave(paint, width, view) {
    const { peaks, peak_rate: rate } = this.song;
    paint.fillStyle = css("accent-edge");
    for (let x = 0; x < width; x++) {
      const [from, to] = [x, x + 1].map((at) => (view.from + at / width * view.length) * rate);
      let high = 0;
      for (let k = Math.floor(from); k < Math.max(to, Math.floor(from) + 1); k++) high = Math.max(high, peaks[k] ?? 0);
      const half = high / 255 * (MUSIC_HEIGHT - 4) / 2;
      paint.fillRect(x, MUSIC_HEIGHT / 2 - half, 1, 2 * half);
    }
  }

  // Where they would crowd, only those on which a bar begins.
  drawBeats(paint, xAt, width, top, bottom) {
    const { beats, metre, downbeat } = this;
    if (beats.length < 2) return;
    const apart = (xAt(beats[beats.length - 1]) - xAt(beats[0])) / (beats.length - 1);
    paint.fillStyle = INK;
    beats.forEach((beat, k) => {
      const isFirst = (k - downbeat) % metre === 0;
      const x = xAt(beat);
      if (x < 0 || x > width || (!isFirst && apart < BEAT_ROOM)) return;
      paint.globalAlpha = isFirst ? 0.5 : 0.18;
      paint.fillRect(Math.round(x), top, 1, bottom - top);
    });
    paint.globalAlpha = 1;
  }
}

// A canvas of this size [px], empty, ready to be painted.
function fresh(canvas, width, height) {
  const density = window.devicePixelRatio || 1;
  canvas.width = Math.round(width * density);
  canvas.height = Math.round(height * density);
  canvas.style.height = `${height}px`;
  const paint = canvas.getContext("2d");
  paint.setTransform(density, 0, 0, density, 0, 0);
  return paint;
}

function bytesOf(text) {
  return Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
}
