"use strict";
// Fewer triangles and pixels, and a plain floor, for as long as a hand moves something: a computer that draws without a
// graphics card needs 0.4 s for all of the robot's.

const COARSE_CELL = [0.02, 0.05], COARSE_SHARE = 0.35; // m, of a part's second extent; the corners of triangles within it become one
const COARSE_PIXELS = 0.5; // share of the pixels along a line
const COARSE_TIME = 1000; // ms, after which a hand that holds still sees all again

// The triangles between the first corners of their cells (Rossignac & Borrel, Modeling in computer
// graphics, 1993: vertex clustering); those that fall together are left out.
function coarseTriangles(geometry) {
  const { THREE } = MeshCat;
  const { array } = geometry.attributes.position;
  if (!geometry.boundingBox) geometry.computeBoundingBox();
  const [, across] = geometry.boundingBox.getSize(new THREE.Vector3()).toArray().sort((a, b) => b - a);
  const size = Math.min(Math.max(COARSE_SHARE * across, COARSE_CELL[0]), COARSE_CELL[1]);
  const cells = new Map();
  const corner = geometry.index.array.map((k) => {
    const cell = [0, 1, 2].map((axis) => Math.round(array[3 * k + axis] / size)).join();
    if (!cells.has(cell)) cells.set(cell, k);
    return cells.get(cell);
  });
  const kept = [];
  for (let k = 0; k < corner.length; k += 3) {
    const [a, b, c] = corner.subarray(k, k + 3);
    if (a !== b && b !== c && c !== a) kept.push(a, b, c);
  }
  return new THREE.BufferAttribute(new Uint32Array(kept), 1);
}

class Coarse {
  constructor(viewer) {
    this.viewer = viewer;
    this.isOn = false;
    this.ratio = viewer.renderer.getPixelRatio();
    this.indexes = new Map(); // of a geometry: all its triangles, and the coarse ones
    const gl = viewer.renderer.getContext();
    const known = gl.getExtension("WEBGL_debug_renderer_info");
    const name = known ? gl.getParameter(known.UNMASKED_RENDERER_WEBGL) : "";
    this.isNeeded = /swiftshader|llvmpipe|software/i.test(name);
  }

  use(isOn) {
    clearTimeout(this.timer);
    if (isOn) this.timer = setTimeout(() => this.use(false), COARSE_TIME);
    if (!this.isNeeded || isOn === this.isOn) return;
    this.isOn = isOn;
    this.viewer.scene.traverse(({ geometry, material }) => {
      if (material?.map) { // the floor: looked up once a pixel, not up to 16 times
        material.map.anisotropy = isOn ? 1 : this.viewer.renderer.capabilities.getMaxAnisotropy();
        material.map.needsUpdate = true;
      }
      if (!geometry?.index || geometry.type !== "BufferGeometry") return; // of a shape that is none of the robot's
      if (!this.indexes.has(geometry)) this.indexes.set(geometry, [geometry.index, coarseTriangles(geometry)]);
      geometry.setIndex(this.indexes.get(geometry)[isOn ? 1 : 0]);
    });
    this.viewer.renderer.setPixelRatio(isOn ? COARSE_PIXELS * this.ratio : this.ratio);
    this.viewer.set_dirty();
  }
}
