"use strict";
// Five steps for who opens the studio the first time; whether they were taken stays in the browser.

const TOUR_KEY = "go2-wbc studio tour";
const TOUR = [
  ["#bars", "Moves over time", "Each bar is a move of your file. Drag its right end to make it longer, drag it to another place between others, click it to see the pose that it leads to."],
  ["#inspector", "Numbers and words", "The chosen move's numbers, with units. Each change is one change in your Python file; Undo takes it back. What you type in an editor appears here."],
  ["#stage", "Hands", "Of the chosen move you can take the paw or the trunk and pull it. Red means that the leg cannot reach so far. Drag beside the robot to look around."],
  ["#badge", "Can the robot do it?", "While you drag, the motion is checked: green is possible, red names the first limit that is broken, and the moves that break it turn red. \u201cMake it possible\u201d proposes changes."],
  ["[aria-label='Insert a move']", "More moves, music, physics", "Insert a move, set a song or tap a tempo, play it in physics beside the plan, and export a page or a film. ? lists all keys."],
];

class Tour {
  constructor(studio) {
    this.studio = studio;
    let isTaken = true;
    try {
      isTaken = localStorage.getItem(TOUR_KEY) !== null;
    } catch {
      // a browser that keeps nothing is not asked again and again
    }
    if (!isTaken) this.start();
  }

  start() {
    this.step = 0;
    this.box?.remove();
    this.box = element("section", { id: "tour", className: "card" });
    this.box.setAttribute("role", "dialog");
    this.box.setAttribute("aria-label", "Tour of the studio");
    document.body.append(this.box);
    this.box.addEventListener("keydown", (event) => {
      if (event.key !== "Escape") return;
      this.end();
      event.stopPropagation();
    });
    this.show();
  }

  show() {
    document.querySelector(".toured")?.classList.remove("toured");
    const [place, title, text] = TOUR[this.step];
    const target = document.querySelector(place);
    target.classList.add("toured");
    target.scrollIntoView({ block: "nearest" });
    const isLast = this.step === TOUR.length - 1;
    const buttons = element("div", { className: "buttons" });
    const button = (textContent, act) => {
      const made = element("button", { textContent });
      made.addEventListener("click", act);
      buttons.append(made);
      return made;
    };
    button("Skip the tour", () => this.end()).hidden = isLast;
    if (this.step) button("Back", () => this.go(-1));
    const next = button(isLast ? "Done" : "Next", () => (isLast ? this.end() : this.go(1)));
    next.classList.add("on");
    this.box.replaceChildren(
      element("small", { textContent: `${this.step + 1} of ${TOUR.length}` }),
      element("h2", { textContent: title }), element("p", { textContent: text }), buttons);
    this.place(target.getBoundingClientRect());
    next.focus({ preventScroll: true });
  }

  // Over the target or below it, where there is room, within the window.
  place({ left, top, bottom }) {
    const { offsetWidth: width, offsetHeight: height } = this.box;
    const above = top - height - 10;
    const y = above > 10 ? above : Math.min(bottom + 10, innerHeight - height - 10);
    this.box.style.left = `${Math.max(Math.min(left, innerWidth - width - 10), 10)}px`;
    this.box.style.top = `${Math.max(y, 10)}px`;
  }

  go(steps) {
    this.step += steps;
    this.show();
  }

  end() {
    document.querySelector(".toured")?.classList.remove("toured");
    this.box.remove();
    try {
      localStorage.setItem(TOUR_KEY, "taken");
    } catch {
      // nothing is kept
    }
  }
}
