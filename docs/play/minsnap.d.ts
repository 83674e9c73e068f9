/** The planner of minsnap in the browser or in node. SI units, z up. */

export type Status =
  | "DONE"
  | "BAD_SIZE"
  | "BAD_NUMBER"
  | "NO_MEMORY"
  | "UNSUPPORTED"
  | "SINGULAR"
  | "NOT_PROVED"
  | "INFEASIBLE"
  | "NO_PROGRESS"
  | "SPENT";

export const STATUSES: readonly Status[];

export interface Limits {
  /** [m/s] */
  speed?: number;
  /** [m/s²] */
  acceleration?: number;
  /** [m/s³] */
  jerk?: number;
  /** Thrust over weight. */
  max_thrust?: number;
  /** [rad] */
  tilt?: number;
  /** Roll and pitch rate [rad/s]. */
  body_rate?: number;
}

export interface Question {
  /** Of x, y, z, at most 200 [m]. */
  waypoints: [number, number, number][];
  /** The quickest curve within these, or, without them, that of least cost in `total_time`. */
  limits?: Limits;
  /** [s] */
  total_time?: number;
  /** Half-width of the tube around each leg; 0 for none [m]. */
  corridor?: number;
  /** Polynomials of each leg; 0 to have them chosen. */
  pieces?: number;
}

/** Where `legs` is 0 there is no plan, and `message` says why. */
export type Answer =
  | { status: Status; message: string; legs: 0; milliseconds?: number }
  | {
      status: "DONE" | "SPENT";
      message: string;
      legs: number;
      pieces: number;
      /** [s] */
      duration: number;
      /** Integral of the squared snap [m²/s⁷]. */
      cost: number;
      /** Whether it is proved that the curve keeps everything at every instant. */
      certified: boolean;
      /** Least distance to a wall [m]. */
      margin: number;
      /** Greatest values. */
      speed: number;
      acceleration: number;
      jerk: number;
      thrust: number;
      tilt: number;
      body_rate: number;
      milliseconds: number;
    };

/** t, then x, y, z of position, velocity, acceleration and jerk. */
export type Row = number[];

export interface Planner {
  version: string;
  plan(question: Question): Answer;
  /** The time that every flight of the last question takes at least [s]; 0 where none is known. */
  least(): number;
  /** The last plan: durations [s], and control points, polynomials × 8 × 3 one after the other [m]. */
  curve(): { durations: Float64Array; points: Float64Array };
  /** The last plan at so many instants, its ends included. */
  sample(count: number): Row[];
  /** The last plan so many times a second, from 0 on. */
  rows(rate: number): Row[];
}

/** Compile the core: these bytes of minsnap.wasm, or the file beside the module. */
export function load(bytes?: BufferSource): Promise<Planner>;
