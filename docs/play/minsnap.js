// The planner in the browser or in node: the native core, compiled to WebAssembly.
//
//     import { load } from "./minsnap.js";
//     const minsnap = await load();
//     const plan = minsnap.plan({ waypoints: [[0, 0, 1], [8, 0, 1]], limits: { speed: 3, acceleration: 5, jerk: 30 }, corridor: 0.3 });

export const STATUSES = ["DONE", "BAD_SIZE", "BAD_NUMBER", "NO_MEMORY", "UNSUPPORTED", "SINGULAR", "NOT_PROVED", "INFEASIBLE", "NO_PROGRESS", "SPENT"];

// What the core asks of its system: a clock. It opens no file, and what it would print is left out.
function system(memory) {
  const view = () => new DataView(memory().buffer);
  const nothing = () => 0;
  return new Proxy(
    {
      clock_time_get: (_kind, _precision, to) => (view().setBigUint64(to, BigInt(Math.round(performance.now() * 1e6)), true), 0),
      proc_exit: (status) => {
        throw new Error(`the core ended with status ${status}`);
      },
      fd_write: () => 8,
    },
    { get: (known, name) => known[name] ?? nothing, has: () => true },
  );
}

// The core that lies beside this file; node fetches no files.
async function beside() {
  const url = new URL("./minsnap.wasm", import.meta.url);
  if (url.protocol === "file:") return (await import("node:fs/promises")).readFile(url);
  return (await fetch(url)).arrayBuffer();
}

/**
 * Compile the core.
 * @param {BufferSource} [bytes] minsnap.wasm; by default the one beside this file
 */
export async function load(bytes) {
  const module = await WebAssembly.compile(bytes ?? (await beside()));
  const own = system(() => instance.exports.memory);
  const imports = {};
  for (const { module: from, name } of WebAssembly.Module.imports(module)) (imports[from] ??= {})[name] = own[name];
  const instance = await WebAssembly.instantiate(module, imports);
  const core = instance.exports;
  core._initialize?.();
  const room = (count) => new Float64Array(core.memory.buffer, core.play_room(), count);
  const text = (at) => {
    const bytes = new Uint8Array(core.memory.buffer, at);
    return new TextDecoder().decode(bytes.slice(0, bytes.indexOf(0)));
  };

  /**
   * Plan the quickest curve within limits, or the one of least cost in a total time; certified.
   * @param {{waypoints: number[][], limits?: {speed?: number, acceleration?: number, jerk?: number, max_thrust?: number, tilt?: number, body_rate?: number},
   *   total_time?: number, corridor?: number, pieces?: number}} question SI units, z up; `pieces` 0 or none to have them chosen
   * @returns {{status: string, message: string, legs: number, pieces: number, duration: number, cost: number, certified: boolean, margin: number,
   *   speed: number, acceleration: number, jerk: number, thrust: number, tilt: number, body_rate: number, milliseconds: number}}
   */
  function plan({ waypoints, limits = {}, total_time = 0, corridor = 0, pieces = 0 }) {
    const kinds = ["speed", "acceleration", "jerk", "max_thrust", "tilt", "body_rate"];
    const given = [waypoints.length, pieces, total_time, corridor, ...kinds.map((kind) => limits[kind] ?? 0), ...waypoints.flat()];
    if (waypoints.length > 200 || waypoints.some((point) => point.length !== 3)) return { status: "BAD_SIZE", message: "give at most 200 waypoints of x, y, z", legs: 0 };
    room(given.length).set(given);
    const began = performance.now();
    const status = core.play_plan();
    const milliseconds = performance.now() - began;
    const message = text(core.play_message());
    if (status !== 0 && status !== 9) return { status: STATUSES[status], message, legs: 0, milliseconds };
    const [legs, per_leg, duration, cost, kept, margin, speed, acceleration, jerk, thrust, tilt, body_rate] = room(12);
    return {
      ...{ status: STATUSES[status], message, legs, pieces: per_leg, duration, cost, certified: kept === 1, margin, milliseconds },
      ...{ speed, acceleration, jerk, thrust, tilt, body_rate },
    };
  }

  /** The time that every flight of the last question takes at least, whatever its curve [s]; 0 where none is known. */
  const least = () => core.play_least();

  /** The last plan: durations [s], and control points, pieces × 8 × 3 one after the other [m]. */
  function curve() {
    const count = core.play_curve();
    const all = room(25 * count).slice();
    return { durations: all.slice(0, count), points: all.slice(count) };
  }

  const COLUMNS = 13;

  /** The last plan at so many instants: rows of t, and x, y, z of position, velocity, acceleration and jerk. */
  function sample(count) {
    if (core.play_sample(count) !== 0) return [];
    const all = room(COLUMNS * count);
    return Array.from({ length: count }, (_, i) => Array.from(all.slice(COLUMNS * i, COLUMNS * (i + 1))));
  }

  /** The same so many times a second, from 0 on. */
  function rows(rate) {
    const all = [];
    for (let count; (count = core.play_rows(rate, all.length)) > 0; ) {
      const part = room(COLUMNS * count);
      for (let i = 0; i < count; ++i) all.push(Array.from(part.slice(COLUMNS * i, COLUMNS * (i + 1))));
    }
    return all;
  }

  return { version: text(core.play_version()), plan, least, curve, sample, rows };
}
