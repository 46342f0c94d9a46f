"use strict";
// The controls, the chart that they ask for, and what is known of the chosen setting.

for (const row of [...data.rows, ...data.history]) row.settings = leaves(row.settings ?? {});
const mib = (bytes) => (bytes === undefined || bytes === null ? undefined : bytes / 2 ** 20);

// The maker of an image, where that is not the renderer with settings.
const OTHERS = { "path-tracer": "path tracer", import: "other program" };
const isOther = (row) => row.source.kind in OTHERS;
const isGiven = (row) => row.source.kind === "import";
const hasOthers = data.rows.some(isOther);
/** Milliseconds of a frame: of the device, by the wall clock of the path tracer, or as given. */
const msOf = ({ source, measured }) =>
  source.kind === "import" ? source.milliseconds : (measured.frame_gpu_ms ?? measured.frame_wall_ms)?.median;

// Each of a row that is measured.
const COSTS = {
  gpu: { label: hasOthers ? "time" : "GPU time", unit: hasOthers ? "ms a frame" : "GPU ms a frame", of: msOf },
  cpu: { label: "processor time", unit: "CPU ms a frame, all threads", of: ({ measured }) => measured.frame_cpu_ms?.median },
  memory: { label: "memory", unit: "MiB of device memory", of: ({ measured }) => mib(measured.memory_bytes) },
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

const state = {
  scene: data.scenes[0].name, cost: "gpu", truth: "full", part: "total", metric: "rel", place: "", find: "", hidden: [],
  sort: "y", falling: false, name: undefined, kept: undefined,
};
// Points that are drawn now, and the point that is chosen.
let points = [], chosen;

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

const methodOf = (row) => OTHERS[row.source.kind] ?? row.settings.find(([key]) => key === "method")[1];
/** How the points of a row's method look. */
const markOf = (row) => data.marks.find(({ method }) => method === methodOf(row));

const shapeOf = (mark) => shape("svg", { viewBox: "-7 -7 14 14", width: 14, height: 14, "aria-hidden": true }, dot(mark, 5));
/** Where a row was measured, as one text. */
const placeOf = (row) => (row.origin ? JSON.stringify([row.origin.machine, row.origin.device, row.origin.driver]) : "");
const places = data.places.map((place) => JSON.stringify(place));
const machineOf = (row) => row.origin?.machine ?? (isGiven(row) ? row.source.device : undefined) ?? "unknown";
const dateOf = (row) => (row.origin ? new Date(1000 * row.origin.unix_s).toISOString().slice(0, 16).replace("T", " ") : "");
const sameSetting = (a, b) =>
  a.scene === b.scene && a.source.kind === b.source.kind && (isOther(a) ? a.name === b.name : a.settings.join() === b.settings.join());
const quoted = (word) => (/^[\w\-.=/,:+%@]+$/.test(word) ? word : `'${word.replaceAll("'", "'\\''")}'`);

/** The command that renders a row's picture; none of an image of another program and of one path, which `reference` does not write. */
function commandOf(row) {
  const { command } = data.scenes.find((scene) => scene.name === row.scene);
  if (isGiven(row) || row.source.paths === 1) return "";
  if (isOther(row)) {
    const trace = command.replace("twobounce render", "twobounce reference").replace("-o image.png", "-o image.exr");
    return `${trace} --spp ${row.source.paths} --seed ${data.paths_seed} --depth full --aov direct`;
  }
  return [command, "--preset", quoted(row.preset), ...row.changes.map((change) => `--set ${quoted(change)}`), "--noise off"].join(" ");
}

function buildControls() {
  const form = at("controls");
  form.scene.append(...data.scenes.map((scene) => new Option(scene.name, scene.name)));
  const known = Object.entries(COSTS).filter(([, cost]) => data.rows.some((row) => row.measured && cost.of(row)));
  form.cost.append(...known.map(([key, cost]) => new Option(cost.label, key)));
  for (const [name, choices] of Object.entries(CHOICES)) buildSegments(name, Object.entries(choices), state[name]);
  form.place.append(new Option("each by itself", ""), ...data.places.map(([machine, device], i) => new Option(`${machine}, ${device}`, places[i])));
  at("places-field").hidden = places.length < 2;
  at("methods").append(
    ...data.marks.map((mark) => {
      const input = element("input", { type: "checkbox", name: "method", value: mark.method, checked: !state.hidden.includes(mark.method) });
      return element("label", {}, input, shapeOf(mark), mark.method);
    }),
  );
  if (places.length > 1) {
    const line = ([machine, device, driver], i) => element("li", {}, element("b", {}, String(i + 1)), ` ${machine}: ${device} (${driver})`);
    at("machines").append(...data.places.map(line));
  }
  for (const name of ["scene", "cost", "place", "find"]) form[name].value = state[name];
  form.addEventListener("change", (event) => {
    const { name, value } = event.target;
    if (name === "method") state.hidden = [...form.querySelectorAll("[name=method]:not(:checked)")].map((box) => box.value);
    else state[name] = value;
    // FLIP is of whole images.
    if (state.part !== "total" && state.metric === "flip") {
      state.metric = "rel";
      form.querySelector("[name=metric][value=rel]").checked = true;
    }
    draw();
  });
  form.find.addEventListener("input", () => {
    state.find = form.find.value;
    draw();
  });
  form.addEventListener("submit", (event) => event.preventDefault());
}

/** Whether the filters let a row through: every word must be in its name, its changes, its method or its machine. */
function isShown(row) {
  if (row.scene !== state.scene || state.hidden.includes(methodOf(row)) || (state.place && !isGiven(row) && placeOf(row) !== state.place)) return false;
  const text = [row.name, ...row.changes, methodOf(row), machineOf(row)].join(" ").toLowerCase();
  return state.find.toLowerCase().split(/\s+/).every((word) => text.includes(word));
}

/** A row as a point of the chart, as far as it has both numbers. */
function pointOf(row) {
  const cost = COSTS[state.cost], x = row.measured && cost.of(row), y = errorOf(row);
  if (!x || y === undefined) return undefined;
  const noise = state.metric === "rel" ? row.measured[state.truth].noise_in_rel[state.part] : undefined;
  const was = (old) => [old.measured && cost.of(old), errorOf(old)];
  const earlier = data.history.filter((old) => sameSetting(old, row)).map(was).filter(([px, py]) => px && py !== undefined);
  return {
    row, x, y: Math.max(y, LEAST), name: row.name, preset: row.swept.length === 0, mark: markOf(row),
    least: noise > 0 ? y - noise : undefined,
    group: isGiven(row) ? undefined : data.mix_machines ? "" : placeOf(row),
    digit: places.length > 1 && !isGiven(row) ? String(places.indexOf(placeOf(row)) + 1) : undefined,
    told: (isGiven(row) ? ", time as given" : "") + (places.length > 1 ? `, machine ${machineOf(row)}` : "") + (noise > 0.02 * y ? `, of which noise of the reference up to ${digits(noise)}` : ""),
    earlier: earlier.map(([px, py]) => [px, Math.max(py, LEAST)]),
  };
}

function draw() {
  const rows = data.rows.filter(isShown);
  const cost = COSTS[state.cost];
  points = rows.map(pointOf).filter((point) => point);
  // The chosen setting stays chosen when the scene changes.
  const selected = (points.find((p) => p.row.key === state.key) ?? points.find((p) => p.name === state.name))?.row;
  at("controls").querySelector("[name=metric][value=flip]").disabled = state.part !== "total";
  const mixed = data.mix_machines && places.length > 1;
  const rule = places.length < 2 ? "no other row" : mixed ? "no other row on any machine" : "no other row on the same machine";
  const warning = mixed ? " Times of several machines are mixed in one line (--mix-machines)." : "";
  at("meaning").textContent = `${state.metric}: ${METRICS[state.metric]}. Lower and further left is better; the line joins what ${rule} beats.${warning}`;
  const yTitle = `${state.metric === "energy" ? "|energy − 1|" : state.metric}, ${CHOICES.part[state.part]}`;
  at("detail").hidden = points.length === 0;
  drawPlot(at("chart"), points, { xTitle: cost.unit, yTitle, selected, onSelect: choose });
  drawTable(cost, yTitle);
  const left = rows.filter((row) => row.measured).length - points.length;
  const scene = data.scenes.find((s) => s.name === state.scene);
  const missing = left > 0 ? ` Rows without such a number: ${left}.` : "";
  const bars = points.some((p) => p.least !== undefined) ? " Bars show how much of an error may be the reference's own noise." : "";
  const trails = points.some((p) => p.earlier.length > 0) ? " Broken lines come from earlier runs." : "";
  const traced = points.some((p) => p.row.source.kind === "path-tracer") ? " Stars are this program's path tracer on the processor, timed by the wall clock." : "";
  const given = points.some((p) => isGiven(p.row)) ? " Rings are images of other programs; their times are as given." : "";
  at("hint").textContent = `${scene.about}. Choose a point by mouse, touch, or Tab and the arrow keys.${bars}${trails}${traced}${given}${missing}`;
  const failed = rows.filter((row) => row.failure);
  at("failures").hidden = failed.length === 0;
  at("failures").querySelector("ul").replaceChildren(...failed.map((row) => element("li", {}, element("b", {}, row.name), `: ${row.failure}`)));
}

/** The columns of the table: a name, a title, and what a point shows and is sorted by. */
function columns(cost, yTitle) {
  const all = [
    { name: "name", title: "name", of: (p) => p.name },
    { name: "method", title: "method", of: (p) => methodOf(p.row) },
    { name: "machine", title: "machine", of: (p) => machineOf(p.row) },
    { name: "x", title: cost.unit, of: (p) => p.x },
    { name: "y", title: yTitle, of: (p) => p.y },
    { name: "noise", title: "noise in it", of: (p) => (p.least === undefined ? 0 : p.y - p.least) },
    { name: "memory", title: "MiB", of: (p) => mib(p.row.measured.memory_bytes) },
  ];
  return all.filter(({ name }) => (name !== "machine" || places.length > 1) && (name !== "memory" || state.cost !== "memory"));
}

function drawTable(cost, yTitle) {
  const cols = columns(cost, yTitle), by = cols.find(({ name }) => name === state.sort) ?? cols[0];
  const order = (a, b) => (typeof by.of(a) === "string" ? by.of(a).localeCompare(by.of(b)) : (by.of(a) ?? 0) - (by.of(b) ?? 0));
  const sorted = [...points].sort((a, b) => (state.falling ? -order(a, b) : order(a, b)));
  const best = new Set(frontiersOf(points).flat());
  const head = cols.map(({ name, title }) => {
    const button = element("button", { type: "button" }, title);
    button.dataset.sort = name;
    const cell = element("th", { scope: "col" }, button);
    if (name === by.name) cell.setAttribute("aria-sort", state.falling ? "descending" : "ascending");
    return cell;
  });
  const lines = sorted.map((p) => {
    const button = element("button", { type: "button", className: best.has(p) ? "best" : "", title: best.has(p) ? "on the frontier" : "" }, p.name);
    button.dataset.key = p.row.key;
    const cells = cols.slice(1).map(({ name, of }) => {
      const value = of(p);
      const text = value === undefined ? "–" : typeof value === "string" ? value : digits(value);
      return element("td", {}, ...(name === "method" ? [shapeOf(p.mark)] : []), name === "x" && isGiven(p.row) ? `${text} as given` : text);
    });
    const line = element("tr", {}, element("td", {}, button), ...cells);
    if (p.row.key === state.key) line.setAttribute("aria-current", "true");
    return line;
  });
  at("count").textContent = points.length === 1 ? "one row" : `${points.length} rows`;
  at("rows").replaceChildren(element("thead", {}, element("tr", {}, ...head)), element("tbody", {}, ...lines));
}

function choose(row) {
  [state.name, state.key] = [row.name, row.key];
  for (const line of at("rows").querySelectorAll("tbody tr")) {
    const is = line.querySelector("button").dataset.key === row.key;
    if (is) line.setAttribute("aria-current", "true");
    else line.removeAttribute("aria-current");
  }
  showDetail(row);
}

function showDetail(row) {
  chosen = row;
  const measured = row.measured;
  const scene = data.scenes.find((s) => s.name === row.scene);
  const truth = scene.truths.find((t) => t.bounces === measured[state.truth].bounces);
  at("name").textContent = `${row.name} · ${methodOf(row)} · ${row.scene}`;
  const cpu = measured.frame_cpu_ms ? `, ${digits(measured.frame_cpu_ms.median)} ms of processor time` : "";
  const frames = measured.frames === 1 ? "one frame" : `the median of ${measured.frames} frames`;
  const time = measured.frame_gpu_ms ?? measured.frame_wall_ms;
  const memory = measured.memory_bytes === null ? "" : `, ${digits(mib(measured.memory_bytes))} MiB`;
  at("numbers").textContent = isGiven(row)
    ? `${digits(row.source.milliseconds)} ms as given`
    : `${digits(time.median)} ${isOther(row) ? "ms by the wall clock" : "GPU ms"} (${frames}, ${digits(time.min)} to ${digits(time.max)})${cpu}${memory}` +
      (measured.nonfinite > 0 ? `, ${measured.nonfinite} values are not finite` : "");
  const { origin } = row;
  const noise = `reference noise ${digits(100 * measured[state.truth].noise)} %.`;
  at("origin").textContent = !origin
    ? `Judged by this program; ${noise}`
    : `Measured ${dateOf(row)} UTC on ${origin.machine}, twobounce ${origin.program}, build ${origin.build}${origin.label ? `, ${origin.label}` : ""}; ${noise}`;
  at("command").textContent = commandOf(row);
  at("command").hidden = at("copy").hidden = commandOf(row) === "";
  showGiven(row);
  at("copied").textContent = "";
  showPictures(row, scene, truth);
  showBeside(row);
  showHistory(row);
  const changes = row.changes.length > 0 ? row.changes : [`nothing: ${row.preset} itself`];
  at("changes").replaceChildren(...changes.map((change) => element("li", {}, change)));
  at("of-settings").hidden = at("all-settings").hidden = isOther(row);
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

/** What came with an image of another program. */
function showGiven(row) {
  at("given").hidden = !isGiven(row);
  if (!isGiven(row)) return;
  const { milliseconds, by, device, note, image, equal_terms_image: equal, indirect } = row.source;
  const bounces = row.measured.same.bounces;
  const told = [
    ["by", by ?? "whoever wrote the command"], ["time", `${digits(milliseconds)} ms a frame`], ["device", device ?? "not told"], ["note", note],
    ["image", image], ["image on equal terms", equal], ["indirect bounces", bounces === null ? "all" : String(bounces)],
    ["indirect light", indirect],
  ];
  at("given-list").replaceChildren(
    ...told.filter(([, text]) => text).flatMap(([key, text]) => [element("dt", {}, key), element("dd", {}, text)]),
  );
}

/** The kept setting beside the chosen one. */
function showBeside(row) {
  const other = data.rows.find(({ key }) => key === state.kept);
  at("keep").setAttribute("aria-pressed", Boolean(other));
  at("keep").textContent = other ? `Stop comparing with ${other.name}` : "Compare with others";
  at("beside").hidden = !other || other.key === row.key || other.scene !== row.scene || !other.measured;
  if (at("beside").hidden) return;
  at("beside-title").textContent = `${other.name} and ${row.name}`;
  for (const [side, shown] of [["a", other], ["b", row]]) {
    Object.assign(at(`image-${side}`), { src: shown.image, alt: `${shown.scene} rendered with ${shown.name}`, className: at("image").className });
    at(`caption-${side}`).textContent = `${shown.name} · ${methodOf(shown)}${places.length > 1 ? ` · ${machineOf(shown)}` : ""}`;
  }
  const lines = [];
  const add = (title, a, b) => {
    if (a === undefined || b === undefined) return;
    const change = b - a, word = change < 0 ? "better" : "worse";
    const text = change === 0 ? "0" : `${change < 0 ? "−" : "+"}${digits(Math.abs(change))} (${change < 0 ? "−" : "+"}${digits(Math.abs(100 * change / a))} %), ${word}`;
    const cells = [digits(a), digits(b)].map((value) => element("td", {}, value));
    lines.push(element("tr", {}, element("th", { scope: "row" }, title), ...cells, element("td", { className: change === 0 ? "" : word }, text)));
  };
  for (const metric of Object.keys(METRICS)) {
    const value = (shown) => errorOf(shown, { ...state, metric });
    add(`${metric === "energy" ? "|energy − 1|" : metric}, ${CHOICES.part[state.part]}`, value(other), value(row));
  }
  const alike = Boolean(row.origin) && placeOf(other) === placeOf(row);
  for (const { unit, of } of Object.values(COSTS)) {
    // Times of two machines say nothing about settings.
    if (alike || unit.startsWith("MiB")) add(unit, of(other), of(row));
  }
  const titles = ["", other.name, row.name, "difference"].map((title) => element("th", { scope: "col" }, title));
  at("differences").replaceChildren(element("thead", {}, element("tr", {}, ...titles)), element("tbody", {}, ...lines));
}

/** Earlier runs of the chosen setting, and this one. */
function showHistory(row) {
  const runs = [...data.history.filter((old) => sameSetting(old, row)), row];
  at("history").hidden = runs.length < 2;
  at("history-plot").replaceChildren();
  if (runs.length < 2) return;
  const cost = COSTS[state.cost];
  const number = (value) => (value === undefined || value === null ? "–" : digits(value));
  const lines = runs.map((run) => {
    const origin = run.origin ?? {};
    const build = origin.build ? `build ${origin.build.slice(0, 7)}` : "–";
    const cells = [origin.label ?? build, origin.program ?? "–", machineOf(run), number(cost.of(run)), number(errorOf(run))];
    return element("tr", {}, element("th", { scope: "row" }, dateOf(run)), ...cells.map((text) => element("td", {}, text)));
  });
  const titles = ["date, UTC", "of", "version", "machine", cost.unit, state.metric].map((title) => element("th", { scope: "col" }, title));
  at("history-rows").replaceChildren(element("thead", {}, element("tr", {}, ...titles)), element("tbody", {}, ...lines));
  drawRuns(at("history-plot"), runs.map((run) => cost.of(run)), cost.unit);
  drawRuns(at("history-plot"), runs.map((run) => errorOf(run)), `${state.metric}, ${CHOICES.part[state.part]}`);
}

/** A number over the runs, from 0 up, the latest on the right. */
function drawRuns(host, values, title) {
  const known = values.map((value, i) => [i, value]).filter(([, value]) => value !== undefined && value !== null);
  if (known.length === 0) return;
  const width = 360, height = 84, left = 64, bottom = 62, most = Math.max(...known.map(([, value]) => value)) || 1;
  const x = (i) => left + ((i + 0.5) / values.length) * (width - left - 8), y = (value) => bottom - (value / most) * (bottom - 12);
  const told = `${title} over ${values.length} runs: ${known.map(([, value]) => digits(value)).join(", ")}`;
  const svg = shape("svg", { viewBox: `0 0 ${width} ${height}`, role: "img", "aria-label": told });
  for (const value of [0, most]) svg.append(shape("text", { x: left - 6, y: y(value) + 4, "text-anchor": "end" }, digits(value)));
  svg.append(
    shape("path", { class: "grid", d: `M${left} ${bottom}H${width - 8}` }),
    shape("polyline", { class: "line", points: known.map(([i, value]) => `${x(i)},${y(value)}`).join(" ") }),
    ...known.map(([i, value]) => shape("circle", { cx: x(i), cy: y(value), r: 3.5 }, shape("title", {}, digits(value)))),
    shape("text", { x: left, y: height - 6 }, title),
  );
  host.append(svg);
}

/** Copies text; where the browser does not let pages do so, selects it. */
async function copy(text, node) {
  try {
    await navigator.clipboard.writeText(text);
    return true;
  } catch {
    getSelection().selectAllChildren(node);
    return document.execCommand("copy");
  }
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

const openable = ["rows-details", "all-settings"];
const kept = follow(data, () => {
  const { activeElement: active } = document;
  const focus = active.closest("#chart") ? "chart" : active.id;
  return { state, focus, open: openable.filter((id) => at(id).open), slider: at("slider").value };
});
if (kept && data.scenes.some(({ name }) => name === kept.state.scene)) Object.assign(state, kept.state);
buildControls();
at("slider").addEventListener("input", (event) => {
  at("compare").style.setProperty("--cut", `${event.target.value}%`);
});
at("rows").addEventListener("click", (event) => {
  const button = event.target.closest("button");
  if (!button) return;
  const { sort, key } = button.dataset;
  if (sort) {
    [state.sort, state.falling] = [sort, state.sort === sort && !state.falling];
    draw();
    at("rows").querySelector(`[data-sort="${sort}"]`).focus();
  } else {
    [state.key, state.name] = [key, undefined];
    draw();
    at("rows").querySelector(`[data-key="${key}"]`).focus();
  }
});
at("copy").addEventListener("click", async () => {
  at("copied").textContent = (await copy(commandOf(chosen), at("command"))) ? "copied" : "selected: copy it with the keyboard";
});
at("keep").addEventListener("click", () => {
  state.kept = state.kept ? undefined : chosen.key;
  showBeside(chosen);
  if (state.kept) at("copied").textContent = "Choose another setting to see both.";
});
draw();
if (kept) {
  openable.forEach((id) => { at(id).open = kept.open.includes(id); });
  at("slider").value = kept.slider;
  at("compare").style.setProperty("--cut", `${kept.slider}%`);
  if (kept.focus === "chart") at("chart").querySelector("[aria-selected=true]")?.focus({ preventScroll: true });
  else if (kept.focus) at(kept.focus)?.focus({ preventScroll: true });
  scrollTo(...kept.scroll);
}
let drawnWidth = at("chart").clientWidth;
new ResizeObserver(([entry]) => {
  const width = Math.round(entry.contentRect.width);
  if (width !== drawnWidth) {
    drawnWidth = width;
    draw();
  }
}).observe(at("chart"));
