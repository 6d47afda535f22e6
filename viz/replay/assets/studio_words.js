"use strict";
// The English of the studio: what a call does, what an argument is and which unit it has.

const LEG_NAMES = { FL: "front left", FR: "front right", RL: "rear left", RR: "rear right" };
const LANE_NAMES = {
  trunk: ["Body", "What the trunk does"], robot: ["All", "What the whole robot or all feet do: jumps, walks, turns"],
  time: ["Time", "Pauses, tempo, and what is done to the motion as a whole"],
};
const CALL_NAMES = {
  body: "Move", body_path: "Path", pose: "Pose", posture: "Posture", look_at: "Look", foot: "Move", leg: "Bend",
  joint: "Bend", unweight: "Unload", down: "Put down", home: "Home", step: "Step", walk: "Walk", turn: "Turn",
  side_step: "Side step", path: "Walk a path", hold: "Pause", at: "Go to", bpm: "Tempo", on_beats: "On the beats",
  then: "Then", together: "Together", repeat: "Repeat", mirror: "Mirror", scale_time: "Tempo", scale: "Size",
  scale_shifts: "Shifts", scale_jumps: "Jumps", shift_height: "Height", reverse: "Backwards", loop: "Loop",
  jump: "Jump", spin_jump: "Spin jump", pounce: "Pounce", hop: "Hop", rear: "Rear up", lift: "Lift", phase: "Phase",
};
// What more (> 0) and less of a value is called, and the least that is told.
const WAYS = {
  body: { z: ["Rise", "Sink"], pitch: ["Nose down", "Nose up"], yaw: ["Turn left", "Turn right"],
    roll: ["Lean right", "Lean left"], x: ["Forward", "Back"], y: ["Left", "Right"] },
  foot: { z: ["Raise", "Lower"], x: ["Forward", "Back"], y: ["Left", "Right"] },
  step: { x: ["Step", "Step back"], y: ["Step left", "Step right"], yaw: ["Step round", "Step round"] },
  walk: { x: ["Walk", "Walk back"], y: ["Walk left", "Walk right"], turn: ["Walk, turning", "Walk, turning"] },
  turn: { angle: ["Turn left", "Turn right"] },
  side_step: { y: ["Side step left", "Side step right"] },
  jump: { height: ["Jump", "Jump"] }, spin_jump: { angle: ["Spin left", "Spin right"] },
  pounce: { x: ["Pounce", "Pounce back"] }, rear: { pitch: ["Rear", "Rear up"] },
  shift_height: { z: ["Higher", "Lower"] },
};
const ANGLE_NAMES = ["roll", "pitch", "yaw", "angle", "turn", "hip", "thigh", "calf"];
const LENGTHS = ["x", "y", "z", "height", "reach"];
const TIMES = ["over", "seconds", "t", "shift_time", "flight", "period", "crouch", "until"];
const ARGUMENTS = { // name, and what it says besides its unit
  x: ["Forward", "more than 0 is ahead, less is back"], y: ["To the left", "less than 0 is to the right"],
  z: ["Up", "less than 0 is down"], roll: ["Lean right", "less than 0 leans left"],
  pitch: ["Nose down", "less than 0 raises the nose"], yaw: ["Turn left", "less than 0 turns right"],
  turn: ["Turn left", "less than 0 turns right"], angle: ["Angle", "more than 0 turns to the left"],
  over: ["Takes", "how long the movement lasts"], seconds: ["Lasts", "how long nothing moves"],
  t: ["When", "counted from the start"], ease: ["Speed", "how it starts and stops"],
  leg: ["Foot", "FL is front left, FR front right, RL rear left, RR rear right"],
  foot: ["Foot", "the foot that stays raised"], frame: ["Goes with", "the ground, or the body that moves"],
  height: ["Height", "how high"], gait: ["Gait", "walk: foot after foot; trot: pairs across"],
  name: ["Name", "which one, or what it is called"], factor: ["Times", "2 is twice as long"],
  amplitude: ["Times", "2 is twice as large"], times: ["How often", "repetitions"],
  beats_per_minute: ["Tempo", "beats per minute"], shift_time: ["Shift takes", "before a foot is raised"],
  hip: ["Hip", "joint angle"], thigh: ["Thigh", "joint angle"], calf: ["Calf", "joint angle"],
};

// Where there is room for no word.
const SIGNS = { Rise: "\u2191", Sink: "\u2193", "Put down": "\u2193", Raise: "\u2191", Lower: "\u2193", Forward: "\u2192", Back: "\u2190", "Nose down": "\u2198",
  "Nose up": "\u2197", "Turn left": "\u21b6", "Turn right": "\u21b7", "Lean right": "\u21bb", "Lean left": "\u21ba", Home: "\u2302", Pause: "\u2016",
  Left: "\u2196", Right: "\u2199", Look: "\u25ce", Walk: "\u2192", Step: "\u2192" };

const IDLE = "changes nothing: it is there already"; // a call in whose span nothing moves

// What a call does, in a few words and in fewer.
/**
 * @param {Bar} bar
 * @returns {[string, string]}
 */
function described(bar) {
  const name = CALL_NAMES[bar.name] ?? readable(bar.name);
  const { values } = bar;
  if (bar.name === "pose" || bar.name === "posture") {
    const which = readable(String(values.name ?? values.stance ?? ""));
    return [`${name} ${which.toLowerCase()}`, which || name];
  }
  if (bar.name === "then" && values.others) {
    const which = readable(/^\s*(?:find_motion\(["'])?([\w ]+)/.exec(String(values.others))?.[1] ?? name);
    return [which, which];
  }
  if (bar.name === "hold") return [`Pause ${amount("seconds", values.seconds)}`.trim(), "Pause"];
  if (bar.name === "bpm") return [`${values.beats_per_minute ?? ""} beats/min`, "Tempo"];
  if (bar.name === "repeat" || bar.name === "hop") return [`${name} ×${values.times ?? "?"}`, name];
  if (bar.name === "scale_time") return [`${Number(values.factor) < 1 ? "Faster" : "Slower"} ×${short(values.factor)}`, "Tempo"];
  if (bar.name === "scale") return [`Size ×${short(values.amplitude)}`, "Size"];
  if (bar.name === "joint") return [`Bend ${values.joint ?? ""} ${amount("angle", values.angle)}`, `Bend ${values.joint ?? ""}`];
  const ways = Object.entries(WAYS[bar.name] ?? {}).filter(([key]) => typeof values[key] === "number" && values[key] !== 0);
  if (!ways.length) return [name, name];
  const told = ways.map(([key, [more, less]]) => [Number(values[key]) > 0 ? more : less, amount(key, Math.abs(Number(values[key])))]);
  const [first, ...rest] = told;
  const all = [first.join(" "), ...rest.map(([way, much]) => `${way.toLowerCase()} ${much}`)];
  return [all.join(", "), first[0]];
}

// A value for reading: lengths in cm, angles in degrees.
function amount(name, value) {
  if (typeof value !== "number") return value ?? "";
  if (ANGLE_NAMES.includes(name)) return `${short(value * 180 / Math.PI)}°`;
  if (LENGTHS.includes(name)) return `${short(100 * value)} cm`;
  return TIMES.includes(name) ? `${short(value)} s` : short(value);
}

function short(value) {
  return Number.isFinite(value) ? String(Number(value.toPrecision(3))) : "?";
}

// All that is known of a bar, for a tooltip and for those who hear the page.
/**
 * @param {Bar} bar
 * @param {Bar[]} bars
 */
function toldOf(bar, bars) {
  const feet = bar.parts.filter((part) => LEG_NAMES[part]).map((part) => LEG_NAMES[part]);
  const whose = feet.length && feet.length < 4 ? `${feet.join(", ")}: ` : "";
  const [start, move, end] = bar.span;
  return [
    `${readable(whose + described(bar)[0])}. From ${start.toFixed(2)} to ${end.toFixed(2)} s.`,
    move > start + 0.01 ? `Hatched: for ${(move - start).toFixed(2)} s the trunk shifts over the feet that stay.` : "",
    bar.is_idle && `${readable(IDLE)}.`,
    bar.broken && `The robot cannot do it: ${bar.broken}`,
    isOwn(bar) ? `${bar.name}(), line ${bar.site[0]}${bar.runs > 1 ? `, time ${bar.number + 1} of ${bar.runs}` : ""}` : elsewhere(bar, bars),
  ].filter(Boolean).join("\n");
}

// Why a bar cannot be changed, and what can: it belongs to a motion that is written elsewhere.
/**
 * @param {Bar} bar
 * @param {Bar[]} bars
 */
function elsewhere(bar, bars) {
  const { span } = bar;
  const around = bars.filter((one) => isOwn(one) && one.parts.includes("time") && one.span[0] <= span[0] + 1e-6 && span[2] <= one.span[2] + 1e-6);
  const [whole] = around.sort((a, b) => a.span[2] - a.span[0] - b.span[2] + b.span[0]);
  const which = whole ? `It is part of ${described(whole)[0]}, which is written` : "It is written";
  return `${which} in another file, ${placeOf(bar)}: it is changed there, or written out here.`;
}

/** @param {Bar} bar */
function placeOf({ file, line }) {
  return `${file.split(/[\\/]/).pop()}, line ${line}`;
}

// The unit that a number is shown in, of it how much one of the file's is (m, rad, or degrees in deg()),
// and to how many decimals it is written there.
/**
 * @param {Slot} slot
 * @param {string} timeUnit
 * @returns {[string, number, number]}
 */
function unitOf({ name, of, is_angle: isAngle }, timeUnit) {
  const names = [name, of, name.split(".").pop()]; // points[0].z is a z
  const isOne = (list) => names.some((one) => list.includes(one));
  if (isAngle) return ["°", 1, 6];
  if (isOne(LENGTHS)) return ["cm", 100, 6];
  if (isOne(TIMES)) return [timeUnit, 1, 6];
  return isOne(ANGLE_NAMES) ? ["°", 180 / Math.PI, 4] : ["", 1, 6];
}

function unitName(unit) {
  return { "°": "degrees", cm: "centimetres", s: "seconds" }[unit] ?? unit;
}

// How a call ends that is seen or heard on its beat: at rest a foot lands early, a trunk turns back late.
const ACCENTS = { body: "cubic", pose: "cubic", look_at: "cubic", down: "in" };
