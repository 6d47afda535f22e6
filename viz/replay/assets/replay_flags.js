"use strict";
// Broken limits in the 3D view: the parts concerned turn red, and a note says what is wrong.

const FLAG_COLOR = 0xef2b2b;
const MOST_NOTES = 3;
const NOTE_GAP = 8; // px between notes

class Flags {
  constructor(scene) {
    this.scene = scene;
    this.box = document.getElementById("notes");
    this.leads = this.box.querySelector("svg");
    this.header = document.querySelector("header");
    this.materials = new Map(); // of a mesh: its own, and that in red
    this.parts = partsOf(scene.body.root);
    scene.viewer.controls.addEventListener("change", () => this.placeNotes());
  }

  // What is judged is the plan: where the ghost shows it, beside what was measured, that turns red.
  judged() {
    const { ghost } = this.scene;
    if (this.data.header.is_plan || !ghost.isShown) return this.parts;
    this.ghostParts = this.ghostParts || partsOf(ghost.body.root);
    return this.ghostParts;
  }

  use(data) {
    this.data = data;
    this.active = null;
  }

  show(t) {
    const broken = this.data.brokenAt(t);
    const key = [this.scene.ghost.isShown, ...broken.map((annotation) => annotation.limit + annotation.subject)].join();
    if (key !== this.active) {
      this.active = key;
      this.paint(new Set(broken.flatMap((annotation) => annotation.parts)));
      this.write(broken);
    }
    this.placeNotes();
  }

  paint(names) {
    const judged = this.judged();
    for (const parts of [this.parts, this.ghostParts || new Map()]) {
      for (const [name, meshes] of parts) {
        for (const mesh of meshes) this.setRed(mesh, parts === judged && names.has(name));
      }
    }
    const ball = this.scene.node("com/ball");
    ball.traverse((item) => {
      if (item.material) item.material.color.setHex(names.has("com") ? FLAG_COLOR : INK_COLOR);
    });
    ball.scale.setScalar(names.has("com") ? 1.6 : 1);
  }

  setRed(mesh, isRed) {
    if (!this.materials.has(mesh)) this.materials.set(mesh, [mesh.material, reddened(mesh.material)]);
    mesh.material = this.materials.get(mesh)[isRed ? 1 : 0];
  }

  write(broken) {
    this.notes = broken.slice(0, MOST_NOTES).map((annotation) => {
      const note = document.createElement("div");
      note.className = "note";
      const what = plainText("b", `${annotation.limit}: ${readableSubject(annotation.subject)}`);
      note.append(what, plainText("span", annotation.text));
      const lead = document.createElementNS(this.leads.namespaceURI, "path");
      return { note, lead, annotation };
    });
    const more = broken.length - this.notes.length;
    this.box.replaceChildren(this.leads, ...this.notes.map(({ note }) => note));
    this.leads.replaceChildren(...this.notes.map(({ lead }) => lead));
    if (more > 0) this.box.append(plainText("div", `and ${more} more`, "more"));
  }

  // A column at the right edge, in the order of the parts from top to bottom, each with a line to
  // its part.
  placeNotes() {
    if (!this.notes || !this.notes.length) return;
    const { clientWidth: width, clientHeight: height } = this.scene.pane;
    const { camera } = this.scene.viewer;
    camera.updateMatrixWorld();
    const placed = this.notes.map((item) => {
      const seen = this.placeOf(item.annotation.parts[0]).project(camera);
      return { ...item, x: (seen.x + 1) / 2 * width, y: (1 - seen.y) / 2 * height };
    }).sort((a, b) => a.y - b.y);
    let top = this.header.offsetTop + this.header.offsetHeight + NOTE_GAP;
    for (const { note, lead, x, y } of placed) {
      const left = Math.max(width - note.offsetWidth - 14, 8);
      note.style.transform = `translate(${left}px, ${top}px)`;
      const middle = top + note.offsetHeight / 2;
      lead.setAttribute("d", `M${left} ${middle} H${left - 14} L${x} ${y} m-4 0 a4 4 0 1 0 8 0 a4 4 0 1 0 -8 0`);
      top += note.offsetHeight + NOTE_GAP;
    }
    const more = /** @type {HTMLElement} */ (this.box.querySelector(".more"));
    if (more) more.style.transform = `translate(${width - more.offsetWidth - 18}px, ${top}px)`;
  }

  // Middle of a part in the viewer's own axes.
  placeOf(name) {
    const [mesh] = this.judged().get(name) || [];
    if (!mesh) return this.scene.node("com/ball").getWorldPosition(new MeshCat.THREE.Vector3());
    if (!mesh.geometry.boundingSphere) mesh.geometry.computeBoundingSphere();
    mesh.updateWorldMatrix(true, false);
    return mesh.localToWorld(mesh.geometry.boundingSphere.center.clone());
  }
}

// The coloured meshes of a body by the name of their link.
function partsOf(root) {
  const parts = new Map();
  root.traverse((item) => {
    const name = /^((?:[FR][LR]_)?[a-z]+)_\d+$/.exec(item.name);
    if (!name) return;
    const meshes = parts.get(name[1]) || [];
    item.traverse((mesh) => mesh.isMesh && mesh.material.colorWrite && meshes.push(mesh));
    parts.set(name[1], meshes);
  });
  return parts;
}

function reddened(material) {
  const red = material.clone();
  red.color.setHex(FLAG_COLOR);
  red.emissive.setHex(0x7a0d0d);
  red.opacity = Math.min(2 * material.opacity, 1);
  return red;
}

function readableSubject(subject) {
  return subject.replaceAll("_", " ");
}
