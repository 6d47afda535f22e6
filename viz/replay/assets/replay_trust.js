"use strict";
// How sure a verdict is: the chance that the movement is done, and how often it was in randomised runs.

function showTrust({ chance, world, certified }) {
  const card = document.getElementById("trust");
  card.hidden = chance === null && certified === null;
  const place = document.getElementById("chance");
  place.hidden = chance === null;
  if (chance !== null) {
    const line = plainText("p", "Chance that it is done so: ");
    const stated = chance > 0.99 ? "over 99 %" : chance < 0.01 ? "under 1 %" : percent(chance, 0);
    line.append(plainText("b", stated, chanceRank(Math.min(chance, certified && !certified.outdated ? certified.interval[1] : 1))));
    const where = plainText("p", world, "calm");
    where.title = world;
    place.replaceChildren(line, where);
  }
  const details = document.getElementById("certificate");
  details.hidden = certified === null;
  if (certified !== null) describeCertificate(details, certified);
}

function describeCertificate(details, certified) {
  const { n, done, interval: [low, high], confidence, outdated, why } = certified;
  const summary = details.querySelector("summary");
  const bounds = `${percent(confidence, 0)} interval: ${percent(low)} to ${percent(high)}`;
  summary.replaceChildren(
    plainText("b", `Certificate: done in ${done} of ${n} runs`),
    plainText("span", `${percent(done / n)}, ${bounds}`, "calm"),
    rateBar([[low, high, "interval"], [done / n, done / n, "rate"]]));
  details.classList.toggle("outdated", outdated !== "");
  if (why) summary.append(plainText("span", why, "warning"));
  if (outdated) summary.append(plainText("span", outdated, "warning"));
  const box = details.querySelector("div");
  box.replaceChildren(plainText("h3", "Worst runs"), worstTable(certified.worst), plainText("h3", "Holds for"));
  const held = document.createElement("dl");
  for (const [name, value] of [["world", certified.world], ...Object.entries(certified.versions)]) {
    held.append(plainText("dt", name), plainText("dd", value));
  }
  box.append(held);
}

function worstTable(worst) {
  const table = document.createElement("table");
  const head = document.createElement("tr");
  head.append(...["seed", "world", "what happened"].map((word) => plainText("th", word)));
  table.append(head);
  for (const run of worst) {
    const row = plainText("tr", "", run.is_done ? "" : "failed");
    row.append(plainText("td", run.seed), plainText("td", run.conditions), plainText("td", run.text));
    table.append(row);
  }
  return table;
}

// A strip from 0 to 1 with marks on it: from, to, and the class of each.
function rateBar(marks) {
  const bar = plainText("i", "", "rate-bar");
  bar.setAttribute("aria-hidden", "true");
  for (const [from, to, name] of marks) {
    const mark = plainText("i", "", name);
    mark.style.left = `${100 * from}%`;
    mark.style.width = `${100 * (to - from)}%`;
    bar.append(mark);
  }
  return bar;
}

function chanceRank(chance) {
  if (chance < 0.5) return "unlikely";
  return chance < 0.8 ? "open" : "likely";
}

function percent(share, digits = 1) {
  return `${Number((100 * share).toFixed(digits))} %`;
}
