"use strict";
// The table of cases and presets, and what is known of the chosen cell.

const unique = (values) => [...new Set(values)];
const grids = unique(data.rows.map((row) => row.grid)).sort((a, b) => a - b);
const presets = unique(data.rows.map((row) => row.preset));
const state = { grid: grids[Math.min(1, grids.length - 1)], of: "worst", case: data.cases[0].name, preset: presets[0] };

// Distance over the limit: colour, mark and words, so that none is needed alone.
const GRADES = [
  { most: 1, name: "good", mark: "", words: "within the limit" },
  { most: 3, name: "near", mark: "·", words: "up to three times the limit" },
  { most: 10, name: "far", mark: "!", words: "up to ten times the limit" },
  { most: Infinity, name: "off", mark: "!!", words: "further off" },
];

const caseOf = (name) => data.cases.find((c) => c.name === name);
const rowOf = (name, preset, grid) => data.rows.find((r) => r.case === name && r.preset === preset && r.grid === grid);

function words(value, unit) {
  if (Math.abs(value) >= 1e8) return "not finite";
  if (unit === "frames") return String(Math.round(value));
  if (unit === "ratio") return value.toFixed(3);
  return value === 0 ? "0" : `${digits(100 * value)} %`;
}

function gradeOf(row, about) {
  const distance = row.measured.distance;
  if (distance <= about.limit * (1 + 1e-9)) return GRADES[0];
  // A limit of nothing leaves only the last grade.
  return GRADES.slice(1).find((grade) => distance <= about.limit * grade.most && about.limit > 0) ?? GRADES.at(-1);
}

function shown(row, about) {
  const { number, distance } = row.measured;
  if (state.of === "median") return number.median;
  return Math.abs(number.max - about.ideal) >= distance * (1 - 1e-9) ? number.max : number.min;
}

function buildTable() {
  const methods = Object.fromEntries(data.rows.map((row) => [row.preset, row.method]));
  const columns = presets.map((preset) => element("th", { scope: "col", title: methods[preset] }, preset));
  const head = element("tr", {}, element("th", { scope: "col" }, "case"), ...columns);
  const lines = data.cases.map((about) => {
    const title = element("th", { scope: "row", title: about.meaning }, about.name);
    const cells = presets.map((preset) => {
      const button = element("button", { type: "button", tabIndex: -1 });
      Object.assign(button.dataset, { case: about.name, preset });
      return element("td", {}, button);
    });
    return element("tr", {}, title, ...cells);
  });
  const caption = element("caption", { className: "hint" }, "Cases are rows, presets are columns.");
  at("table").replaceChildren(caption, element("thead", {}, head), element("tbody", {}, ...lines));
  const keys = GRADES.map(({ name, mark, words: text }) => {
    const key = element("span", { className: `key ${name}` }, mark || "\u00a0");
    return element("li", {}, key, text);
  });
  at("legend").append(...keys);
}

function draw() {
  for (const button of at("table").querySelectorAll("button")) {
    const { case: name, preset } = button.dataset;
    const about = caseOf(name), row = rowOf(name, preset, state.grid);
    const chosen = name === state.case && preset === state.preset;
    button.setAttribute("aria-pressed", chosen);
    button.tabIndex = chosen ? 0 : -1;
    const place = `${name}, ${preset}, ${state.grid}³`;
    if (!row?.measured) {
      Object.assign(button, { className: "", textContent: "–" });
      button.setAttribute("aria-label", `${place}: ${row?.failure ?? "not measured"}`);
      continue;
    }
    const grade = gradeOf(row, about), value = words(shown(row, about), about.unit);
    Object.assign(button, { className: grade.name, textContent: `${grade.mark} ${value}` });
    button.setAttribute("aria-label", `${place}: ${value}, ideal ${words(about.ideal, about.unit)}, ${grade.words}`);
  }
  showDetail();
}

function showDetail() {
  const about = caseOf(state.case), row = rowOf(state.case, state.preset, state.grid);
  at("name").textContent = `${state.case} · ${state.preset} · ${state.grid}³`;
  at("meaning").textContent = about.meaning;
  at("advice").textContent = row?.measured && gradeOf(row, about) !== GRADES[0] ? about.advice : "";
  at("command").textContent = row?.command ?? "";
  at("more").replaceChildren();
  at("places").replaceChildren();
  for (const id of ["image", "truth"]) {
    at(id).src = row?.[id] ?? "data:,";
    at(id).alt = row?.[id] ? `${state.case} with ${state.preset}${id === "truth" ? ", the correct image" : `, at ${row.measured.worst}`}` : "";
    at(id).parentElement.hidden = !row?.[id];
  }
  drawGrids(about);
  if (!row?.measured) {
    at("numbers").textContent = row?.failure ?? "This cell is not measured.";
    return;
  }
  const { number, worst, frame_gpu_ms: ms, seconds } = row.measured;
  const [median, least, most] = [number.median, number.min, number.max].map((value) => words(value, about.unit));
  at("numbers").textContent =
    `${median}, from ${least} to ${most} over ${row.measured.places.length} places; ideal ${words(about.ideal, about.unit)}, ` +
    `limit ±${words(about.limit, about.unit)}; the worst at ${worst}. ${digits(ms.median)} GPU ms a frame, ${digits(seconds)} s in all.`;
  at("more").replaceChildren(
    ...row.measured.more.map(([name, value]) => element("tr", {}, element("th", { scope: "row" }, name), element("td", {}, digits(value)))),
  );
  drawSmall(at("places"), row.measured.places.map(([name, value]) => ({ label: "", name, value })), about);
}

/** The same preset on every grid. */
function drawGrids(about) {
  const points = grids.map((grid) => ({ grid, row: rowOf(state.case, state.preset, grid) })).filter(({ row }) => row?.measured);
  const told = points.map(({ grid, row }) => {
    const { median, min, max } = row.measured.number;
    return { label: `${grid}³`, name: `${grid}³`, value: median, min, max };
  });
  drawSmall(at("grids"), told, about, true);
}

/** Values side by side, the ideal as a broken line; `joined` by a line, with their spread. */
function drawSmall(host, points, about, joined = false) {
  host.replaceChildren();
  if (points.length === 0) return;
  const width = 360, height = 110, left = 64, bottom = 90;
  const all = points.flatMap(({ value, min = value, max = value }) => [min, max]).concat(about.ideal).filter((v) => Math.abs(v) < 1e8);
  const least = Math.min(...all), most = Math.max(...all), span = most - least || Math.abs(most) || 1;
  const y = (value) => bottom - ((Math.min(Math.max(value, least), most) - least) / span) * (bottom - 12);
  const x = (i) => left + ((i + 0.5) / points.length) * (width - left - 8);
  const title = points.map(({ name, value }) => `${name}: ${words(value, about.unit)}`).join("; ");
  const svg = shape("svg", { viewBox: `0 0 ${width} ${height}`, role: "img", "aria-label": title });
  svg.append(shape("path", { class: "ideal", d: `M${left} ${y(about.ideal)}H${width - 8}` }));
  const labels = most > least ? [most, least] : [least];
  labels.forEach((value) => svg.append(shape("text", { x: left - 6, y: y(value) + 4, "text-anchor": "end" }, words(value, about.unit))));
  if (joined) {
    points.forEach(({ min, max }, i) => svg.append(shape("path", { class: "bar", d: `M${x(i)} ${y(min)}V${y(max)}` })));
    svg.append(shape("polyline", { class: "line", points: points.map(({ value }, i) => `${x(i)},${y(value)}`).join(" ") }));
  }
  points.forEach(({ label, name, value }, i) => {
    const point = shape("circle", { cx: x(i), cy: y(value), r: 4 }, shape("title", {}, `${name}: ${words(value, about.unit)}`));
    svg.append(point, shape("text", { x: x(i), y: height - 4, "text-anchor": "middle" }, label));
  });
  host.append(svg);
}

function choose(name, preset, focus) {
  [state.case, state.preset] = [name, preset];
  draw();
  if (focus) at("table").querySelector('[aria-pressed="true"]').focus();
}

const kept = follow(data, () => ({ state, focus: document.activeElement.closest("#table") ? "table" : "" }));
if (kept && grids.includes(kept.state.grid)) Object.assign(state, kept.state);
buildSegments("grid", grids.map((grid) => [grid, `${grid}³`]), state.grid);
buildSegments("of", [["worst", "worst"], ["median", "median"]], state.of);
buildTable();
at("controls").addEventListener("change", (event) => {
  const { name, value } = event.target;
  state[name] = name === "grid" ? Number(value) : value;
  draw();
});
at("controls").addEventListener("submit", (event) => event.preventDefault());
at("table").addEventListener("click", (event) => {
  const button = event.target.closest("button");
  if (button) choose(button.dataset.case, button.dataset.preset, true);
});
at("table").addEventListener("keydown", (event) => {
  const ways = { ArrowRight: [0, 1], ArrowLeft: [0, -1], ArrowDown: [1, 0], ArrowUp: [-1, 0] };
  const way = ways[event.key];
  if (!way) return;
  event.preventDefault();
  const names = data.cases.map((about) => about.name);
  const near = (list, value, by) => list[Math.min(Math.max(list.indexOf(value) + by, 0), list.length - 1)];
  choose(near(names, state.case, way[0]), near(presets, state.preset, way[1]), true);
});
draw();
if (kept) {
  if (kept.focus === "table") at("table").querySelector('[aria-pressed="true"]')?.focus({ preventScroll: true });
  scrollTo(...kept.scroll);
}
