"use strict";
// The player: one clock that moves the scene and the charts, buttons and keys.

const END_PAUSE = 1.2; // s that the last picture stays before the replay starts over
const LONGEST_FRAME = 0.5; // s that pass at once: more is a page that was not looked at
const LONG_STEP = 1.0; // s, shift with an arrow key

class Player {
  /** @type {ReplayData} */ data;
  /** @type {RobotScene} */ scene;
  /** @type {any[]} */ charts;
  /** @type {number} */ time;
  /** @type {boolean} */ isPlaying;

  constructor(data, scene, charts) {
    Object.assign(this, { data, scene, charts, time: 0, speed: 1, isPlaying: false, rest: 0 });
    this.button = document.getElementById("play");
    this.now = document.getElementById("now");
    this.behaviour = document.getElementById("behaviour");
    charts.forEach((chart) => chart.onScrub((t) => this.scrub(t)));
    this.verdict = new VerdictPanel(data, (t) => this.scrub(t));
    this.sound = new Sound();
    this.sound.use(data);
    this.describe();
    this.seek(0);
  }

  // Shows other data at the same time, from the same place.
  use(data) {
    this.data = data;
    this.scene.use(data);
    this.charts.forEach((chart) => chart.use(data));
    this.verdict.use(data);
    this.sound.use(data);
    this.describe();
    this.seek(this.time);
  }

  // What does not change with time.
  describe() {
    const { data } = this;
    const { title, is_plan: isPlan } = data.header;
    document.title = document.querySelector("h1").textContent = title;
    document.getElementById("total").textContent = ` / ${data.duration.toFixed(2)} s`;
    const { classList } = document.getElementById("app");
    for (const name of Object.keys(GHOST_COLORS)) classList.toggle(`has-${name}`, data[name] !== null);
    document.getElementById("force-key").textContent = isPlan ? "planned force" : "measured force";
    document.getElementById("ghost-force-key").textContent = isPlan ? "force of the blue one" : "planned force";
    const who = [`Solid: ${isPlan ? "the plan" : "what was measured"}.`];
    if (data.ghost) who.push(data.proposed ? "Blue: the nearest that the robot can do." : "Blue: the plan, which was checked.");
    document.querySelector("[data-ghost=ghost]").firstChild.textContent = data.proposed ? "Nearest" : "Plan";
    if (data.written) who.push("Brown: what was written; the plan is the nearest that the robot can do.");
    if (data.header.verdict?.coarse) who.push(`Coarse: ${data.header.verdict.coarse}.`);
    document.getElementById("who").textContent = who.join(" ");
  }

  cycleGhost(name) {
    const ghost = this.scene.ghosts.find((other) => other.name === name);
    ghost.place = GHOST_PLACES[(GHOST_PLACES.indexOf(ghost.place) + 1) % GHOST_PLACES.length];
    const button = document.querySelector(`[data-ghost=${name}]`);
    button.querySelector("span").textContent = `: ${ghost.place}`;
    button.classList.toggle("on", ghost.place !== "off");
    this.scene.show(this.time);
  }

  // "check" or "curves" in the side panel.
  openTab(name) {
    document.getElementById("app").dataset.tab = name;
    for (const button of /** @type {NodeListOf<HTMLElement>} */ (document.querySelectorAll("[data-open]"))) {
      button.classList.toggle("on", button.dataset.open === name);
    }
  }

  get isMoving() {
    return this.isPlaying || this.scene.shown.orbit;
  }

  // Frames are asked for only while something moves.
  wake() {
    if (this.isAwake || !this.isMoving) return;
    this.isAwake = true;
    this.last = performance.now();
    requestAnimationFrame((now) => this.tick(now));
  }

  // One clock for all that moves: where the 3D view takes longer than a frame, all wait for it.
  tick(now) {
    if (!this.scene.isDrawn) return void requestAnimationFrame((later) => this.tick(later));
    const passed = Math.min((now - this.last) / 1000, LONGEST_FRAME);
    this.last = now;
    if (this.isPlaying) this.advance(passed);
    if (this.scene.shown.orbit) this.scene.orbit(passed);
    this.isAwake = this.isMoving;
    if (this.isAwake) requestAnimationFrame((later) => this.tick(later));
  }

  advance(passed) {
    if (this.time < this.data.duration) {
      this.seek(this.sound.follow(this.time + passed * this.speed));
      return;
    }
    this.rest += passed;
    if (this.rest > END_PAUSE) this.play(true);
  }

  seek(t) {
    this.rest = 0;
    this.time = this.data.clampTime(t);
    this.scene.show(this.time);
    this.charts.forEach((chart) => chart.show(this.time));
    this.verdict.show(this.time);
    this.now.textContent = this.time.toFixed(2);
    this.behaviour.textContent = readable(this.data.labelAt(this.time));
    const slider = document.getElementById("timeline");
    slider.setAttribute("aria-valuenow", this.time.toFixed(2));
    slider.setAttribute("aria-valuemax", this.data.duration.toFixed(2));
  }

  scrub(t) {
    this.play(false);
    this.seek(t);
  }

  // To the next broken or tight limit, after the last one to the first.
  jumpToNext() {
    const times = this.data.annotations.map((annotation) => annotation.time).sort((a, b) => a - b);
    this.scrub(times.find((t) => t > this.time + INSTANT) ?? times[0]);
  }

  step(frames) {
    this.play(false);
    this.seek((this.data.frameAt(this.time) + frames) / this.data.rate);
  }

  play(isPlaying) {
    if (isPlaying && this.time >= this.data.duration) this.seek(0);
    this.isPlaying = isPlaying;
    this.sound.play(isPlaying, this.time, this.speed);
    this.button.classList.toggle("playing", isPlaying);
    this.wake();
  }

  setSpeed(speed) {
    this.speed = speed;
    this.sound.play(this.isPlaying, this.time, speed);
    for (const button of /** @type {NodeListOf<HTMLElement>} */ (document.querySelectorAll("[data-speed]"))) {
      button.classList.toggle("on", Number(button.dataset.speed) === speed);
    }
  }

  toggle(name) {
    const { shown } = this.scene;
    shown[name] = !shown[name];
    document.querySelector(`[data-toggle=${name}]`).classList.toggle("on", shown[name]);
    this.scene.show(this.time);
    this.wake();
  }
}

function bindControls(player) {
  const each = (name, act) => {
    for (const button of /** @type {NodeListOf<HTMLElement>} */ (document.querySelectorAll(`[data-${name}]`))) {
      button.addEventListener("click", () => {
        act(button.dataset[name]);
        button.blur();
      });
    }
  };
  each("toggle", (name) => player.toggle(name));
  each("view", (name) => player.scene.setView(name));
  each("speed", (speed) => player.setSpeed(Number(speed)));
  each("step", (frames) => player.step(Number(frames)));
  each("ghost", (name) => player.cycleGhost(name));
  each("sound", () => player.sound.toggle());
  each("open", (name) => player.openTab(name));
  player.button.addEventListener("click", () => {
    player.play(!player.isPlaying);
    player.button.blur();
  });
  const views = { 1: "corner", 2: "side", 3: "front", 4: "top" };
  const ghosts = { g: "ghost", w: "written" };
  const toggles = { c: "follow", o: "orbit", f: "forces", s: "support", p: "paths" };
  window.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    if (/** @type {HTMLElement} */ (event.target).matches("input, select, textarea")) return; // they take keys themselves
    const key = event.key.toLowerCase();
    const sign = { arrowleft: -1, arrowright: 1 }[key];
    if (key === " ") player.play(!player.isPlaying);
    else if (sign && event.shiftKey) player.scrub(player.time + sign * LONG_STEP);
    else if (sign) player.step(sign);
    else if (key === "home") player.scrub(0);
    else if (key === "end") player.scrub(player.data.duration);
    else if (views[key]) player.scene.setView(views[key]);
    else if (toggles[key]) player.toggle(toggles[key]);
    else if (ghosts[key] && player.data[ghosts[key]]) player.cycleGhost(ghosts[key]);
    else if (key === "m" && player.sound.audio) player.sound.toggle();
    else if (key === "n" && player.data.annotations.length) player.jumpToNext();
    else return;
    event.preventDefault();
  });
}

function makeCharts(data) {
  const card = (name) => document.querySelector(`[data-curve=${name}]`);
  return [
    new Timeline(document.getElementById("timeline"), data),
    new Binding(document.getElementById("binding"), data),
    new Curve(card("margin"), data, {
      name: "margin", scale: 100, unit: "cm", digits: 1, limit: 0, least: 0.5, isBad: (v) => v < 0,
    }),
    new Curve(card("torque"), data, {
      name: "torque", scale: 100, unit: "%", digits: 0, limit: 1, least: 1, isBad: (v) => v > 1,
    }),
    new Curve(card("height"), data, {
      name: "height", scale: 100, unit: "cm", digits: 1, least: 0.5, isBad: () => false,
    }),
  ];
}

async function start() {
  const notice = (text) => {
    const box = document.getElementById("notice");
    box.textContent = text;
    box.hidden = false;
  };
  if (typeof DecompressionStream === "undefined") {
    notice("This browser is too old for this page. Any browser from 2023 or later opens it.");
    return;
  }
  const bundle = document.createElement("script");
  bundle.textContent = new TextDecoder().decode(await unpackElement("meshcat-bundle"));
  document.head.append(bundle);
  const stored = new Pack(await unpackElement("replay-scene"));
  const data = new ReplayData(await unpackElement("replay-data"), stored);
  let scene;
  try {
    scene = new RobotScene(document.getElementById("pane"), data);
  } catch (error) {
    notice("This browser shows no 3D graphics (WebGL). Turn on hardware acceleration, or try another browser.");
    throw error;
  }
  const player = new Player(data, scene, makeCharts(data));
  bindControls(player);
  const isStill = window.matchMedia("(prefers-reduced-motion: reduce)").matches;
  player.play(!isStill && !data.sound);
  window.replay = player; // for scripts and tests
  if (typeof listen === "function") listen(player);
}

start();
