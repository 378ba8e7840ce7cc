// Telemetry of a space robot in Open MCT: tree of signals, curves live and of the past, limits,
// events, and a display of the whole flight.

const NAMESPACE = "space_robot";
const PARAMETER = "space_robot.parameter";
const EVENTS = "space_robot.events";
const EPOCH_MS = Date.UTC(2000, 0, 1); // simulated time 0
const CLOCK = "space_robot.clock";
const SHOWN_MS = 20_000; // of live curves
const MARGIN_MS = 1_000;
const CURVES = {
  "Rates of the base": "omega_base",
  "Positions of the joints": "joint_positions",
  "Torques": "applied_torque",
  "Wheels": "wheel_velocities",
};
const CSS = { amber: "is-limit--yellow", red: "is-limit--red" };
const SEVERITIES = { information: 0, warning: 1, critical: 2 };

const catalogue = await (await fetch("/catalogue")).json();
const parameters = new Map(
  catalogue.structures.flatMap((each) => each.parameters.map((p) => [p.name, p]))
);
const toMs = (seconds) => EPOCH_MS + 1e3 * seconds;
const toSeconds = (ms) => (ms - EPOCH_MS) / 1e3;
const identifier = (key) => ({ namespace: NAMESPACE, key });

// What is live

const listeners = new Map(); // key to callbacks
const clock = {
  key: CLOCK,
  name: "Simulated time",
  cssClass: "icon-clock",
  description: "Time of the newest packet",
  now: toMs(catalogue.newest ?? 0),
  callbacks: new Set(),
  currentValue() { return this.now; },
  on(event, callback, context) { this.callbacks.add(context ? callback.bind(context) : callback); },
  off() { this.callbacks.clear(); },
};

function connect() {
  const socket = new WebSocket(`ws://${location.host}/live`);
  socket.onmessage = ({ data }) => {
    const packet = JSON.parse(data);
    if (packet.reload) {
      shown.length ? location.reload() : location.replace("/");
      return;
    }
    const utc = toMs(packet.time);
    if (utc > clock.now) {
      clock.now = utc;
      clock.callbacks.forEach((callback) => callback(utc));
    }
    for (const [name, value] of Object.entries(packet.values)) {
      listeners.get(name)?.forEach((callback) => callback({ utc, value }));
    }
    for (const event of packet.events) {
      listeners.get(EVENTS)?.forEach((callback) => callback(row(event)));
    }
  };
  socket.onclose = () => setTimeout(connect, 1000);
}

const row = (event) => ({ utc: toMs(event.time), ...event });

// Objects

const objects = new Map();

function add(key, type, name, content = {}, parent = "root") {
  objects.set(key, {
    identifier: identifier(key),
    location: parent === "" ? "ROOT" : `${NAMESPACE}:${parent}`,
    type,
    name,
    ...content,
  });
  if (parent !== "") {
    objects.get(parent).composition.push(identifier(key));
  }
}

function plot(key, name, names, parent) {
  const composition = names.map(identifier);
  const series = composition.map((each) => ({ identifier: each }));
  const label = parameters.get(names[0]).unit;
  const configuration = { series, yAxis: { label }, objectStyles: {} };
  add(key, "telemetry.plot.overlay", name, { composition, configuration }, parent);
}

const time = { key: "utc", source: "utc", name: "Time", format: "utc", hints: { domain: 1 } };

add("root", "folder", catalogue.robot || "No flight yet", { composition: [] }, "");
const shown = Object.entries(CURVES)
  .map(([name, signal]) => [name, [...parameters.keys()].filter((key) => key.startsWith(signal))])
  .filter(([, names]) => names.length);
if (shown.length) {
  add("plots", "telemetry.plot.stacked", "Curves of the flight", {
    composition: [],
    configuration: { series: [], yAxis: {}, xAxis: {} },
  });
  shown.forEach(([name, names]) => plot(`plot ${name}`, name, names, "plots"));
  const frames = [["plots", 75], [EVENTS, 25]];
  add("flight", "flexible-layout", "Flight", {
    composition: frames.map(([key]) => identifier(key)),
    configuration: {
      rowsLayout: true,
      containers: frames.map(([key, size]) => ({
        id: `container ${key}`,
        size,
        frames: [{
          id: `frame ${key}`, domainObjectIdentifier: identifier(key), size: 100, noFrame: false,
        }],
      })),
    },
  });
}
add(EVENTS, EVENTS, "Events", {
  telemetry: {
    values: [
      time,
      { key: "text", name: "Event", format: "string", hints: { range: 1 } },
      { key: "level", name: "Severity", format: "string", hints: { range: 2 } },
    ],
  },
});
for (const structure of catalogue.structures) {
  add(`structure ${structure.name}`, "folder", structure.name, { composition: [] });
  for (const { name, text, unit, limits } of structure.parameters) {
    add(name, PARAMETER, name, {
      notes: text,
      limits,
      telemetry: {
        values: [time, { key: "value", name, unit, format: "float", hints: { range: 1 } }],
      },
    }, `structure ${structure.name}`);
  }
}

// The plugin

const isOurs = (object) => object.type === PARAMETER || object.type === EVENTS;

const telemetry = {
  supportsRequest: isOurs,
  supportsSubscribe: isOurs,
  supportsLimits: (object) => isOurs(object),
  async request(object, { start, end, size, strategy }) {
    if (object.type === EVENTS) {
      const events = (await (await fetch("/events")).json()).map(row);
      return events.filter(({ utc }) => utc >= start && utc <= end);
    }
    const [from, to] = [toSeconds(start), toSeconds(end)];
    const answer = await fetch(`/history/${object.identifier.key}?start=${from}&end=${to}`);
    const values = (await answer.json()).map(([s, value]) => ({ utc: toMs(s), value }));
    return strategy === "latest" ? values.slice(-(size ?? 1)) : values;
  },
  subscribe(object, callback) {
    const key = object.identifier.key;
    if (!listeners.has(key)) {
      listeners.set(key, new Set());
    }
    listeners.get(key).add(callback);
    return () => listeners.get(key).delete(callback);
  },
  getLimitEvaluator(object) {
    return { evaluate: (datum) => (object.type === EVENTS ? severity(datum) : limit(object, datum)) };
  },
  getLimits(object) {
    const end = (level, side, color) => {
      const value = object.limits?.[level]?.[side];
      return value === undefined ? undefined : { color, value };
    };
    const ends = (level, color) => ({
      low: end(level, "low", color), high: end(level, "high", color),
    });
    return {
      limits: async () => ({ WARNING: ends("amber", "yellow"), CRITICAL: ends("red", "red") }),
    };
  },
};

function severity({ level }) {
  const number = SEVERITIES[level] ?? 0;
  return number ? { cssClass: CSS[number === 2 ? "red" : "amber"], name: level } : undefined;
}

function limit({ limits }, { value }) {
  for (const level of ["red", "amber"]) {
    const { low = -Infinity, high = Infinity } = limits?.[level] ?? {};
    if (value > high || value < low) {
      const side = value > high ? "upr" : "lwr";
      return { cssClass: `${CSS[level]} is-limit--${side}`, name: level, low, high };
    }
  }
  return undefined;
}

function plugin(openmct) {
  openmct.types.addType(PARAMETER, { name: "Parameter", cssClass: "icon-telemetry" });
  openmct.types.addType(EVENTS, { name: "Events", cssClass: "icon-tabular-scrolling" });
  openmct.objects.addRoot(identifier("root"));
  openmct.objects.addProvider(NAMESPACE, { get: async ({ key }) => objects.get(key) });
  openmct.telemetry.addProvider(telemetry);
  openmct.time.addClock(clock);
}

// The page

const end = catalogue.live ? Math.max(clock.now, EPOCH_MS + SHOWN_MS) : clock.now + MARGIN_MS;
const bounds = { start: EPOCH_MS, end };
const clockOffsets = { start: -SHOWN_MS, end: MARGIN_MS };
const menuOptions = [{ name: "Fixed", timeSystem: "utc", bounds }];
if (catalogue.live) {
  menuOptions.push({ name: "Live", timeSystem: "utc", clock: CLOCK, clockOffsets });
}
openmct.setAssetPath("/openmct");
openmct.install(openmct.plugins.LocalStorage());
openmct.install(openmct.plugins.UTCTimeSystem());
openmct.install(plugin);
openmct.install(openmct.plugins.Conductor({ menuOptions }));
openmct.install(openmct.plugins.Espresso());
openmct.time.setTimeSystem("utc", bounds);
if (catalogue.live) {
  openmct.time.setClock(CLOCK);
  openmct.time.setMode("realtime", clockOffsets);
} else {
  openmct.time.setMode("fixed", bounds);
}
if (!location.hash) {
  location.hash = `#/browse/${NAMESPACE}:root/${NAMESPACE}:${shown.length ? "flight" : EVENTS}`;
}
openmct.start(document.getElementById("display"));
connect();
window.openmct = openmct;
