"use strict";
// Where feet come down, and how the CoM flies: shown on the floor and in the air, for motions that
// step or jump.

const STEP = 0.012; // m, a foot that comes down this far from where it stood has stepped
const LEAST_STAND = 0.04; // s, a shorter stance leaves no footprint
const PRINT = { radius: 0.024, lift: 0.001, faint: 0.25, clear: 0.8 };
const FLIGHT_COLOR = 0x7c3aed;

class Steps {
  constructor(scene) {
    this.scene = scene;
    this.prints = [];
  }

  use(data) {
    const { THREE } = MeshCat;
    const { viewer, legs } = this.scene;
    const group = new THREE.Group();
    this.prints = legs.flatMap((_, k) => this.landings(data, k)).map(({ leg, from, x, y, z }) => {
      const material = new THREE.MeshBasicMaterial({
        color: data.header.leg_colors[leg], transparent: true, depthWrite: false,
      });
      const disc = new THREE.Mesh(new THREE.CircleGeometry(PRINT.radius, 24), material);
      disc.position.set(x, y, z + PRINT.lift);
      group.add(disc);
      return { from, material };
    });
    for (const [from, to] of flights(data)) group.add(this.arc(data, from, to));
    viewer.set_object(["meshcat", "steps"], group);
    this.group = group;
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
    for (const { from, material } of this.prints) {
      material.opacity = t >= from ? PRINT.clear : PRINT.faint;
    }
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
