// Plots beside the scene: they follow its time, and a click on one sends the scene there.
const { plots, marks, time: times, start, dark } = JSON.parse(document.getElementById("data").textContent);
const frame = document.getElementById("scene");
const ink = getComputedStyle(document.documentElement);
const colourOf = (name) => ink.getPropertyValue(`--${name}`);
let time = start;

const slider = () => frame.contentDocument?.querySelector("[role=slider]");
const stopOf = (mark) => mark.stop ?? Infinity;

function seek(seconds) {
  const input = frame.contentDocument.querySelector("input");
  const set = Object.getOwnPropertyDescriptor(frame.contentWindow.HTMLInputElement.prototype, "value").set;
  const end = Number(slider().getAttribute("aria-valuemax"));
  set.call(input, Math.min(Math.max(seconds - start, 0), end).toFixed(4)); // the player hears of it as of a typed number
  input.dispatchEvent(new frame.contentWindow.Event("input", { bubbles: true }));
}

function number(value) {
  if (value == null || value === 0) return value === 0 ? "0" : "";
  const size = Math.abs(value);
  return size >= 1e-3 && size < 1e5 ? String(Number(value.toPrecision(3))) : value.toExponential(1).replace(".0e", "e");
}

// Powers of ten, four lines at most.
function decades(u, _, low, high) {
  const [from, to] = [Math.ceil(Math.log10(low) - 1e-9), Math.floor(Math.log10(high) + 1e-9)];
  const every = Math.max(1, Math.ceil((to - from) / 3));
  return Array.from({ length: Math.max(0, Math.floor((to - from) / every) + 1) }, (_, k) => 10 ** (from + k * every));
}

// Marks behind the curves, the scene's time in front of them.
function stretch(u, from, to) {
  const { left, width } = u.bbox;
  const at = (t) => Math.min(Math.max(Math.round(u.valToPos(t, "x", true)), left), left + width);
  const seen = to >= u.scales.x.min && from <= u.scales.x.max;
  return seen ? [at(from), at(Math.min(to, u.scales.x.max))] : null;
}

function drawMarks(u) {
  const { ctx, bbox } = u;
  ctx.save();
  for (const mark of marks) {
    const place = stretch(u, mark.start, stopOf(mark));
    if (!place) continue;
    ctx.fillStyle = colourOf(mark.kind);
    ctx.globalAlpha = 0.13;
    ctx.fillRect(place[0], bbox.top, place[1] - place[0], bbox.height);
    ctx.globalAlpha = 0.9;
    for (let y = 0; y < bbox.height; y += 8) ctx.fillRect(place[0], bbox.top + y, 1, 4);
  }
  ctx.restore();
}

function drawLimits(u, limits) {
  const { ctx, bbox, scales } = u;
  ctx.fillStyle = colourOf("faint");
  for (const limit of limits.filter((value) => value >= scales.y.min && value <= scales.y.max)) {
    const y = Math.round(u.valToPos(limit, "y", true));
    for (let x = 0; x < bbox.width; x += 6) ctx.fillRect(bbox.left + x, y, 3, 1);
  }
}

function drawTime(u) {
  const place = stretch(u, time, time);
  if (!place) return;
  u.ctx.fillStyle = colourOf("ink");
  u.ctx.fillRect(place[0], u.bbox.top, devicePixelRatio, u.bbox.height);
}

const sync = uPlot.sync("flight");
const axis = { stroke: colourOf("faint"), grid: { stroke: colourOf("line"), width: 1 }, ticks: { stroke: colourOf("line") } };
const vertical = { ...axis, size: 64, space: 18, values: (_, v) => v.map(number) };

// Of pulses each series has a row, numbered from the top, and fills it while it is open.
const ROW = 0.8;
const share = (plot, k, v) => number(v == null || !plot.pulses ? v : (v + k) / ROW);
const valueOf = (plot, k) => (_, v) => `${share(plot, k, v)} ${v == null ? "" : plot.unit}`.trim();
const curve = (plot, k) => (plot.pulses ? plot.series[k].values.map((v) => (v == null ? v : ROW * v - k)) : plot.series[k].values);
const heightOf = (plot) => (plot.pulses ? Math.max(150, 50 + 12 * plot.series.length) : 150);

function scaleOf(plot) {
  if (plot.logarithmic) return { distr: 3 };
  return plot.pulses ? { range: [1 - plot.series.length - 0.2, 1] } : {};
}

function axisOf(plot) {
  if (plot.logarithmic) return { ...vertical, splits: decades, filter: (_, v) => v };
  if (!plot.pulses) return vertical;
  return { ...vertical, splits: plot.series.map((_, k) => -k).reverse(), filter: (_, v) => v, values: (_, v) => v.map((row) => `${1 - row}`) };
}

// A legend has the values at the pointer, or else at the scene's time.
function tellValues(u) {
  if (u.cursor.left >= 0) return;
  const after = times.findIndex((t) => t > time);
  u.setLegend({ idx: after < 0 ? times.length - 1 : Math.max(after - 1, 0) });
}

// Letters of the longest entry of a legend: its columns are so wide, and nothing moves.
const widthOf = (plot) => Math.max(...plot.series.map((s) => s.label.length)) + plot.unit.length + 8;

let zooming = false;
const drawn = new Map(); // of the plots that are shown, in any order
const place = document.getElementById("plots");
const boxes = plots.map(() => document.createElement("section"));
place.append(...boxes);

function draw(plot, box) {
  const heading = document.createElement("h2");
  heading.textContent = plot.unit ? `${plot.title} (${plot.unit})` : plot.title;
  box.append(heading);
  box.style.setProperty("--letters", widthOf(plot));
  const zoomed = (u, scale) => {
    if (scale !== "x" || zooming) return;
    zooming = true; // all plots show the same stretch
    for (const other of drawn.values()) if (other !== u) other.setScale("x", { min: u.scales.x.min, max: u.scales.x.max });
    zooming = false;
  };
  const [shown] = drawn.values();
  const u = new uPlot(
    {
      width: place.clientWidth, height: heightOf(plot),
      scales: { x: { time: false }, y: scaleOf(plot) },
      cursor: { sync: { key: sync.key } },
      axes: [{ ...axis, size: 24, values: (_, v) => v.map((x) => `${x}`) }, axisOf(plot)],
      series: [
        {},
        ...plot.series.map((s, k) => ({
          label: s.label, stroke: s.colour, width: 1, value: valueOf(plot, k), ...(s.wanted && { class: "wanted", dash: [4, 4] }),
        })),
      ],
      hooks: { drawAxes: [drawMarks], draw: [(u) => drawLimits(u, plot.limits), drawTime], setScale: [zoomed], setCursor: [tellValues] },
    },
    [times, ...plot.series.map((_, k) => curve(plot, k))],
    box,
  );
  tellValues(u);
  if (shown) u.setScale("x", { min: shown.scales.x.min, max: shown.scales.x.max });
  let pressed = 0;
  u.over.addEventListener("mousedown", (event) => (pressed = event.clientX));
  u.over.addEventListener("click", (event) => {
    if (Math.abs(event.clientX - pressed) < 3) seek(u.posToVal(u.cursor.left, "x"));
  });
  return u;
}

function show(plot, isShown) {
  const box = boxes[plots.indexOf(plot)];
  if (isShown === drawn.has(plot)) return;
  if (isShown) return drawn.set(plot, draw(plot, box));
  drawn.get(plot).destroy();
  drawn.delete(plot);
  box.replaceChildren();
}

// The choice is kept in the address, as #plots=base-torque,wheel-speed.
const nameOf = (plot) => plot.title.toLowerCase().replace(/[^a-z0-9]+/g, "-");
const isDocument = location.protocol !== "about:"; // a page within another one has no address

function chosen() {
  const match = isDocument && /^#plots=(.*)$/.exec(location.hash);
  if (!match) return null;
  const names = new Set(match[1].split(","));
  return plots.some((plot) => names.has(nameOf(plot))) || !match[1] ? (plot) => names.has(nameOf(plot)) : null;
}

function remember() {
  const usual = plots.every((plot) => plot.shown === drawn.has(plot));
  const names = plots.filter((plot) => drawn.has(plot)).map(nameOf);
  if (isDocument) history.replaceState(null, "", usual ? location.pathname + location.search : `#plots=${[...new Set(names)].join(",")}`);
}

const inputs = plots.map((plot) => {
  const input = document.createElement("input");
  input.type = "checkbox";
  input.addEventListener("change", () => {
    show(plot, input.checked);
    remember();
  });
  const label = document.createElement("label");
  label.append(input, plot.title);
  document.querySelector("#choice div").append(label);
  return input;
});

function showChosen() {
  const isChosen = chosen() ?? ((plot) => plot.shown);
  plots.forEach((plot, k) => show(plot, (inputs[k].checked = isChosen(plot))));
}
showChosen();
addEventListener("hashchange", showChosen);
new ResizeObserver(() => drawn.forEach((u) => u.setSize({ width: place.clientWidth, height: u.height }))).observe(place);

function buttonOf(mark) {
  const button = document.createElement("button");
  const until = mark.stop === mark.start ? "" : mark.stop === null ? " on" : ` to ${mark.stop}`;
  const dot = document.createElement("span");
  dot.className = mark.kind;
  dot.textContent = "\u25b2 ";
  button.append(dot, `${mark.start}${until} s: ${mark.text}`);
  button.addEventListener("click", () => seek(mark.start));
  return button;
}
document.getElementById("marks").replaceChildren(...marks.map(buttonOf));

// What goes on now, over the scene; what takes no time is told for a second.
function tell() {
  const words = document.createElement("b");
  words.textContent = `${time.toFixed(2)} s`;
  const going = marks.filter((m) => m.start <= time && time < Math.max(stopOf(m), m.start + 1));
  const lines = going.map((mark) => {
    const line = document.createElement("div");
    line.className = mark.kind;
    line.textContent = mark.text;
    return line;
  });
  document.getElementById("now").replaceChildren(words, ...lines);
}

// A tick on the player's own time line for each mark.
function markTimeline(thumb) {
  const end = Number(thumb.getAttribute("aria-valuemax"));
  for (const mark of marks) {
    const tick = frame.contentDocument.createElement("div");
    tick.className = "flight-mark";
    tick.title = mark.text;
    const from = Math.max(mark.start - start, 0) / end;
    const to = Math.min(stopOf(mark) - start, end) / end;
    tick.style.cssText =
      `position:absolute;top:-5px;height:4px;min-width:3px;pointer-events:none;left:${100 * from}%;` +
      `width:${100 * (to - from)}%;background:${colourOf(mark.kind)}`;
    thumb.parentElement.append(tick);
  }
}

// The scene's slider tells its time to screen readers, and so to us.
function follow() {
  const thumb = slider();
  if (!thumb) return setTimeout(follow, 100);
  markTimeline(thumb);
  const moved = () => {
    time = start + Number(thumb.getAttribute("aria-valuenow"));
    tell();
    drawn.forEach((u) => (u.redraw(false), tellValues(u)));
  };
  new MutationObserver(moved).observe(thumb, { attributes: true, attributeFilter: ["aria-valuenow"] });
  moved();
}
follow();
addEventListener("keydown", (event) => {
  if (event.code !== "Space") return;
  event.preventDefault();
  frame.contentWindow.dispatchEvent(new frame.contentWindow.KeyboardEvent("keydown", { code: "Space" }));
});
window.spaceRobot = { seek, time: () => time };
