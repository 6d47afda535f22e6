"use strict";
// The 3D view: meshcat's viewer, moved by the recording. World axes: x forward, y left, z up.

const PATH_SECONDS = 3.0; // how long a foot's path stays visible
const LEAST_WAY_OF_FOOT = 0.0005; // m between two corners of the path of all of a motion
const FORCE_SCALE = 0.002; // metres of arrow per newton
const LEAST_FORCE = 4; // N, weaker forces draw no arrow
const LIFT = { polygon: 0.0015, outline: 0.002, ring: 0.0015, spot: 0.003 }; // m above the floor
const VIEWS = { // azimuth and elevation in degrees, distance in m
  corner: [-52, 16, 1.75], side: [-90, 6, 1.65], front: [-8, 10, 1.6], top: [-90, 88, 2.0],
};
const STEEP = 0.8; // sine of the camera's angle above the floor
const ORBIT_RATE = 0.25; // rad/s
const GOOD_COLOR = 0x16a34a, BAD_COLOR = 0xdc2626, INK_COLOR = parseInt(css("ink").slice(1), 16);

class RobotScene {
  constructor(pane, data) {
    this.pane = pane;
    this.viewer = new MeshCat.Viewer(pane);
    this.viewer.set_3d_pane_size = (w, h) => this.resize(w, h);
    this.drawOnDemand();
    const { header } = data.scene;
    this.legs = header.legs;
    this.footRadius = header.foot_radius;
    this.shown = { forces: true, support: true, paths: true, follow: true, orbit: false };
    this.scratch = new Float32Array(20);
    this.stage = new Stage(this.viewer);
    this.runCommands(data.scene);
    this.body = new Body(this.node("robot"), this.node(header.base), header.joints.map((joint) => ({
      node: this.node(joint.path), axis: new MeshCat.THREE.Vector3(...joint.axis),
    })));
    for (const name of ["forces", "contacts", "com"]) this.makeMarker(this.node(name));
    this.makeSupport();
    this.ghosts = Object.keys(GHOST_COLORS).map((name) => new Ghost(this, name));
    this.ghost = this.ghosts[0]; // the plan, which is judged
    this.steps = new Steps(this);
    this.flags = new Flags(this);
    this.use(data);
    this.show(0);
    this.setView("corner");
    this.resize();
    this.viewer.controls.addEventListener("change", () => this.showThrough());
    new ResizeObserver(() => this.resize()).observe(pane);
  }

  // Takes other data, to be shown by `show`; the camera stays where it is.
  use(data) {
    this.data = data;
    this.stage.useGround(data);
    this.makePaths();
    this.steps.use(data);
    this.ghosts.forEach((ghost) => ghost.use(data));
    this.flags.use(data);
  }

  // meshcat asks for frames for ever: here one is asked for when something has changed.
  drawOnDemand() {
    const { viewer } = this;
    viewer.animate = () => {};
    viewer.needs_render = false;
    viewer.set_dirty = () => {
      if (!viewer.needs_render) requestAnimationFrame(() => viewer.needs_render && this.draw());
      viewer.needs_render = true;
    };
    viewer.set_dirty();
  }

  draw() {
    const gl = this.viewer.renderer.getContext();
    this.viewer.render();
    this.fence = gl.fenceSync?.(gl.SYNC_GPU_COMMANDS_COMPLETE, 0); // none in WebGL 1
    gl.flush();
  }

  // Whether the last picture is on its way to the screen, and no longer waits to be drawn.
  get isDrawn() {
    const gl = this.viewer.renderer.getContext();
    return !this.fence || gl.getSyncParameter(this.fence, gl.SYNC_STATUS) !== gl.UNSIGNALED;
  }

  // meshcat puts all that Python names below a node of its own.
  node(path) {
    return this.viewer.scene_tree.find(["meshcat", ...path.split("/")]).object;
  }

  resize(width = this.pane.clientWidth, height = this.pane.clientHeight) {
    const { viewer } = this;
    if (width !== this.pane.clientWidth) return;
    viewer.camera.aspect = width / Math.max(height, 1);
    viewer.camera.updateProjectionMatrix();
    viewer.renderer.setSize(width, height);
    viewer.set_dirty();
    if (this.flags) this.flags.placeNotes();
  }

  // The commands that meshcat recorded, with references to shared meshes resolved.
  runCommands(pack) {
    const meshes = Array.from({ length: pack.header.meshes }, (_, i) => this.meshData(pack, i));
    for (const command of pack.header.commands) {
      if (command.type === "set_object") {
        command.object.geometries = command.object.geometries.map((geometry) =>
          geometry.type === "SharedMesh"
            ? { uuid: geometry.uuid, type: "BufferGeometry", data: meshes[geometry.index] }
            : geometry);
      }
      this.viewer.handle_command(command);
    }
  }

  meshData(pack, index) {
    const attribute = (array, normalized) =>
      ({ itemSize: 3, type: array.constructor.name, array, normalized });
    const triangles = pack.array(`mesh${index}.triangles`);
    return {
      attributes: {
        position: attribute(pack.array(`mesh${index}.points`), false),
        normal: attribute(pack.array(`mesh${index}.normals`), true),
      },
      index: { type: triangles.constructor.name, array: triangles },
    };
  }

  // Markers neither throw nor receive shadows; those inside the robot shine through it.
  makeMarker(root) {
    root.traverse((item) => {
      if (!item.material) return;
      item.castShadow = item.receiveShadow = false;
      if (root.name === "com") for (const name of ["color", "emissive"]) item.material[name].setHex(INK_COLOR);
      if (root.name === "contacts") return;
      item.material.depthTest = false;
      item.material.transparent = true; // drawn after all that is solid
      item.renderOrder = 1;
    });
  }

  makeSupport() {
    const { THREE } = MeshCat;
    const geometry = () => {
      const made = new THREE.BufferGeometry();
      made.setAttribute("position", new THREE.BufferAttribute(new Float32Array(15), 3));
      made.setDrawRange(0, 0);
      return made;
    };
    this.polygon = new THREE.Mesh(geometry(), new THREE.MeshBasicMaterial({
      color: 0x2563eb, opacity: 0.16, transparent: true, depthWrite: false, side: THREE.DoubleSide,
    }));
    this.polygon.geometry.setIndex([0, 1, 2, 0, 2, 3]);
    this.outline = new THREE.Line(geometry(), new THREE.LineBasicMaterial({ color: 0x2563eb, transparent: true }));
    for (const object of [this.polygon, this.outline]) {
      object.frustumCulled = false;
      object.renderOrder = 0.9; // over the ghost
    }
    this.viewer.set_object(["meshcat", "support", "polygon"], this.polygon);
    this.viewer.set_object(["meshcat", "support", "outline"], this.outline);
  }

  // Each foot's way: the last seconds of it; of a motion also, paler, all of it.
  makePaths() {
    const { THREE } = MeshCat;
    const { feet, frames, header } = this.data;
    this.paths = this.legs.map((leg, k) => {
      const points = new Float32Array(3 * frames);
      const way = []; // a foot that stands adds nothing to it
      let last = [Infinity, 0, 0];
      for (let i = 0; i < frames; i++) {
        const [x, y, z] = feet.subarray(12 * i + 3 * k, 12 * i + 3 * k + 3);
        points.set([x, y, z], 3 * i);
        if (Math.hypot(x - last[0], y - last[1], z - last[2]) > LEAST_WAY_OF_FOOT) way.push(...last = [x, y, z]);
      }
      const line = (corners, opacity) => new THREE.Line(
        new THREE.BufferGeometry().setAttribute("position", new THREE.BufferAttribute(corners, 3)),
        new THREE.LineBasicMaterial({ color: header.leg_colors[k], opacity, transparent: opacity < 1 }));
      const [late, whole] = [line(points, 1), line(new Float32Array(way), 0.3)];
      whole.visible = header.verdict !== null;
      for (const item of [late, whole]) item.frustumCulled = false;
      this.viewer.set_object(["meshcat", "paths", leg, "late"], late);
      this.viewer.set_object(["meshcat", "paths", leg, "whole"], whole);
      return late;
    });
  }

  show(t) {
    const { data } = this;
    this.body.pose(data, t, this.scratch);
    this.poseForces(t);
    this.poseSupport(t);
    this.ghosts.forEach((ghost) => ghost.show(t));
    const frame = data.frameAt(t);
    const from = Math.max(0, frame - Math.round(PATH_SECONDS * data.rate));
    this.node("paths").visible = this.shown.paths;
    for (const line of this.paths) line.geometry.setDrawRange(from, frame - from + 1);
    this.steps.show(t);
    this.follow(t);
    this.flags.show(t);
    this.viewer.set_dirty();
  }

  poseForces(t) {
    const { data, scratch, shown } = this;
    const frame = data.frameAt(t);
    data.interpolate(data.feet, 12, 0, 12, t, scratch);
    this.legs.forEach((leg, k) => {
      const [x, y, z] = scratch.subarray(3 * k, 3 * k + 3);
      const force = data.forces[4 * frame + k];
      const ground = this.underside(z);
      const arrow = this.node(`forces/${leg}`);
      arrow.visible = shown.forces && force > LEAST_FORCE;
      arrow.position.set(x, y, ground);
      const shaft = Math.max(force * FORCE_SCALE - 0.035, 0.001);
      this.node(`forces/${leg}/shaft`).scale.set(1, 1, shaft);
      this.node(`forces/${leg}/head`).position.z = shaft;
      const ring = this.node(`contacts/${leg}`);
      ring.visible = shown.forces && force > LEAST_FORCE;
      ring.position.set(x, y, ground + LIFT.ring);
    });
  }

  poseSupport(t) {
    const { data, shown } = this;
    const com = data.interpolate(data.com, 3, 0, 3, t, this.scratch);
    const [x, y, z] = com;
    for (const name of ["com", "support"]) this.node(name).visible = shown.support;
    const floor = Math.min(...this.groundHeights(t));
    this.node("com/ball").position.set(x, y, z);
    this.node("com/line").position.set(x, y, floor);
    this.node("com/line").scale.set(1, 1, Math.max(z - floor, 0.001));
    this.node("com/spot").position.set(x, y, floor + LIFT.spot);
    const margin = data.margin[data.frameAt(t)];
    const color = Number.isNaN(margin) ? INK_COLOR : margin >= 0 ? GOOD_COLOR : BAD_COLOR;
    this.node("com/spot").traverse((item) => item.material && item.material.color.setHex(color));
    this.drawPolygon(convexHull(this.stanceFeet(t)));
    this.showThrough();
  }

  // Seen from above the robot would cover its support polygon: then the polygon shines through.
  showThrough() {
    const { camera, controls } = this.viewer;
    const offset = camera.position.clone().sub(controls.target);
    const isSteep = offset.y > STEEP * offset.length();
    for (const { material } of [this.polygon, this.outline]) material.depthTest = !isSteep;
  }

  // Below a foot whose centre is at z. Simulated feet press a little into the floor, which would hide
  // what is drawn there.
  underside(z) {
    return Math.max(z - this.footRadius, this.stage.bottom);
  }

  groundHeights(t) {
    const frame = this.data.frameAt(t);
    return this.legs.map((_, k) => this.underside(this.data.feet[12 * frame + 3 * k + 2]));
  }

  stanceFeet(t) {
    const { feet, stance } = this.data;
    const frame = this.data.frameAt(t);
    return this.legs.map((_, k) => k).filter((k) => stance[4 * frame + k]).map((k) => {
      const at = 12 * frame + 3 * k;
      return [feet[at], feet[at + 1], this.underside(feet[at + 2])];
    });
  }

  drawPolygon(corners) {
    const fill = (object, points, lift) => {
      const { position } = object.geometry.attributes;
      points.forEach((p, i) => position.setXYZ(i, p[0], p[1], p[2] + lift));
      position.needsUpdate = true;
    };
    fill(this.polygon, corners, LIFT.polygon);
    fill(this.outline, corners.length ? [...corners, corners[0]] : [], LIFT.outline);
    this.polygon.geometry.setDrawRange(0, corners.length < 3 ? 0 : 3 * (corners.length - 2));
    this.outline.geometry.setDrawRange(0, corners.length < 2 ? 0 : corners.length + 1);
  }

  // Keeps sun, floor and (if wanted) camera with the robot.
  follow(t) {
    const { data, viewer } = this;
    const [x, y, z] = data.interpolate(data.target, 3, 0, 3, t, this.scratch);
    this.stage.moveTo(x, y, z);
    if (this.lastTarget && this.shown.follow) {
      const [dx, dy, dz] = [x, y, z].map((value, i) => value - this.lastTarget[i]);
      for (const point of [viewer.camera.position, viewer.controls.target]) {
        point.x += dx; // the viewer's own axes: x, z up becomes y, y becomes -z
        point.z -= dy;
        point.y += dz;
      }
    }
    this.lastTarget = [x, y, z];
  }

  setView(name) {
    const [azimuth, elevation, distance] = VIEWS[name];
    const [a, e] = [azimuth * Math.PI / 180 + this.heading(), elevation * Math.PI / 180];
    const { camera, controls } = this.viewer;
    const room = Math.max(...this.ghosts.map((ghost) => ghost.shift[1])) / 2;
    const [x, y, z] = [this.lastTarget[0], this.lastTarget[1] + room, this.lastTarget[2] + 0.22];
    const reach = (distance + room) * Math.max(1, 1.25 / camera.aspect);
    controls.target.set(x, z, -y);
    camera.position.set(
      x + reach * Math.cos(e) * Math.cos(a), z + reach * Math.sin(e),
      -(y + reach * Math.cos(e) * Math.sin(a)));
    controls.update();
    this.showThrough();
    this.viewer.set_dirty();
  }

  heading() {
    const { x, y, z, w } = this.body.base.quaternion;
    return Math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z));
  }

  orbit(seconds) {
    const { camera, controls } = this.viewer;
    const offset = camera.position.clone().sub(controls.target);
    offset.applyAxisAngle(new MeshCat.THREE.Vector3(0, 1, 0), ORBIT_RATE * seconds);
    camera.position.copy(controls.target).add(offset);
    this.viewer.set_dirty();
  }
}

// Corners of the convex hull of at most four points, counter-clockwise (Andrew's monotone chain).
function convexHull(points) {
  if (points.length < 3) return points;
  const sorted = [...points].sort((a, b) => a[0] - b[0] || a[1] - b[1]);
  const turn = (a, b, c) => (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
  const half = (list) => {
    const chain = [];
    for (const p of list) {
      while (chain.length > 1 && turn(chain[chain.length - 2], chain[chain.length - 1], p) <= 0) chain.pop();
      chain.push(p);
    }
    return chain.slice(0, -1);
  };
  return [...half(sorted), ...half(sorted.reverse())];
}
