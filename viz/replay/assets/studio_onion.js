"use strict";
// Onion skins: the robot as it was and as it will be around the playhead, seen through.

const SKINS = [ // s from the playhead, colour, how much is seen of it; the farthest are drawn first
  [-0.6, 0x2f7fd6, 0.25], [0.6, 0xd9731a, 0.25], [-0.3, 0x2f7fd6, 0.42], [0.3, 0xd9731a, 0.42],
];
const LEAST_WAY = 0.03; // m or rad: one that is as near to the robot hides it, and shows nothing

class Onion {
  /** @type {Studio} */ studio;
  /** @type {boolean} */ isOn;
  /** @type {{ after: number, body: Body }[]} */ skins;
  /** @type {Float32Array} */ there;
  /** @type {Float32Array} */ here;

  constructor(studio) {
    Object.assign(this, { studio, isOn: false, skins: [], there: new Float32Array(20), here: new Float32Array(20) });
  }

  toggle() {
    this.isOn = !this.isOn;
    if (!this.skins.length) this.make();
    const button = document.querySelector("[data-do=onion]");
    button.classList.toggle("on", this.isOn);
    button.setAttribute("aria-pressed", String(this.isOn));
    this.show(this.studio.player.time);
    this.studio.player.scene.viewer.set_dirty();
  }

  make() {
    const { scene } = this.studio.player;
    this.skins = SKINS.map(([after, color, opacity], k) => {
      const body = scene.body.twin();
      body.veil(color, opacity, 0.1 + 0.1 * k);
      scene.viewer.set_object(["meshcat", "skins", String(k)], body.root);
      return { after, body };
    });
  }

  show(t) {
    const { data } = this.studio.player;
    data.interpolate(data.q, 19, 0, 19, t, this.here);
    for (const { after, body } of this.skins) {
      const then = t + after;
      const isInside = then >= 0 && then <= data.duration;
      body.root.visible = this.isOn && isInside && this.isElsewhere(data, then);
      if (body.root.visible) body.pose(data, then, this.there);
    }
  }

  isElsewhere(data, t) {
    data.interpolate(data.q, 19, 0, 19, t, this.there);
    return this.there.some((value, k) => k < 19 && Math.abs(value - this.here[k]) > LEAST_WAY);
  }
}
