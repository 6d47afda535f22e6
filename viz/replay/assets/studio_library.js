"use strict";
// The motions of the library, with pictures: one is chosen and played behind the chosen move.

class Library {
  /** @type {Studio} */ studio;
  /** @type {any} */ known;
  /** @type {string} */ sheet;

  constructor(studio) {
    this.studio = studio;
    this.known = null; // asked for when it is opened first
  }

  async open() {
    const { studio } = this;
    this.known ??= await studio.ask("library", "opening the library…");
    if (!this.known.motions) {
      this.known = null;
      return;
    }
    this.sheet ??= URL.createObjectURL(new Blob([bytesOf(this.known.sheet)], { type: "image/webp" }));
    studio.tell("");
    const dialog = element("dialog", { id: "library" });
    dialog.setAttribute("aria-label", "Motions of the library");
    const search = element("input", { type: "search", placeholder: "Search, such as paw or jump" });
    search.setAttribute("aria-label", "Search the library");
    const list = element("div", { className: "pictures" });
    const cards = this.known.motions.map((motion, number) => this.card(motion, number, dialog));
    list.append(...cards);
    const none = element("p", { textContent: "None is called so.", hidden: true });
    search.addEventListener("input", () => {
      const sought = search.value.trim().toLowerCase();
      for (const card of cards) {
        const text = card.title.toLowerCase();
        card.hidden = !sought.split(/\s+/).every((word) => text.includes(word));
        card.style.order = text.startsWith(sought) ? 0 : 1; // names before what is told of others
      }
      none.hidden = cards.some((card) => !card.hidden);
    });
    search.addEventListener("keydown", (event) => {
      if (event.key !== "Enter") return;
      const shown = cards.filter((card) => !card.hidden);
      shown.sort((a, b) => a.style.order - b.style.order)[0]?.click();
    });
    const close = element("button", { textContent: "Close" });
    close.addEventListener("click", () => dialog.close());
    const head = element("div", { className: "buttons" });
    head.append(search, close);
    dialog.append(element("h2", { textContent: "Play a motion of the library" }), head, list, none);
    dialog.addEventListener("close", () => dialog.remove());
    document.body.append(dialog);
    dialog.showModal();
    search.focus();
  }

  card({ name, told, lasts }, number, dialog) {
    const { columns, size: [width, height] } = this.known;
    const card = element("button", { title: `${readable(name)}, ${lasts.toFixed(1)} s. ${told}` });
    card.dataset.motion = name;
    const picture = element("i");
    Object.assign(picture.style, {
      width: `${width}px`, height: `${height}px`, backgroundImage: `url(${this.sheet})`,
      backgroundPosition: `${-width * (number % columns)}px ${-height * Math.floor(number / columns)}px`,
    });
    card.append(picture, element("b", { textContent: readable(name) }), element("small", { textContent: `${lasts.toFixed(1)} s` }));
    card.addEventListener("click", () => {
      dialog.close();
      this.studio.playBehind(name);
    });
    return card;
  }
}
