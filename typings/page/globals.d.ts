// What the scripts of the page get from elsewhere: the viewer, the server's answers, and one another.

/** Of meshcat's bundle, which carries three.js. */
declare const MeshCat: any;

interface Window {
  /** The page, for scripts and tests. */
  replay: Player;
  studio: Studio;
}

/** A time span [s], or the part of it that is shown. */
interface Span { from: number; length: number }

/** An argument of a call as it is written; see `controller.studio.source.Slot`. */
interface Slot {
  name: string;
  code: string;
  span: [number, number] | null;
  value: number | string | null;
  is_angle: boolean;
  place: string;
  why: string;
  of: string;
  is_member: boolean;
  /** Of `a if x else b`: whether it is the one that was taken; null where that is not known. */
  plays: boolean | null;
}

/** A call of the file; see `controller.studio.orders.Bar`. */
interface Bar {
  name: string;
  /** Where it ends: line and column; [0, 0] in another file. */
  site: [number, number];
  runs: number;
  number: number;
  /** When [s] it starts, its move starts, and it ends. */
  span: [number, number, number];
  parts: string[];
  broken: string;
  slots: Slot[];
  values: Record<string, number | string>;
  more: string[];
  /** Where it is written, if that is another file. */
  file: string;
  line: number;
  /** Nothing moves in its span, and it is no pause. */
  is_idle: boolean;
}

/** What the studio shows; see `controller.studio.session`. */
interface Editor {
  bars: Bar[];
  file: string;
  motion: string;
  motions: string[];
  base: string;
  undo: boolean;
  redo: boolean;
  palette: string[];
  songs: string[];
  exports: Record<string, string>;
  /** How many runs may be asked for. */
  runs: number[];
  notes: string[];
  words: Record<string, string[]>;
  lanes: string[];
  /** In which it is checked and played; see `controller.studio.worlds`. */
  world: {
    friction: number; payload: number; sensors: string;
    told: string;
    is_usual: boolean;
    ranges: Record<string, [number, number]>;
    choices: string[];
    ground: string; size: number;
    /** That the verdict is of level ground, where it is played on another. */
    warning: string;
    grounds: Record<string, { size: string; unit: string; range: [number, number] }>;
  };
}

/** An edit that is asked for; see `controller.studio.edits`. */
interface Order { op: string; [more: string]: unknown }

/** A song beside the file; see `controller.studio.songs`. */
interface Song { name: string; peaks: Uint8Array; peak_rate: number; tempo: number; metre: number }
