"use strict";
// The controls, the chart that they ask for, and what is known of the chosen setting.

const data = JSON.parse(document.getElementById("data").textContent);
data.rows = data.rows.map(({ row, pictures }) => ({ ...row, ...pictures, settings: leaves(row.settings) }));
const at = (id) => document.getElementById(id);
const mib = (bytes) => bytes / 2 ** 20;

const COSTS = {
  gpu: { label: "GPU time", unit: "GPU ms a frame", of: (m) => m.frame_gpu_ms.median },
  cpu: { label: "processor time", unit: "CPU ms a frame, all threads", of: (m) => m.frame_cpu_ms?.median },
  memory: { label: "memory", unit: "MiB of device memory", of: (m) => mib(m.memory_bytes) },
};
const METRICS = {
  rel: "mean |error| over the reference's mean",
  energy: "distance of mean light from the reference's, as a share: |energy − 1|",
  relmse: "mean squared relative error",
  p95: "relative error that 95 % of the pixels stay below",
  flip: "visible difference, LDR-FLIP, 0 to 1",
};
const CHOICES = {
  truth: { full: "all light", same: "as many bounces" },
  part: { total: "whole image", indirect: "indirect light", diffuse: "of diffuse surfaces" },
  metric: Object.fromEntries(Object.keys(METRICS).map((name) => [name, name])),
};
if (!data.rows.some(({ measured }) => measured?.full.diffuse || measured?.same.diffuse)) delete CHOICES.part.diffuse;
// No error is drawn as smaller than this: a logarithm has no zero.
const LEAST = 1e-6;

const state = { scene: data.scenes[0].name, cost: "gpu", truth: "full", part: "total", metric: "rel", row: undefined };

function element(name, attributes = {}, ...children) {
  const node = Object.assign(document.createElement(name), attributes);
  node.append(...children);
  return node;
}

/** Nested settings as pairs of a dotted name and a value. */
function leaves(table, prefix = "") {
  return Object.entries(table).flatMap(([key, value]) =>
    value.constructor === Object ? leaves(value, `${prefix}${key}.`) : [[prefix + key, String(value)]],
  );
}

function errorOf(row, { truth, part, metric } = state) {
  const errors = row.measured?.[truth];
  if (metric === "flip") return part === "total" ? errors?.flip : undefined;
  const value = errors?.[part]?.[metric];
  if (value === undefined || value === null) return undefined;
  return metric === "energy" ? Math.abs(value - 1) : value;
}

const methodOf = (row) => row.settings.find(([key]) => key === "method")[1];
/** How the points of a row's method look. */
const markOf = (row) => data.marks.find(({ method }) => method === methodOf(row));

function buildControls() {
  const form = at("controls");
  form.scene.append(...data.scenes.map((scene) => new Option(scene.name, scene.name)));
  const known = Object.entries(COSTS).filter(([, cost]) => data.rows.some((row) => row.measured && cost.of(row.measured)));
  form.cost.append(...known.map(([key, cost]) => new Option(cost.label, key)));
  for (const [name, choices] of Object.entries(CHOICES)) {
    const segments = form.querySelector(`[data-name=${name}]`);
    for (const [value, label] of Object.entries(choices)) {
      const input = element("input", { type: "radio", name, value, checked: state[name] === value });
      segments.append(element("label", {}, input, label));
    }
  }
  form.addEventListener("change", (event) => {
    state[event.target.name] = event.target.value;
    // FLIP is of whole images.
    if (state.part !== "total" && state.metric === "flip") {
      state.metric = "rel";
      form.querySelector("[name=metric][value=rel]").checked = true;
    }
    draw();
  });
  form.addEventListener("submit", (event) => event.preventDefault());
  at("legend").append(
    ...data.marks.map((mark) => {
      const svg = shape("svg", { viewBox: "-7 -7 14 14", width: 14, height: 14, "aria-hidden": true }, dot(mark, 5));
      return element("li", {}, svg, mark.method);
    }),
  );
}

function draw() {
  const rows = data.rows.filter((row) => row.scene === state.scene);
  // The same setting stays chosen when the scene changes.
  state.row = rows.find((row) => row.name === state.row?.name) ?? state.row;
  const cost = COSTS[state.cost];
  const points = rows
    .map((row) => ({ row, x: row.measured && cost.of(row.measured), y: errorOf(row), name: row.name, preset: row.swept.length === 0, mark: markOf(row) }))
    .filter((p) => p.x && p.y !== undefined)
    .map((p) => ({ ...p, y: Math.max(p.y, LEAST) }));
  at("controls").querySelector("[name=metric][value=flip]").disabled = state.part !== "total";
  at("meaning").textContent = `${state.metric}: ${METRICS[state.metric]}. Lower and further left is better; the line joins what no other setting beats.`;
  const yTitle = `${state.metric === "energy" ? "|energy − 1|" : state.metric}, ${CHOICES.part[state.part]}`;
  at("detail").hidden = points.length === 0;
  drawPlot(at("chart"), points, { xTitle: cost.unit, yTitle, selected: state.row, onSelect: showDetail });
  const left = rows.filter((row) => row.measured).length - points.length;
  const scene = data.scenes.find((s) => s.name === state.scene);
  const missing = left > 0 ? ` ${left} settings have no such number.` : "";
  at("hint").textContent = `${scene.about}. Choose a point by mouse, touch, or Tab and the arrow keys.${missing}`;
  const failed = rows.filter((row) => row.failure);
  at("failures").hidden = failed.length === 0;
  at("failures").querySelector("ul").replaceChildren(...failed.map((row) => element("li", {}, element("b", {}, row.name), `: ${row.failure}`)));
}

function showDetail(row) {
  state.row = row;
  const measured = row.measured;
  const scene = data.scenes.find((s) => s.name === row.scene);
  const truth = scene.truths.find((t) => t.bounces === measured[state.truth].bounces);
  at("name").textContent = `${row.name} · ${methodOf(row)} · ${row.scene}`;
  const cpu = measured.frame_cpu_ms ? `, ${digits(measured.frame_cpu_ms.median)} ms of processor time` : "";
  const frames = measured.frames === 1 ? "one frame" : `the median of ${measured.frames} frames`;
  const spread = `${digits(measured.frame_gpu_ms.min)} to ${digits(measured.frame_gpu_ms.max)}`;
  at("numbers").textContent =
    `${digits(measured.frame_gpu_ms.median)} GPU ms (${frames}, ${spread})${cpu}, ${digits(mib(measured.memory_bytes))} MiB` +
    (measured.nonfinite > 0 ? `, ${measured.nonfinite} values are not finite` : "");
  showPictures(row, scene, truth);
  const changes = row.changes.length > 0 ? row.changes : [`nothing: ${row.preset} itself`];
  at("changes").replaceChildren(...changes.map((change) => element("li", {}, change)));
  showPasses(measured.passes);
  showErrors(measured);
  const changed = new Set(row.changes.map((change) => change.split("=")[0]));
  at("settings").replaceChildren(
    ...row.settings.flatMap(([key, value]) => [
      element("dt", {}, key),
      element("dd", { className: changed.has(key) ? "changed" : "" }, value),
    ]),
  );
}

function showPictures(row, scene, truth) {
  const [width, height] = scene.size;
  at("compare").style.aspectRatio = `${width} / ${height}`;
  const light = truth.bounces === null ? "all light" : `light of ${truth.bounces} indirect bounces`;
  const show = (id, source, words) => {
    Object.assign(at(id), { src: source, alt: words, className: width < 160 ? "pixels" : "" });
  };
  show("image", row.image, `${row.scene} rendered with ${row.name}`);
  show("reference", truth.picture, `${row.scene} path-traced, ${light}`);
  show("difference", row[state.truth], `Signed difference of ${row.name} from the path-traced ${light}`);
}

function showPasses(passes) {
  const sum = passes.reduce((total, pass) => total + pass.gpu_ms, 0);
  const parts = passes.map((pass, i) => {
    const share = sum > 0 ? pass.gpu_ms / sum : 0;
    return { ...pass, share, color: data.colors[i % data.colors.length] };
  });
  at("bar").setAttribute("aria-label", parts.map((p) => `${p.name} ${Math.round(100 * p.share)} %`).join(", "));
  at("bar").replaceChildren(
    ...parts.map((p) => {
      const part = element("span", { title: `${p.name}: ${digits(p.gpu_ms)} ms` });
      part.style.cssText = `flex: ${p.share} 0 0; background: ${p.color}`;
      return part;
    }),
  );
  at("passes").replaceChildren(
    ...parts.map((p) => {
      const swatch = element("span", { className: "swatch" });
      swatch.style.background = p.color;
      const cells = [`${digits(p.gpu_ms)} ms`, `${(100 * p.share).toFixed(1)} %`];
      return element("tr", {}, element("td", {}, swatch, p.name), ...cells.map((text) => element("td", {}, text)));
    }),
  );
}

function showErrors(measured) {
  const names = Object.keys(METRICS);
  const head = element("tr", {}, element("th"), ...names.map((name) => element("th", { scope: "col" }, name)));
  const lines = [];
  for (const [truth, truthName] of Object.entries(CHOICES.truth)) {
    for (const [part, partName] of Object.entries(CHOICES.part)) {
      const { [part]: metrics, flip } = measured[truth];
      const value = (name) => (name === "flip" ? (part === "total" ? flip : undefined) : metrics?.[name]);
      const cells = names.map((name) => element("td", {}, value(name) === undefined ? "–" : digits(value(name))));
      lines.push(element("tr", {}, element("th", { scope: "row" }, `${partName}, ${truthName}`), ...cells));
    }
  }
  at("errors").replaceChildren(element("thead", {}, head), element("tbody", {}, ...lines));
}

buildControls();
at("slider").addEventListener("input", (event) => {
  at("compare").style.setProperty("--cut", `${event.target.value}%`);
});
draw();
let drawnWidth = at("chart").clientWidth;
new ResizeObserver(([entry]) => {
  const width = Math.round(entry.contentRect.width);
  if (width !== drawnWidth) {
    drawnWidth = width;
    draw();
  }
}).observe(at("chart"));
