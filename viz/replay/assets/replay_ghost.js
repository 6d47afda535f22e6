"use strict";
// Bodies that can be posed: the robot, and the ghosts that show its plan and what was written.

const GHOST_OPACITY = 0.38;
const GHOST_PLACES = ["beside", "overlay", "off"];
const GHOST_ASIDE = 0.62; // m to the left of the robot; the second ghost is twice as far
const GHOST_COLORS = { ghost: 0x6d8ff5, written: 0xb8793b };

// A tree of meshes with a base and joints that a configuration moves.
class Body {
  /** @type {any} */ root;
  /** @type {any} */ base;
  /** @type {{ node: any, axis: any }[]} */ joints;

  constructor(root, base, joints) {
    Object.assign(this, { root, base, joints });
  }

  pose(run, t, scratch) {
    run.interpolate(run.q, 19, 0, 19, t, scratch);
    this.base.position.set(scratch[0], scratch[1], scratch[2]);
    this.base.quaternion.set(scratch[3], scratch[4], scratch[5], scratch[6]).normalize();
    this.joints.forEach(({ node, axis }, k) => {
      node.quaternion.setFromAxisAngle(axis, scratch[7 + k]);
    });
  }

  // The same tree again, its meshes shared.
  twin() {
    const root = this.root.clone(true);
    const twins = new Map();
    const pair = (a, b) => {
      twins.set(a, b);
      a.children.forEach((child, k) => pair(child, b.children[k]));
    };
    pair(this.root, root);
    const joints = this.joints.map(({ node, axis }) => ({ node: twins.get(node), axis }));
    return new Body(root, twins.get(this.base), joints);
  }

  // Seen through, in one colour. First the depth alone, so that only its outside is seen; solid
  // parts win a tie.
  veil(color, opacity, order) {
    const { THREE } = MeshCat;
    const shared = { polygonOffset: true, polygonOffsetFactor: 2, polygonOffsetUnits: 2 };
    const depth = new THREE.MeshBasicMaterial({ ...shared, colorWrite: false });
    const skin = new THREE.MeshLambertMaterial({ ...shared, color, transparent: true, opacity, depthWrite: false });
    const meshes = [];
    this.root.traverse((item) => item.isMesh && meshes.push(item));
    for (const mesh of meshes) {
      mesh.material = depth;
      mesh.renderOrder = order;
      const over = new THREE.Mesh(mesh.geometry, skin);
      mesh.castShadow = mesh.receiveShadow = over.castShadow = over.receiveShadow = false;
      over.renderOrder = order + 0.1;
      mesh.add(over);
    }
  }
}

class Ghost {
  /** @type {RobotScene} */ scene;
  /** @type {string} */ name;
  /** @type {string} */ place;
  /** @type {Run} */ run;
  /** @type {Body} */ body;

  constructor(scene, name) {
    Object.assign(this, { scene, name, place: "beside", run: null });
  }

  // Ground distance [m] between the robot and its ghost: ahead, to the left.
  get shift() {
    if (!this.run || this.place !== "beside") return [0, 0];
    return [0, GHOST_ASIDE * (1 + this.scene.ghosts.filter((other) => other.run).indexOf(this))];
  }

  get isShown() {
    return this.run !== null && this.place !== "off";
  }

  use(data) {
    this.run = data[this.name];
    if (this.run && !this.body) this.make();
  }

  make() {
    this.body = this.scene.body.twin();
    this.body.veil(GHOST_COLORS[this.name], GHOST_OPACITY, 0.5);
    this.scene.viewer.set_object(["meshcat", this.name], this.body.root);
  }

  show(t) {
    if (!this.body) return;
    this.body.root.visible = this.isShown;
    if (!this.isShown) return;
    this.body.pose(this.run, t, this.scene.scratch);
    this.body.root.position.set(...this.shift, 0);
  }
}
