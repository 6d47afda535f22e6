"use strict";
// Light, floor and horizon around the robot.

const FLOOR_TILE = 0.5; // m, edge of the floor texture's repeat: two by two tiles
const UNKNOWN = -32768, LEAST_SPAN = 0.3, BELOW = 0.02; // mm of a cell that was not seen; m; m
const IS_DARK = matchMedia("(prefers-color-scheme: dark)");
IS_DARK.addEventListener("change", () => location.reload());

// A colour of the style sheet, which knows whether the page is dark.
function css(name) {
  return getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
}

class Stage {
  constructor(viewer) {
    this.viewer = viewer;
    const { THREE } = MeshCat;
    for (const name of ["Axes", "Grid"]) viewer.set_property([name], "visible", false);
    const background = new THREE.Color(css("horizon"));
    for (const end of ["top_color", "bottom_color"]) {
      viewer.set_property(["Background"], end, background.toArray());
    }
    viewer.scene.fog = new THREE.Fog(css("horizon"), 3, 11);
    viewer.camera.fov = 32;
    viewer.camera.near = 0.05;
    viewer.camera.far = 60;
    viewer.controls.maxPolarAngle = Math.PI / 2 - 0.01;
    viewer.controls.minDistance = 0.5;
    viewer.controls.maxDistance = 12;
    this.setUpLights();
    this.makeFloor();
  }

  setUpLights() {
    const { viewer } = this;
    const { THREE } = MeshCat;
    for (const name of ["PointLightNegativeX", "PointLightPositiveX", "FillLight", "AmbientLight"]) {
      viewer.set_property(["Lights", name], "visible", false);
    }
    viewer.set_object(["Lights", "Sky"], new THREE.HemisphereLight(0xffffff, 0xaab2c0, 0.66));
    this.sun = new THREE.DirectionalLight(0xffffff, 0.5);
    this.sun.castShadow = true;
    viewer.renderer.shadowMap.type = THREE.PCFShadowMap; // the kind with a radius
    this.sun.shadow.mapSize.set(1024, 1024);
    this.sun.shadow.radius = 3.5;
    this.sun.shadow.bias = -0.001;
    this.sun.shadow.normalBias = 0.006;
    Object.assign(this.sun.shadow.camera, {
      left: -0.9, right: 0.9, top: 0.9, bottom: -0.9, near: 0.5, far: 6,
    });
    viewer.set_object(["Lights", "Sun"], this.sun);
    this.sunTarget = new THREE.Object3D();
    viewer.set_object(["Lights", "SunTarget"], this.sunTarget);
    this.sun.target = this.sunTarget;
    const fill = new THREE.DirectionalLight(0xffffff, 0.16);
    fill.position.set(-2, -1, 1);
    viewer.set_object(["Lights", "Back"], fill);
  }

  makeFloor() {
    const { THREE } = MeshCat;
    const canvas = document.createElement("canvas");
    canvas.width = canvas.height = 256;
    const paint = canvas.getContext("2d");
    paint.fillStyle = css("tile");
    paint.fillRect(0, 0, 256, 256);
    paint.fillStyle = css("other-tile");
    paint.fillRect(0, 0, 128, 128);
    paint.fillRect(128, 128, 128, 128);
    const texture = new THREE.CanvasTexture(canvas);
    texture.wrapS = texture.wrapT = THREE.RepeatWrapping;
    texture.anisotropy = this.viewer.renderer.capabilities.getMaxAnisotropy();
    const width = 60 * FLOOR_TILE;
    texture.repeat.set(60, 60);
    const tiles = new THREE.Mesh(
      new THREE.PlaneGeometry(width, width), new THREE.MeshBasicMaterial({ map: texture }));
    const shade = new THREE.Mesh(
      new THREE.PlaneGeometry(8, 8),
      new THREE.ShadowMaterial({ opacity: 0.3, depthWrite: false }));
    shade.receiveShadow = true;
    shade.position.z = 0.0006;
    this.floor = new THREE.Group();
    this.floor.add(tiles, shade);
    this.viewer.set_object(["floor"], this.floor);
  }

  // What the robot has seen of the ground, by height; the floor is then below all of it.
  useGround(data) {
    const { THREE } = MeshCat;
    const geometry = new THREE.BufferGeometry();
    this.bottom = 0;
    if (data.ground) {
      const { x, y, cell, shape: [n, k], heights, low, colors } = data.ground;
      const high = heights.reduce((most, z) => Math.max(most, z), -Infinity) / 1000;
      const span = Math.max(high - low, LEAST_SPAN);
      const table = colors.map((color) => new THREE.Color(color));
      const [points, tints, corners] = [[], [], []];
      const isKnown = (cell) => heights[cell] !== UNKNOWN;
      heights.forEach((height, i) => {
        const z = height / 1000;
        points.push(x + cell * Math.floor(i / k), y + cell * (i % k), z);
        const at = Math.min(Math.max((z - (low + high) / 2) / span + 0.5, 0), 1) * (table.length - 1);
        const first = Math.min(Math.floor(at), table.length - 2);
        tints.push(...table[first].clone().lerp(table[first + 1], at - first).toArray());
        const [ahead, left] = [i + k, i + 1];
        if (left % k === 0 || ahead >= n * k) return;
        for (const triangle of [[i, ahead, ahead + 1], [i, ahead + 1, left]]) {
          if (triangle.every(isKnown)) corners.push(...triangle);
        }
      });
      geometry.setAttribute("position", new THREE.Float32BufferAttribute(points, 3));
      geometry.setAttribute("color", new THREE.Float32BufferAttribute(tints, 3));
      geometry.setIndex(corners);
      geometry.computeVertexNormals();
      this.bottom = Math.min(low, 0) - BELOW;
    }
    const shades = new THREE.Mesh(geometry, new THREE.MeshLambertMaterial({
      vertexColors: true, polygonOffset: true, polygonOffsetFactor: 2, polygonOffsetUnits: 8,
    }));
    shades.receiveShadow = true;
    this.viewer.set_object(["ground"], shades);
  }

  // Keeps the sun over the robot and the floor below it.
  moveTo(x, y, z) {
    this.sunTarget.position.set(x, y, z + 0.1);
    this.sun.position.set(x + 0.7, y - 1.0, z + 2.2);
    this.floor.position.set(
      Math.round(x / FLOOR_TILE) * FLOOR_TILE, Math.round(y / FLOOR_TILE) * FLOOR_TILE, this.bottom);
  }
}
