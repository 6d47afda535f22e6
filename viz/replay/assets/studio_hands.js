"use strict";
// Handles in the 3D view: the paw, the trunk or the place on the ground that the chosen call moves
// is pulled there. While it is, the legs follow by inverse kinematics here, within the joints' limits;
// what the server makes of it comes after.

const ROUND_LENGTH = 0.001, ROUND_DEGREES = 0.1, ROUND_RADIANS = 0.002; // m, degrees, rad
const NOSE = 0.33; // m ahead of the trunk's middle: the handle that turns it
const KEY_LENGTH = 0.01, KEY_ANGLE = Math.PI / 90; // m, rad
const IK_STEPS = 30, IK_DAMPING = 1e-4, IK_GOAL = 0.002; // m of a foot that counts as reached
const NEAR_END = 0.03; // s from the end of a call in which its handles are shown
const HAND_TITLES = { paw: "paw", place: "place of the foot", trunk: "trunk", nose: "nose: turns the trunk", way: "where it walks to" };

class Hands {
  constructor(studio) {
    this.studio = studio;
    this.player = studio.player;
    this.scene = studio.player.scene;
    this.layer = element("div", { id: "hands" });
    document.getElementById("pane").after(this.layer);
    this.hands = [];
    this.scene.viewer.controls.addEventListener("change", () => this.place());
    new ResizeObserver(() => this.place()).observe(this.scene.pane);
  }

  // The handles of the chosen call, or of what it has become in a draft.
  use(bar = this.studio.bar()) {
    this.bar = bar;
    if (this.held) {
      if (bar) this.player.seek(bar.span[2]);
      return;
    }
    this.make();
    this.show(this.player.time);
  }

  show(t) {
    const { bar } = this;
    this.isShown = Boolean(bar) && isOwn(bar) && !this.player.isPlaying && Math.abs(t - bar.span[2]) < NEAR_END;
    this.layer.hidden = !this.isShown;
    this.layer.inert = !this.isShown;
    if (this.isShown) this.place();
    if (this.held?.pose) this.pose(this.held.reached);
  }

  make() {
    const { bar } = this;
    const focused = /** @type {HTMLElement} */ (document.activeElement);
    const had = this.layer.contains(focused) ? focused.dataset.hand : null;
    this.hands = bar && isOwn(bar) && !this.player.data.ghost ? handsOf(bar, this.scene.legs) : [];
    this.layer.replaceChildren(...this.hands.map((hand) => this.button(hand)));
    if (had) this.layer.querySelector(`[data-hand="${had}"]`)?.focus();
  }

  button(hand) {
    const button = element("button", { className: hand.isNew ? "hand new" : "hand" });
    const { kind, leg } = hand;
    const whose = leg === undefined ? "" : `${LEG_NAMES[this.scene.legs[leg]]} `;
    button.dataset.hand = `${kind} ${leg ?? ""}`.trim();
    button.title = readable(`${whose}${HAND_TITLES[kind]}`) + (hand.isNew ? ". Pull it to add a move of this paw" : ". Pull it, or use the arrow keys; with Shift along the ground");
    button.setAttribute("aria-label", button.title);
    if (leg !== undefined) button.style.setProperty("--leg", this.player.data.header.leg_colors[leg]);
    button.addEventListener("pointerdown", (event) => this.grasp(event, hand, button));
    button.addEventListener("keydown", (event) => this.onKey(event, hand));
    hand.button = button;
    return button;
  }

  // Where a handle is, in the world.
  at(hand, t = this.bar.span[2]) {
    const { data } = this.player;
    const frame = data.frameAt(t);
    const q = data.q.subarray(19 * frame, 19 * frame + 7);
    if (hand.kind === "paw") return [...data.feet.subarray(12 * frame + 3 * hand.leg, 12 * frame + 3 * hand.leg + 3)];
    if (hand.kind === "place") {
      const [x, y, z] = data.feet.subarray(12 * frame + 3 * hand.leg, 12 * frame + 3 * hand.leg + 3);
      return [x, y, this.scene.underside(z)];
    }
    if (hand.kind === "way") return [q[0], q[1], 0];
    if (hand.kind === "trunk") return [q[0], q[1], q[2]];
    const { THREE } = MeshCat;
    const ahead = new THREE.Vector3(NOSE, 0, 0.02).applyQuaternion(new THREE.Quaternion(q[3], q[4], q[5], q[6]));
    return [q[0] + ahead.x, q[1] + ahead.y, q[2] + ahead.z];
  }

  place() {
    if (!this.isShown) return;
    for (const hand of this.hands) {
      const held = this.held?.hand === hand ? this.held.point : this.at(hand);
      const [x, y, isAhead] = this.project(held);
      hand.button.hidden = !isAhead;
      hand.button.style.transform = `translate(${x}px, ${y}px)`;
    }
  }

  // On the screen; the viewer's axes: x, z up becomes y, y becomes -z.
  project([x, y, z]) {
    const { camera } = this.scene.viewer;
    camera.updateMatrixWorld();
    const seen = new MeshCat.THREE.Vector3(x, z, -y).project(camera);
    const { clientWidth: width, clientHeight: height } = this.scene.pane;
    return [(seen.x + 1) / 2 * width, (1 - seen.y) / 2 * height, seen.z < 1];
  }

  // Where the ray through a point of the screen meets the plane through `point` with this normal.
  meet(event, point, normal) {
    const { THREE } = MeshCat;
    const { camera } = this.scene.viewer;
    const box = this.scene.pane.getBoundingClientRect();
    const ray = new THREE.Raycaster();
    ray.setFromCamera({
      x: (event.clientX - box.left) / box.width * 2 - 1, y: 1 - (event.clientY - box.top) / box.height * 2,
    }, camera);
    const [x, y, z] = point;
    const plane = new THREE.Plane().setFromNormalAndCoplanarPoint(
      new THREE.Vector3(normal[0], normal[2], -normal[1]), new THREE.Vector3(x, z, -y));
    const met = ray.ray.intersectPlane(plane, new THREE.Vector3());
    return met && [met.x, -met.z, met.y];
  }

  // The plane in which a handle moves: the ground, or upright and across the view along an axis.
  normal(hand, isFlat) {
    const view = this.scene.viewer.camera.getWorldDirection(new MeshCat.THREE.Vector3());
    const isSteep = Math.abs(view.y) > STEEP;
    if (isFlat || hand.isFlat || (isSteep && hand.kind !== "nose")) return [0, 0, 1];
    const [c, s] = [Math.cos(this.heading(hand)), Math.sin(this.heading(hand))];
    const along = Math.abs(view.x * c - view.z * s);
    const across = Math.abs(-view.x * s - view.z * c);
    return along > across ? [c, s, 0] : [-s, c, 0];
  }

  // [rad] of the four feet's frame: where they last stood, at the end of the call or before it.
  heading(hand) {
    const { data } = this.player;
    const { legs } = this.scene;
    const last = data.frameAt(hand.isFlat ? this.bar.span[0] : this.bar.span[2]);
    const place = (leg) => {
      let frame = last;
      while (frame > 0 && !data.stance[4 * frame + leg]) frame--;
      return [data.feet[12 * frame + 3 * leg], data.feet[12 * frame + 3 * leg + 1]];
    };
    const places = legs.map((_, leg) => place(leg));
    const ahead = (axis) => places[0][axis] + places[1][axis] - places[2][axis] - places[3][axis];
    return Math.atan2(ahead(1), ahead(0));
  }

  grasp(event, hand, button) {
    if (event.button !== 0) return;
    event.preventDefault();
    event.stopPropagation();
    button.setPointerCapture(event.pointerId);
    button.focus({ preventScroll: true });
    const { shown, viewer } = this.scene;
    const follows = shown.follow;
    shown.follow = false; // the camera stays while the hand moves
    viewer.controls.enabled = false;
    const start = this.at(hand);
    this.hold(hand, start);
    let [normal, isFlat] = [this.normal(hand, event.shiftKey), event.shiftKey];
    let from = this.meet(event, start, normal);
    let base = [0, 0, 0];
    const move = (now) => {
      if (now.shiftKey !== isFlat) { // goes on from here in another plane
        [normal, isFlat] = [this.normal(hand, now.shiftKey), now.shiftKey];
        base = this.held.delta;
        from = this.meet(now, this.held.point, normal);
      }
      const to = this.meet(now, from ?? start, normal);
      if (from && to) this.pull(base.map((value, k) => value + to[k] - from[k]));
    };
    const drop = () => {
      button.removeEventListener("pointermove", move);
      viewer.controls.enabled = true;
      shown.follow = follows;
      this.release();
    };
    button.addEventListener("pointermove", move);
    button.addEventListener("pointerup", drop, { once: true });
    button.addEventListener("pointercancel", drop, { once: true });
  }

  hold(hand, start) {
    const { bar } = this;
    this.held = { hand, start, bar, point: start, delta: [0, 0, 0], reached: [0, 0, 0], heading: this.heading(hand), legs: this.legs() };
    this.held.pose = hand.kind === "paw" || hand.kind === "trunk";
  }

  // By this way [m] from where it was; the nearest that the legs can reach.
  pull(delta) {
    const { held } = this;
    const { hand, start, bar } = held;
    held.delta = delta;
    let isFar = false;
    if (hand.kind === "paw" && held.bar.values.frame !== "body") delta = [delta[0], delta[1], Math.max(delta[2], -this.above(held))];
    if (held.pose) {
      const reached = this.pose(delta);
      isFar = !reached;
      if (hand.kind === "paw") delta = this.footAt(held.legs[hand.leg]).map((value, k) => value - start[k]);
      else if (isFar) delta = held.reached;
    }
    held.reached = delta;
    held.point = start.map((value, k) => value + delta[k]);
    hand.button.classList.toggle("far", isFar);
    this.studio.tell(isFar ? "the leg cannot reach farther" : "", isFar);
    this.scene.viewer.set_dirty();
    this.place();
    held.values = this.values(hand, bar, delta);
    if (held.values && !hand.isNew) this.studio.setMany(bar, held.values, false);
  }

  release() {
    const { held } = this;
    this.held = null;
    held.hand.button.classList.remove("far");
    if (!held.values) return void this.player.seek(this.player.time);
    if (held.hand.isNew) this.studio.insert(LIFT_AND_DOWN, { leg: this.scene.legs[held.hand.leg], ...held.values });
    else this.studio.setMany(held.bar, held.values, true);
  }

  onKey(event, hand) {
    const way = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[event.key];
    if (!way || hand.isNew) return;
    event.preventDefault();
    event.stopPropagation();
    const [nx, ny, nz] = this.normal(hand, event.shiftKey);
    const { camera } = this.scene.viewer;
    const right = new MeshCat.THREE.Vector3(1, 0, 0).applyQuaternion(camera.quaternion);
    const side = nz ? [right.x, -right.z, 0] : [-ny, nx, 0].map((value) => value * (Math.sign(-ny * right.x - nx * right.z) || 1));
    const up = nz ? [-side[1], side[0], 0] : [0, 0, 1];
    const size = hand.kind === "nose" ? NOSE * KEY_ANGLE : KEY_LENGTH;
    this.hold(hand, this.at(hand));
    this.pull(side.map((value, k) => size * (way[0] * value + way[1] * up[k])));
    this.release();
  }

  // How far a foot is above the ground [m].
  above({ hand, start }) {
    const { data } = this.player;
    let frame = data.frameAt(this.bar.span[2]);
    while (frame > 0 && !data.stance[4 * frame + hand.leg]) frame--;
    return Math.max(start[2] - data.feet[12 * frame + 3 * hand.leg + 2], 0);
  }

  // The arguments that make it so, of a call whose handle has moved by `delta` [m] in the world.
  values(hand, bar, delta) {
    const { THREE } = MeshCat;
    const way = new THREE.Vector3(...delta);
    if (hand.kind === "paw" && bar.values.frame === "body" && !hand.isNew) {
      const frame = this.player.data.frameAt(bar.span[2]);
      const q = this.player.data.q.subarray(19 * frame + 3, 19 * frame + 7);
      way.applyQuaternion(new THREE.Quaternion(q[0], q[1], q[2], q[3]).invert());
    } else way.applyAxisAngle(new THREE.Vector3(0, 0, 1), -this.held.heading);
    const changes = hand.kind === "nose" ? { pitch: -way.z / NOSE, yaw: way.y / NOSE } : { x: way.x, y: way.y, z: way.z };
    const made = {};
    for (const name of hand.names) {
      const change = changes[name];
      if (hand.isNew) {
        if (Math.abs(change) >= ROUND_LENGTH) made[name] = rounded(change, ROUND_LENGTH);
        continue;
      }
      const slot = bar.slots.find((one) => one.name === name);
      if (slot && !slot.span) continue; // computed: the file says how
      if (!slot && Math.abs(change) < 2 * ROUND_LENGTH) continue;
      const isAngle = ANGLE_NAMES.includes(name);
      const isDegrees = slot ? slot.is_angle : isAngle; // an angle is added as one in degrees
      const was = bar.values[name] ?? this.before(bar, name);
      const literal = slot ? slot.value : was * (isDegrees ? 180 / Math.PI : 1);
      const gain = slot && Math.abs(was) > 1e-9 && slot.value ? slot.value / was : isDegrees ? 180 / Math.PI : 1;
      const value = rounded(literal + gain * change, isDegrees ? ROUND_DEGREES : isAngle ? ROUND_RADIANS : ROUND_LENGTH);
      if (!slot || value !== slot.value || Math.abs(change) < ROUND_LENGTH) made[name] = value;
    }
    const isSame = Object.entries(made).every(([name, value]) => bar.slots.find((one) => one.name === name)?.value === value);
    return Object.keys(made).length && !isSame ? made : null;
  }

  // What a channel of the trunk is at when a call leaves it out: as the calls before have left it.
  before(bar, name) {
    const { bars } = this.studio.editor;
    for (let k = bars.findIndex((one) => isAt(one, bar.site) && one.number === bar.number) - 1; k >= 0; k--) {
      if (bars[k].name === "home" || bars[k].name === "pose") return 0;
      if (bars[k].name === "body" && typeof bars[k].values[name] === "number") return bars[k].values[name];
    }
    return 0;
  }

  // --- inverse kinematics of the legs that are drawn -----------------------------------------

  // Each leg's joints, and its foot in the frame of the last of them, as it is drawn now.
  legs() {
    const { body, legs } = this.scene;
    const { data } = this.player;
    const frame = data.frameAt(this.bar.span[2]);
    this.scene.show(this.bar.span[2]);
    body.root.updateWorldMatrix(true, true);
    const { joints } = data.scene.header;
    return legs.map((_, leg) => {
      const [x, y, z] = data.feet.subarray(12 * frame + 3 * leg, 12 * frame + 3 * leg + 3);
      const foot = new MeshCat.THREE.Vector3(x, z, -y);
      const rows = [0, 1, 2].map((k) => 3 * leg + k);
      return {
        goal: foot.clone(), foot: body.joints[rows[2]].node.worldToLocal(foot.clone()), nodes: rows.map((row) => body.joints[row]),
        limits: rows.map((row) => [joints[row].low, joints[row].high]),
        start: rows.map((row) => data.q[19 * frame + 7 + row]),
        isDown: Boolean(data.stance[4 * frame + leg]),
      };
    });
  }

  footAt({ nodes, foot }) {
    const { x, y, z } = nodes[2].node.localToWorld(foot.clone());
    return [x, -z, y];
  }

  // Draws the robot with the handle moved; whether the legs reach.
  pose(delta) {
    const { hand, legs } = this.held;
    const { base } = this.scene.body;
    const { THREE } = MeshCat;
    const way = new THREE.Vector3(delta[0], delta[2], -delta[1]);
    let moved = [];
    base.updateWorldMatrix(true, true);
    if (hand.kind === "paw") moved = [[legs[hand.leg], legs[hand.leg].goal.clone().add(way)]];
    else {
      const frame = this.player.data.frameAt(this.bar.span[2]);
      const at = this.player.data.q.subarray(19 * frame, 19 * frame + 3);
      base.position.set(at[0] + delta[0], at[1] + delta[1], at[2] + delta[2]);
      base.updateWorldMatrix(true, true);
      moved = legs.filter(({ isDown }) => isDown).map((leg) => [leg, leg.goal]);
    }
    return moved.map(([leg, goal]) => reach(leg, goal)).every(Boolean);
  }
}

// Turns a leg's joints until its foot is at `goal`, or as near as their limits let it: from where
// they were last, or at first, whichever leads nearer.
function reach(leg, goal) {
  const tried = [leg.angles ?? leg.start, leg.start].map((from) => solved(leg, goal, from));
  const [best] = tried.sort((a, b) => a.miss - b.miss);
  leg.angles = best.angles;
  turned(leg, best.angles);
  return best.miss < IK_GOAL;
}

// Where the foot is once the joints are turned so.
function turned({ nodes, foot }, angles) {
  nodes.forEach(({ node, axis }, k) => node.quaternion.setFromAxisAngle(axis, angles[k]));
  nodes[0].node.updateWorldMatrix(false, true);
  return nodes[2].node.localToWorld(foot.clone());
}

// By damped least squares, joints that are at a limit left out.
function solved(leg, goal, from) {
  const { THREE } = MeshCat;
  const { nodes, limits } = leg;
  let angles = [...from];
  let now = turned(leg, angles);
  for (let step = 0; step < IK_STEPS && now.distanceTo(goal) > IK_GOAL / 4; step++) {
    const error = goal.clone().sub(now);
    const columns = nodes.map(({ node, axis }, k) => {
      const origin = new THREE.Vector3().setFromMatrixPosition(node.matrixWorld);
      const column = axis.clone().transformDirection(node.matrixWorld).cross(now.clone().sub(origin));
      const [low, high] = limits[k];
      const isStuck = (angles[k] <= low && column.dot(error) < 0) || (angles[k] >= high && column.dot(error) > 0);
      return isStuck ? new THREE.Vector3() : column;
    });
    const entry = (i, k) => columns[i].dot(columns[k]) + (i === k ? IK_DAMPING : 0);
    const normal = new THREE.Matrix3().set(
      entry(0, 0), entry(0, 1), entry(0, 2), entry(1, 0), entry(1, 1), entry(1, 2), entry(2, 0), entry(2, 1), entry(2, 2));
    const change = new THREE.Vector3(...columns.map((column) => column.dot(error))).applyMatrix3(normal.invert()).toArray();
    angles = angles.map((angle, k) => Math.min(Math.max(angle + Math.min(Math.max(change[k], -0.4), 0.4), limits[k][0]), limits[k][1]));
    now = turned(leg, angles);
  }
  return { angles, miss: now.distanceTo(goal) };
}

// What of a call can be taken in hand; paws that it does not move begin a new one.
function handsOf({ name, values }, legs) {
  const leg = legs.indexOf(values.leg);
  const own = {
    foot: [{ kind: "paw", leg, names: ["x", "y", "z"] }],
    step: [{ kind: "place", leg, names: ["x", "y"], isFlat: true }],
    walk: [{ kind: "way", names: ["x", "y"], isFlat: true }],
    side_step: [{ kind: "way", names: ["y"], isFlat: true }],
    body: [{ kind: "trunk", names: ["x", "y", "z"] }, { kind: "nose", names: ["pitch", "yaw"] }],
  }[name] ?? [];
  const found = own.filter(({ leg: k }) => k !== -1);
  const others = ["walk", "turn", "step", "side_step", "path"].includes(name) ? [] : legs;
  return [...found, ...others.map((_, k) => ({ kind: "paw", leg: k, names: ["x", "y", "z"], isNew: true })).filter(({ leg: k }) => k !== leg)];
}
