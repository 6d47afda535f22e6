"use strict";
// Sound in step with the movement. The picture follows the sound, which then never stutters.

const SILENCE = 128, LOUDEST = 127, COMPRESSION = 255; // of the mu-law in which it is stored
const FULL_SCALE = 32767; // of a 16-bit sample
const OUT_OF_STEP = 0.15; // s, more is caught up at once
const PULL = 0.2; // share of a smaller error that is made up with each picture

class Soundtrack {
  constructor() {
    this.button = document.querySelector("[data-sound]");
    this.audio = new Audio();
    this.audio.preload = "auto";
    this.isOn = false; // browsers start no sound before a click
    this.duration = 0;
  }

  use(data) {
    const { sound, header: { sound_rate: rate } } = data;
    document.getElementById("app").classList.toggle("has-sound", sound !== null);
    this.audio.pause();
    if (this.audio.src) URL.revokeObjectURL(this.audio.src);
    this.duration = sound ? sound.length / rate : 0;
    if (sound) this.audio.src = URL.createObjectURL(wavFile(sound, rate));
  }

  turn(isOn) {
    this.isOn = isOn && this.duration > 0;
    this.button.classList.toggle("on", this.isOn);
    this.button.textContent = this.isOn ? "Sound: on" : "Sound: off";
  }

  // Starts, stops and speeds up with the page.
  follow({ time, speed, isPlaying }) {
    const { audio } = this;
    const isHeard = this.isOn && isPlaying && time < this.duration;
    if (isHeard && audio.playbackRate !== speed) audio.playbackRate = speed;
    if (isHeard && audio.paused && !audio.ended) {
      audio.currentTime = time;
      audio.play().catch((error) => error.name === "AbortError" || this.turn(false));
    }
    if (!isHeard && !audio.paused) audio.pause();
  }

  // The time that the picture shall show instead of `t`, so that it is in step.
  steer(t) {
    const { audio } = this;
    const isRunning = !audio.paused && !audio.seeking && audio.readyState > HTMLMediaElement.HAVE_CURRENT_DATA;
    if (!isRunning) return t;
    const error = audio.currentTime - t;
    return Math.abs(error) > OUT_OF_STEP ? audio.currentTime : t + PULL * error;
  }

  jump(t) {
    if (this.duration) this.audio.currentTime = Math.min(t, this.duration);
  }
}

// Stored bytes as a WAV file of 16-bit samples, one channel: what every browser plays.
function wavFile(stored, rate) {
  const table = Int16Array.from({ length: 256 }, (_, byte) => {
    const share = (byte - SILENCE) / LOUDEST;
    const amplitude = ((1 + COMPRESSION) ** Math.min(Math.abs(share), 1) - 1) / COMPRESSION;
    return Math.round(FULL_SCALE * Math.sign(share) * amplitude);
  });
  const bytes = 2 * stored.length;
  const file = new DataView(new ArrayBuffer(44 + bytes));
  const words = (at, text) => [...text].forEach((letter, k) => file.setUint8(at + k, letter.charCodeAt(0)));
  words(0, "RIFF");
  file.setUint32(4, 36 + bytes, true);
  words(8, "WAVEfmt ");
  file.setUint32(16, 16, true);
  file.setUint16(20, 1, true); // plain samples
  file.setUint16(22, 1, true); // channels
  file.setUint32(24, rate, true);
  file.setUint32(28, 2 * rate, true); // bytes a second
  file.setUint16(32, 2, true);
  file.setUint16(34, 16, true);
  words(36, "data");
  file.setUint32(40, bytes, true);
  stored.forEach((byte, k) => file.setInt16(44 + 2 * k, table[byte], true));
  return new Blob([file.buffer], { type: "audio/wav" });
}
