// Plots beside the scene: they follow its time, and a click on one sends the scene there.
const { plots, events } = JSON.parse(document.getElementById("data").textContent);
const frame = document.getElementById("scene");
let time = 0;

function seek(seconds) {
  const input = frame.contentDocument.querySelector("input");
  const set = Object.getOwnPropertyDescriptor(frame.contentWindow.HTMLInputElement.prototype, "value").set;
  set.call(input, seconds.toFixed(3)); // the player hears of it as of a typed number
  input.dispatchEvent(new frame.contentWindow.Event("input", { bubbles: true }));
}

function lines(u) {
  const { ctx, bbox } = u;
  const line = (t, colour, dash) => {
    const x = Math.round(u.valToPos(t, "x", true));
    if (x < bbox.left || x > bbox.left + bbox.width) return;
    ctx.save();
    ctx.strokeStyle = colour;
    ctx.setLineDash(dash);
    ctx.beginPath();
    ctx.moveTo(x, bbox.top);
    ctx.lineTo(x, bbox.top + bbox.height);
    ctx.stroke();
    ctx.restore();
  };
  for (const event of events) line(event.t, "#D55E00", [4, 4]);
  line(time, "#111", []);
}

const sync = uPlot.sync("flight");
const drawn = plots.map((plot) => {
  const heading = document.createElement("h2");
  heading.textContent = plot.unit ? `${plot.title} (${plot.unit})` : plot.title;
  const place = document.getElementById("plots");
  place.append(heading);
  const u = new uPlot(
    {
      width: 430, height: 165, scales: { x: { time: false } },
      cursor: { sync: { key: sync.key } },
      axes: [{ size: 26 }, { size: 62, values: (_, v) => v.map((x) => x.toPrecision(2)) }],
      series: [{ label: "s" }, ...plot.series.map((s) => ({
        label: s.label, stroke: s.colour, width: 1, dash: s.dash,
        value: (_, v) => (v == null ? "" : v.toPrecision(3)),
      }))],
      hooks: { draw: [lines] },
    },
    [plot.time, ...plot.series.map((s) => s.values)],
    place,
  );
  u.over.addEventListener("click", () => seek(u.posToVal(u.cursor.left, "x")));
  return u;
});

document.getElementById("events").replaceChildren(
  ...events.map((event) => {
    const link = document.createElement("a");
    link.href = "#";
    link.textContent = `${event.t.toFixed(2)} s ${event.text}  `;
    link.onclick = () => (seek(event.t), false);
    return link;
  }),
);

// The scene's slider tells its time to screen readers, and so to us.
function follow() {
  const slider = frame.contentDocument?.querySelector("[role=slider]");
  if (!slider) return setTimeout(follow, 100);
  const moved = () => {
    time = Number(slider.getAttribute("aria-valuenow"));
    drawn.forEach((u) => u.redraw(false));
  };
  new MutationObserver(moved).observe(slider, { attributes: true, attributeFilter: ["aria-valuenow"] });
  moved();
}
follow();
window.spaceRobot = { seek, time: () => time };
