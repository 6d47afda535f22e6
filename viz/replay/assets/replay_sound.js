"use strict";
// The music of a dance, in step with the player.

const OUT_OF_STEP = 0.03; // s, from which on the picture follows the music

class Sound {
  constructor() {
    this.audio = null;
    this.kept = null;
    this.isMuted = false;
    this.button = document.querySelector("[data-sound]");
  }

  // Music (an MP3 file) that goes with whatever is shown.
  keep(song) {
    this.kept = song;
  }

  use(data) {
    const sound = data.sound ?? this.kept;
    if (sound && sound === this.sound) return;
    this.sound = sound;
    this.play(false, 0, 1);
    if (this.audio) URL.revokeObjectURL(this.audio.src);
    const file = sound && new Blob([sound], { type: "audio/mpeg" });
    this.audio = file && new Audio(URL.createObjectURL(file));
    if (this.audio) this.audio.muted = this.isMuted;
    document.getElementById("app").classList.toggle("has-sound", this.audio !== null);
  }

  // Silent, but still what the picture follows.
  toggle() {
    this.isMuted = this.audio.muted = !this.isMuted;
    this.button.textContent = this.isMuted ? "Sound: off" : "Sound: on";
    this.button.classList.toggle("on", !this.isMuted);
  }

  // A browser lets a page sound once it was clicked; before that the picture moves alone.
  play(isPlaying, time, speed) {
    const { audio } = this;
    if (!audio) return;
    audio.pause();
    if (!isPlaying) return;
    audio.currentTime = time;
    audio.playbackRate = speed;
    audio.play().catch(() => {});
  }

  // The player's next time: that of the music where it is heard and the picture is out of step.
  follow(time) {
    const { audio } = this;
    if (!audio || audio.paused || audio.ended || audio.seeking) return time;
    return Math.abs(audio.currentTime - time) > OUT_OF_STEP ? audio.currentTime : time;
  }
}
