"use strict";
// Only in a page that `go2-wbc preview` serves: it shows what was saved, as soon as it is saved.

function listen(player) {
  const box = document.getElementById("error");
  const showError = (title, text, isQuiet = false) => {
    box.hidden = !title;
    box.classList.toggle("quiet", isQuiet);
    box.querySelector("strong").textContent = title;
    box.querySelector("pre").textContent = text;
  };
  let version = player.data.header.version;
  const events = new EventSource("events");
  events.onmessage = async ({ data }) => {
    const state = JSON.parse(data);
    if (state.version !== version) {
      const answer = await fetch("data");
      player.use(new ReplayData(await unpack(await answer.text()), player.data.scene));
      version = player.data.header.version;
    }
    if (state.error) showError("This does not work; the last good version is shown.", state.error);
    else showError("", "");
    player.version = version;
  };
  events.onerror = () => showError("The preview has ended.", "Start it again: this page connects by itself.", true);
}
