"use strict";
// The world that the motion is checked and played in: the floor, the load, and what the robot feels.

const FEELS = { ideal: "the truth", noisy: "the truth with noise", imu: "its own sensors" };
/** @type {[string, string, string, number, string][]} */
const NUMBERS_OF_WORLD = [
  ["friction", "Friction", "", 0.05, "Of feet and floor: ice 0.1, wet tiles 0.5, dry rubber on concrete 1"],
  ["payload", "Payload", "kg", 0.5, "Extra mass on the trunk, which the controller is told nothing of"],
];

class World {
  /** @type {Studio} */ studio;
  /** @type {Record<string, any>} */ fields;

  constructor(studio) {
    this.studio = studio;
    this.fields = {};
    const { world } = studio.player.data.header.editor;
    const { ranges, choices } = world;
    this.box = element("details", { id: "world" });
    this.told = element("summary", { title: "Verdict, margins, chance and physics are those of this world; click to change it (W)" });
    const row = element("div", { className: "buttons" });
    row.setAttribute("role", "group");
    row.setAttribute("aria-label", "World");
    for (const [name, title, unit, step, hint] of NUMBERS_OF_WORLD) {
      const [low, high] = ranges[name];
      const input = element("input", { type: "number", min: Math.floor(low), max: high, step, title: `${hint}; ${low} to ${high}` });
      row.append(this.field(name, title, input, unit));
    }
    const list = element("select", { title: "What the robot feels when physics plays it; the check knows no sensors" });
    list.append(...choices.map((word) => new Option(FEELS[word] ?? word, word)));
    row.append(this.field("sensors", "Feels", list));
    const grounds = element("select", { title: "What physics plays it on; the check knows level ground only" });
    grounds.append(...["level", ...Object.keys(world.grounds)].map((word) => new Option(word, word)));
    row.append(this.field("ground", "Ground", grounds));
    this.size = this.field("size", "", element("input", { type: "number" }));
    row.append(this.size);
    grounds.addEventListener("change", () => this.meet({ ...this.chosen(), size: null })); // the usual one of it
    this.usual = element("button", { textContent: "As usual", title: "The usual world again" });
    this.usual.addEventListener("click", () => this.meet({}));
    row.append(this.usual);
    this.warning = element("p", { id: "world-warning" });
    this.box.append(this.told, row, this.warning);
  }

  field(name, title, input, unit = "") {
    const label = element("label");
    label.append(`${title} `, input, unit && ` ${unit}`);
    if (name !== "ground") input.addEventListener("change", () => this.meet(this.chosen()));
    this.fields[name] = input;
    return label;
  }

  chosen() {
    const { friction, payload, sensors, ground, size } = this.fields;
    return {
      friction: Number(friction.value), payload: Number(payload.value), sensors: sensors.value,
      ground: ground.value, size: Number(size.value),
    };
  }

  /** @param {Editor} editor */
  use({ world }) {
    this.told.textContent = `World: ${world.told}`;
    this.usual.disabled = world.is_usual;
    this.told.classList.toggle("other", !world.is_usual);
    for (const [name, input] of Object.entries(this.fields)) input.value = String(world[name]);
    this.warning.textContent = world.warning;
    this.useGround(world);
  }

  // Its number has another name, unit and range on each ground; a level one has none.
  /** @param {Editor["world"]} world */
  useGround({ ground, grounds }) {
    const kind = grounds[ground];
    this.size.hidden = !kind;
    if (!kind) return;
    const { size, unit, range: [low, high] } = kind;
    Object.assign(this.fields.size, { min: low, max: high, step: unit === "deg" ? 1 : 0.01, title: `${low} to ${high} ${unit}` });
    this.size.replaceChildren(`${size[0].toUpperCase()}${size.slice(1)} `, this.fields.size, ` ${unit}`);
  }

  open() {
    this.box.open = true;
    this.fields.friction.select();
    this.fields.friction.focus();
  }

  // The file stays as it is: only what is checked and played is another world.
  /** @param {Record<string, number | string | null>} order */
  async meet(order) {
    const { studio } = this;
    studio.tools.offer([]);
    const { error } = await studio.ask("world", "checking…", order);
    if (error) return this.use(studio.editor);
    studio.tell("");
    await studio.reload();
  }
}
