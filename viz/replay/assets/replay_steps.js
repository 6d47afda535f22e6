"use strict";
// Where feet come down, how the CoM flies and where all ends: shown on the floor and in the air, for
// motions that step, jump or move on.

const STEP = 0.012; // m, a foot that comes down this far from where it stood has stepped
const LEAST_STAND = 0.04; // s, a shorter stance leaves no footprint
const PRINT = { radius: 0.024, lift: 0.001, faint: 0.25, clear: 0.8 };
const GOAL = { room: 0.05, line: 0.008, arrow: 0.09, color: 0x2563eb, opacity: 0.32 }; // m
const FLIGHT_COLOR = 0x7c3aed;

class Steps {
  constructor(scene) {
    this.scene = scene;
    this.prints = [];
  }

  use(data) {
    const { THREE } = MeshCat;
    const group = new THREE.Group();
    this.prints = this.scene.legs.flatMap((_, k) => this.landings(data, k)).sort((a, b) => a.from - b.from);
    this.coming = this.discs(data, PRINT.faint);
    this.landed = this.discs(data, PRINT.clear);
    group.add(this.coming, this.landed);
    for (const [from, to] of flights(data)) group.add(this.arc(data, from, to));
    if (data.header.end_pose) group.add(this.goal(data));
    this.scene.viewer.set_object(["meshcat", "steps"], group);
    this.group = group;
  }

  // A disc for every footprint, all drawn at once: a long walk has hundreds.
  discs(data, opacity) {
    const { THREE } = MeshCat;
    const material = new THREE.MeshBasicMaterial({ opacity, transparent: true, depthWrite: false });
    const discs = new THREE.InstancedMesh(
      new THREE.CircleGeometry(PRINT.radius, 24), material, this.prints.length);
    this.prints.forEach(({ leg, x, y, z }, k) => {
      discs.setMatrixAt(k, new THREE.Matrix4().makeTranslation(x, y, z + PRINT.lift));
      discs.setColorAt(k, new THREE.Color(data.header.leg_colors[leg]));
    });
    discs.frustumCulled = false;
    return discs;
  }

  // Where the motion is to end: the outline of the feet as they stand at first, and an arrow ahead.
  goal(data) {
    const { THREE } = MeshCat;
    const [x, y, yaw] = data.header.end_pose;
    const reach = (axis) => Math.max(...[0, 1, 2, 3].map((leg) => Math.abs(data.feet[3 * leg + axis])));
    const [length, width] = [reach(0) + GOAL.room, reach(1) + GOAL.room];
    const box = (a, b) => [[a, b], [-a, b], [-a, -b], [a, -b]].map((corner) => new THREE.Vector2(...corner));
    const frame = new THREE.Shape(box(length, width));
    frame.holes.push(new THREE.Path(box(length - GOAL.line, width - GOAL.line)));
    const tip = length + GOAL.arrow;
    const arrow = new THREE.Shape([[length, 0.6 * GOAL.arrow], [tip, 0], [length, -0.6 * GOAL.arrow]]
      .map((corner) => new THREE.Vector2(...corner)));
    const mesh = new THREE.Mesh(new THREE.ShapeGeometry([frame, arrow]), new THREE.MeshBasicMaterial({
      color: GOAL.color, opacity: GOAL.opacity, transparent: true, depthWrite: false, side: THREE.DoubleSide,
    }));
    mesh.position.set(x, y, PRINT.lift);
    mesh.rotation.z = yaw;
    mesh.name = "goal";
    return mesh;
  }

  // Each stance of a foot whose place differs from the ones before; none if it never steps.
  landings(data, leg) {
    const found = [];
    for (const [from, to] of stances(data, leg)) {
      if ((to - from) / data.rate < LEAST_STAND && to < data.frames - 1) continue;
      const row = Math.min(from + Math.round(LEAST_STAND * data.rate), to);
      const [x, y, z] = data.feet.subarray(12 * row + 3 * leg, 12 * row + 3 * leg + 3);
      const last = found[found.length - 1];
      if (last && Math.hypot(x - last.x, y - last.y) < STEP) continue;
      found.push({ leg, from: from / data.rate, x, y, z: this.scene.underside(z) });
    }
    return found.length > 1 ? found : [];
  }

  // The way of the CoM while no foot stands.
  arc(data, from, to) {
    const { THREE } = MeshCat;
    const geometry = new THREE.BufferGeometry();
    const points = data.com.slice(3 * from, 3 * (to + 1));
    geometry.setAttribute("position", new THREE.BufferAttribute(points, 3));
    return new THREE.Line(geometry, new THREE.LineBasicMaterial({ color: FLIGHT_COLOR }));
  }

  show(t) {
    this.group.visible = this.scene.shown.paths;
    const after = this.prints.findIndex(({ from }) => t < from);
    this.landed.count = after < 0 ? this.prints.length : after;
  }
}

// First and last frame of each stretch in which a foot is planned to stand.
function stances(data, leg) {
  return stretches(data.frames, (i) => data.stance[4 * i + leg]);
}

// First and last frame of each stretch in which no foot is.
function flights(data) {
  const isFlying = (i) => ![0, 1, 2, 3].some((leg) => data.stance[4 * i + leg]);
  return stretches(data.frames, isFlying).filter(([from, to]) => to > from);
}

function stretches(frames, isInside) {
  const found = [];
  let start = -1;
  for (let i = 0; i <= frames; i++) {
    const inside = i < frames && isInside(i);
    if (inside && start < 0) start = i;
    if (!inside && start >= 0) {
      found.push([start, i - 1]);
      start = -1;
    }
  }
  return found;
}
