"use strict";
// Only in a page that `go2-wbc preview` serves: it shows what was saved, as soon as it is saved.

const REST = 120; // ms, a slider that has not moved for so long is sent

// What a server tells of other data than `known`, which the page has: see packing.py.
function patched(message, known) {
  const length = new DataView(message).getUint32(0, true);
  const told = JSON.parse(new TextDecoder().decode(new Uint8Array(message, 4, length)));
  const [sent, whole] = [new Uint8Array(message, 4 + length), new Uint8Array(told.size)];
  let taken = 0;
  let done = 0;
  for (const [start, from, count] of [...told.copies, [told.size, 0, 0]]) {
    whole.set(sent.subarray(taken, taken + start - done), done);
    taken += start - done;
    if (count) whole.set(new Uint8Array(known.buffer, from, count), start);
    done = start + count;
  }
  return { ...told, data: new ReplayData(whole.buffer, known.scene) };
}

// What the server of a live page shows now; who asks meanwhile gets the same.
/** @type {Promise<ReplayData> | null} */
let fetching = null;
function fetched(known) {
  fetching ??= fetchedAnew(known).finally(() => { fetching = null; });
  return fetching;
}

async function fetchedAnew(known) {
  const query = new URLSearchParams(location.search);
  query.set("has", known.header.version);
  const answer = await fetch(`data?${query}`);
  return patched(await answer.arrayBuffer(), known).data;
}

// The motion's parameters: what is chosen is sent to the server, which makes the motion anew.
class Sliders {
  constructor() {
    this.box = document.getElementById("sliders");
    this.shape = "";
    this.inputs = new Map();
  }

  // Shows the parameters of `header`; the one that is being moved stays where it is.
  use({ sliders }) {
    document.getElementById("app").classList.toggle("tuned", sliders.length > 0);
    const shape = JSON.stringify(sliders.map((slider) => ({ ...slider, value: null })));
    if (shape !== this.shape) this.build(sliders);
    this.shape = shape;
    for (const { name, value } of sliders) {
      const { input, tell } = this.inputs.get(name);
      if (input !== document.activeElement) input.value = value;
      tell();
    }
  }

  build(sliders) {
    this.inputs.clear();
    this.box.querySelector("div").replaceChildren(...sliders.map((slider) => this.row(slider)));
  }

  row({ name, low, high, is_whole: isWhole, unit, words }) {
    const row = document.createElement("label");
    const [title, output] = [document.createElement("span"), document.createElement("output")];
    const input = document.createElement(words.length ? "select" : "input");
    title.textContent = readable(name);
    if (words.length) {
      input.append(...words.map((word) => new Option(readable(word), word)));
    } else {
      Object.assign(input, { type: "range", min: low, max: high, step: isWhole ? 1 : "any" });
    }
    const tell = () => {
      const shown = Number(Number(input.value).toPrecision(3));
      output.textContent = words.length ? "" : `${shown} ${unit}`.trim();
    };
    input.addEventListener("input", () => {
      tell();
      clearTimeout(this.waiting);
      this.waiting = setTimeout(() => this.send(), REST);
    });
    input.dataset.name = name;
    this.inputs.set(name, { input, tell, isWord: words.length > 0 });
    row.append(title, input, output);
    return row;
  }

  send() {
    const values = {};
    for (const [name, { input, isWord }] of this.inputs) {
      values[name] = isWord ? input.value : Number(input.value);
    }
    fetch(`parameters${location.search}`, {
      method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify(values),
    });
  }
}

function listen(player) {
  const sliders = new Sliders();
  sliders.use(player.data.header);
  const studio = typeof Studio === "function" ? new Studio(player) : null;
  const box = document.getElementById("error");
  const showError = (title, text, isQuiet = false) => {
    box.hidden = !title;
    box.classList.toggle("quiet", isQuiet);
    box.querySelector("strong").textContent = title;
    box.querySelector("pre").textContent = text;
  };
  let version = player.data.header.version;
  const events = new EventSource(`events${location.search}`);
  events.onmessage = async ({ data }) => {
    const state = JSON.parse(data);
    if (state.version !== version) {
      if (state.version !== player.data.header.version) {
        const data = await fetched(player.data);
        if (data !== player.data && !studio?.certify.keeps(data)) player.use(data); // the studio may have shown it already
      }
      version = state.version;
      sliders.use(player.data.header);
      studio?.use(player.data.header.editor);
    }
    studio?.doing.use(state.doing);
    if (state.error) showError(state.title, state.error);
    else showError("", "");
    player.version = version;
  };
  events.onerror = () => showError("The preview has ended.", "Start it again: this page connects by itself.", true);
}
