// The page: one question, planned at every change, drawn, and copied as text.
import { load } from "./minsnap.js";

const question = {
  waypoints: [[0, 0, 1], [8, 0, 1], [8, 4, 1], [0, 4, 1], [0, 0, 1]],
  limits: { speed: 3, acceleration: 5, jerk: 30, max_thrust: 0, tilt: 0, body_rate: 0 },
  corridor: 0.3,
  total_time: 0,
  pieces: 0,
};

const NUMBERS = [
  ["corridor", "half-width of the tube [m], 0 for none"],
  ["speed", "speed [m/s]"],
  ["acceleration", "acceleration [m/s²]"],
  ["jerk", "jerk [m/s³]"],
  ["max_thrust", "thrust over weight, 0 for no limit"],
  ["tilt", "tilt [rad], 0 for no limit"],
  ["body_rate", "roll and pitch rate [rad/s], 0 for no limit"],
  ["total_time", "total time [s], 0 for the shortest within limits"],
];

const INSTANTS = 600;
const MARGIN = 1.5;
const at = (id) => document.getElementById(id);
const made = (name, attributes, parent) => {
  const element = document.createElementNS("http://www.w3.org/2000/svg", name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  parent?.append(element);
  return element;
};
const norm = (row, order) => Math.hypot(row[1 + 3 * order], row[2 + 3 * order], row[3 + 3 * order]);
const holder = (name) => (name in question.limits ? question.limits : question);

let core, plan, samples = [], frame = { x: 0, y: 0, size: 1 };

function planned() {
  plan = core.plan({ ...question, limits: question.total_time ? {} : question.limits });
  samples = plan.legs ? core.sample(INSTANTS) : [];
  const good = plan.legs && plan.certified;
  at("answer").className = good ? "" : "wrong";
  const ended = plan.status === "SPENT" ? `; ${plan.message}` : "";
  at("answer").textContent = good ? `${plan.duration.toFixed(4)} s, certified at every instant${ended}` : plan.message || plan.status;
  const least = good ? core.least() : 0;
  const figures = good
    ? [
        ["nearest to a wall", Number.isFinite(plan.margin) ? `${plan.margin.toExponential(2)} m inside` : "no walls"],
        ["at most", `${plan.speed.toFixed(3)} m/s, ${plan.acceleration.toFixed(3)} m/s², ${plan.jerk.toFixed(2)} m/s³`],
        ["thrust", `${plan.thrust.toFixed(3)} of the weight, tilted by ${((plan.tilt * 180) / Math.PI).toFixed(1)}°`],
        ["no flight is quicker than", least > 0 ? `${least.toFixed(4)} s: this one is at most ${(100 * (plan.duration / least - 1)).toFixed(2)} % longer` : "not known"],
        ["polynomials", `${plan.legs * plan.pieces}, ${plan.pieces} a leg`],
        ["planned in", `${plan.milliseconds.toFixed(1)} ms`],
      ]
    : [];
  at("figures").replaceChildren(...figures.flatMap(([name, value]) => [Object.assign(document.createElement("dt"), { textContent: name }), Object.assign(document.createElement("dd"), { textContent: value })]));
  draw();
}

function draw() {
  drawMap();
  drawProfiles();
}

function fit() {
  const xs = question.waypoints.map((p) => p[0]), ys = question.waypoints.map((p) => p[1]);
  const width = Math.max(...xs) - Math.min(...xs) + 2 * MARGIN, height = Math.max(...ys) - Math.min(...ys) + 2 * MARGIN;
  const size = Math.max(width / 4, height / 3, 1);
  frame = { x: (Math.max(...xs) + Math.min(...xs)) / 2 - 2 * size, y: (Math.max(...ys) + Math.min(...ys)) / 2 - 1.5 * size, size };
}

// y points up in the world, and down in a picture
function drawMap() {
  const map = at("map"), { x, y, size } = frame;
  map.setAttribute("viewBox", `${x} ${-y - 3 * size} ${4 * size} ${3 * size}`);
  map.replaceChildren();
  const unit = size / 200;
  for (let k = Math.ceil(x); k <= x + 4 * size; ++k) made("line", { class: "grid", x1: k, x2: k, y1: -y, y2: -y - 3 * size, "stroke-width": unit }, map);
  for (let k = Math.ceil(y); k <= y + 3 * size; ++k) made("line", { class: "grid", x1: x, x2: x + 4 * size, y1: -k, y2: -k, "stroke-width": unit }, map);
  const { waypoints, corridor } = question;
  for (let i = 0; corridor > 0 && i + 1 < waypoints.length; ++i) {
    const [a, b] = [waypoints[i], waypoints[i + 1]];
    made("line", { class: "tube", x1: a[0], y1: -a[1], x2: b[0], y2: -b[1], "stroke-width": 2 * corridor }, map);
  }
  made("polyline", { class: "path", points: samples.map((row) => `${row[1]},${-row[2]}`).join(" "), "stroke-width": 4 * unit }, map);
  waypoints.forEach((point, i) => {
    const knot = made("circle", { class: "knot", cx: point[0], cy: -point[1], r: 12 * unit, "data-waypoint": i }, map);
    knot.append(Object.assign(document.createElementNS("http://www.w3.org/2000/svg", "title"), { textContent: `waypoint ${i}` }));
  });
}

function drawProfiles() {
  const picture = at("profiles"), width = 800, height = 440, each = height / 3;
  picture.setAttribute("viewBox", `0 0 ${width} ${height}`);
  picture.replaceChildren();
  if (!samples.length) return;
  const kinds = [["speed", "m/s"], ["acceleration", "m/s²"], ["jerk", "m/s³"]];
  kinds.forEach(([name, unit], k) => {
    const values = samples.map((row) => norm(row, k + 1)), limit = question.total_time ? 0 : question.limits[name];
    const most = 1.3 * Math.max(limit, ...values) || 1, foot = each * (k + 1) - 18;
    const up = (value) => foot - ((each - 30) * value) / most;
    made("line", { class: "grid", x1: 0, x2: width, y1: foot, y2: foot }, picture);
    if (limit > 0) made("line", { class: "limit", x1: 0, x2: width, y1: up(limit), y2: up(limit) }, picture);
    const line = values.map((value, i) => `${(width * samples[i][0]) / plan.duration},${up(value)}`).join(" ");
    made("polyline", { class: "path", points: line, "stroke-width": 1.5 }, picture);
    made("text", { x: 4, y: foot - each + 38 }, picture).textContent = `${name}, at most ${Math.max(...values).toPrecision(4)} ${unit}`;
  });
  made("text", { x: width - 4, y: height - 4, "text-anchor": "end" }, picture).textContent = `${plan.duration.toFixed(2)} s`;
}

function fields() {
  at("numbers").replaceChildren(
    ...NUMBERS.map(([name, text]) => {
      const label = Object.assign(document.createElement("label"), { textContent: text });
      const input = Object.assign(document.createElement("input"), { type: "number", min: 0, step: "any", id: name, value: holder(name)[name] });
      input.addEventListener("input", () => {
        if (input.value === "") return;
        holder(name)[name] = Number(input.value);
        planned();
      });
      label.append(input);
      return label;
    }),
  );
  table();
}

function table() {
  at("waypoints").replaceChildren(
    ...question.waypoints.map((point, i) => {
      const row = document.createElement("tr");
      row.append(Object.assign(document.createElement("th"), { textContent: i }));
      point.forEach((value, axis) => {
        const cell = document.createElement("td");
        const input = Object.assign(document.createElement("input"), { type: "number", step: "any", value, ariaLabel: `${"xyz"[axis]} of waypoint ${i}` });
        input.addEventListener("input", () => {
          if (input.value === "") return;
          point[axis] = Number(input.value);
          if (!inView(point)) fit();
          planned();
        });
        cell.append(input);
        row.append(cell);
      });
      return row;
    }),
  );
}

function place(event) {
  const to = new DOMPoint(event.clientX, event.clientY).matrixTransform(at("map").getScreenCTM().inverse());
  return [Math.round(100 * to.x) / 100, Math.round(-100 * to.y) / 100];
}

const DOUBLE = 400; // between the presses of a double click [ms]

function inView([x, y]) {
  return x >= frame.x && x <= frame.x + 4 * frame.size && y >= frame.y && y <= frame.y + 3 * frame.size;
}

// A press draws anew, so that clicks have other elements than presses: two presses of one waypoint are told apart by their time.
function pointer() {
  const map = at("map");
  let held = -1, waiting = false, before = { knot: undefined, time: -Infinity };
  map.addEventListener("pointerdown", (event) => {
    const knot = event.target.dataset.waypoint;
    const twice = knot !== undefined && knot === before.knot && event.timeStamp - before.time < DOUBLE;
    before = { knot, time: event.timeStamp, x: event.clientX, y: event.clientY };
    if (twice && question.waypoints.length > 2) {
      question.waypoints.splice(Number(knot), 1);
      held = -1;
    } else if (knot === undefined) {
      held = question.waypoints.push([...place(event), question.waypoints.at(-1)[2]]) - 1;
    } else held = Number(knot);
    map.setPointerCapture(event.pointerId);
    table();
    planned();
  });
  map.addEventListener("pointermove", (event) => {
    if (held < 0) return;
    [question.waypoints[held][0], question.waypoints[held][1]] = place(event);
    if (Math.hypot(event.clientX - before.x, event.clientY - before.y) > 4) before.time = -Infinity;
    if (waiting) return;
    waiting = true;
    requestAnimationFrame(() => {
      waiting = false;
      planned();
    });
  });
  map.addEventListener("pointerup", () => {
    held = -1;
    table();
    if (!question.waypoints.every(inView)) fit();
    planned();
  });
}

// The same plan by Python: to the bit.
function python() {
  const { waypoints, limits, corridor, total_time, pieces } = question;
  const given = Object.entries(limits).filter(([, value]) => value > 0).map(([name, value]) => `${name}=${value}`);
  const lines = [`waypoints = [${waypoints.map((p) => `(${p.join(", ")})`).join(", ")}]`];
  const asked = [total_time ? `total_time=${total_time}` : `limits=minsnap.Limits(${given.join(", ")})`];
  if (corridor > 0) asked.push(`corridor=${corridor}`);
  if (pieces > 0) asked.push(`pieces=${pieces}`);
  return ["import minsnap", "", ...lines, `trajectory = minsnap.plan(waypoints, ${asked.join(", ")})`, ""].join("\n");
}

const HEADER = "t,x,y,z,vx,vy,vz,ax,ay,az,yaw,yaw_rate";

function csv() {
  const rows = core.rows(20);
  const last = samples.at(-1);
  if (rows.length && rows.at(-1)[0] < plan.duration) rows.push([rows.length / 20, ...last.slice(1)]);
  return [HEADER, ...rows.map((row) => [...row.slice(0, 10), 0, 0].join(",")), ""].join("\n");
}

async function copy(text) {
  at("copy").value = text;
  at("copied").textContent = "below";
  try {
    await navigator.clipboard.writeText(text);
    at("copied").textContent = "copied";
  } catch {
    at("copy").select();
  }
}

async function main() {
  fields();
  fit();
  pointer();
  at("pieces").addEventListener("change", (event) => {
    question.pieces = Number(event.target.value);
    planned();
  });
  at("python").addEventListener("click", () => copy(python()));
  at("csv").addEventListener("click", () => copy(csv()));
  try {
    core = await load();
  } catch (error) {
    at("answer").className = "wrong";
    at("answer").textContent = `the core does not load: ${error.message}`;
    return;
  }
  planned();
  window.minsnap = { core, question, planned, answer: () => plan, python, csv };
}

main();
