"use strict";
// Light, floor and horizon around the robot.

const FLOOR_TILE = 0.5; // m, edge of the floor texture's repeat: two by two tiles
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

  // Keeps the sun over the robot and the floor below it.
  moveTo(x, y) {
    this.sunTarget.position.set(x, y, 0.1);
    this.sun.position.set(x + 0.7, y - 1.0, 2.2);
    this.floor.position.set(
      Math.round(x / FLOOR_TILE) * FLOOR_TILE, Math.round(y / FLOOR_TILE) * FLOOR_TILE, 0);
  }
}
