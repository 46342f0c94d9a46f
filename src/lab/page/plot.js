"use strict";
// Draws points (cost, error) on logarithmic axes, with the frontier, a tooltip, and selection by mouse, touch and keyboard.

const SVG = "http://www.w3.org/2000/svg";

function shape(name, attributes, ...children) {
  const node = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) node.setAttribute(key, value);
  node.append(...children);
  return node;
}

// Three significant digits, or whole numbers with thousands apart.
function digits(value) {
  if (value >= 1000) return Math.round(value).toLocaleString("en");
  return value === 0 ? "0" : String(Number(value.toPrecision(3)));
}

// A tick's label: short, so that many fit.
function tickLabel(value) {
  return value >= 1000 ? `${digits(value / 1000)}k` : digits(value);
}

// The points that no other beats on both axes, the cheapest first.
function frontierOf(points) {
  const beats = (a, b) => a.x <= b.x && a.y <= b.y && (a.x < b.x || a.y < b.y);
  return points.filter((p) => !points.some((q) => beats(q, p))).sort((a, b) => a.x - b.x);
}

// The frontier of each group of points by itself. A point of no group belongs to every group.
function frontiersOf(points) {
  const groups = [...new Set(points.map((p) => p.group).filter((group) => group !== undefined))];
  if (groups.length === 0) return [frontierOf(points)];
  return groups.map((group) => frontierOf(points.filter((p) => p.group === undefined || p.group === group)));
}

// A logarithmic axis over some values, from pixel `start` to pixel `end`.
function logAxis(values, start, end) {
  const least = Math.min(...values), most = Math.max(...values);
  // An eighth of a decade of air, and never a span of less than half a one.
  const air = Math.max(0.125, 0.25 - Math.log10(most / least) / 2);
  const low = Math.log10(least) - air, high = Math.log10(most) + air;
  const place = (value) => start + ((end - start) * (Math.log10(value) - low)) / (high - low);
  const decade = Math.abs(end - start) / (high - low);
  const ticks = [];
  for (let e = Math.floor(low); e <= high; e++) {
    for (let m = 1; m < 10; m++) {
      const value = Number((m * 10 ** e).toPrecision(1));
      const at = place(value);
      if (at < Math.min(start, end) || at > Math.max(start, end)) continue;
      // Only where there is room for the labels.
      const labelled = m === 1 || (decade > 90 && (m === 2 || m === 5)) || decade > 500;
      ticks.push({ value, at, labelled });
    }
  }
  return { place, ticks };
}

// A point as its method's are drawn.
function dot(mark, radius) {
  return shape("path", { class: "dot", d: mark.shape, fill: mark.color, transform: `scale(${radius})` });
}

// Draws into `host`. `points`: {row, x, y, mark, name, preset}; further {group}, whose frontier it may be on, of none every one's; {digit}, drawn in its
// middle; {least}, where its error bar ends below; {earlier}, the same of earlier runs: [x, y] each; {told}, more about it.
// `onSelect(row)` is called for every selection.
function drawPlot(host, points, { xTitle, yTitle, selected, onSelect }) {
  const hadFocus = host.contains(document.activeElement);
  host.replaceChildren();
  const width = host.clientWidth, height = Math.min(460, Math.max(280, width * 0.62));
  const left = 58, right = width - 24, top = 12, bottom = height - 46;
  const svg = shape("svg", { viewBox: `0 0 ${width} ${height}`, height });
  host.append(svg);
  if (points.length === 0) {
    svg.append(shape("text", { x: left, y: height / 2 }, "No setting has this number."));
    return;
  }
  const earlier = points.flatMap((p) => p.earlier ?? []);
  const x = logAxis([...points.map((p) => p.x), ...earlier.map(([px]) => px)], left, right);
  const y = logAxis([...points.map((p) => p.y), ...earlier.map(([, py]) => py)], bottom, top);
  drawAxes(svg, x, y, { left, right, top, bottom, width, height, xTitle, yTitle });
  for (const p of points) [p.px, p.py] = [x.place(p.x), y.place(p.y)];
  const groups = frontiersOf(points), best = groups.flat();
  groups.forEach((group, i) => {
    const places = group.map((p) => `${p.px},${p.py}`).join(" ");
    svg.append(shape("polyline", { class: "frontier", points: places, "stroke-dasharray": i === 0 ? "none" : `${6 / i} 3` }));
  });
  for (const p of points) drawExtent(svg, p, y, bottom, best.includes(p));
  for (const p of points.filter((p) => p.earlier?.length > 0)) {
    const places = p.earlier.map(([px, py]) => [x.place(px), y.place(py)]);
    svg.append(shape("polyline", { class: "trail", points: [...places, [p.px, p.py]].map((at) => at.join(",")).join(" ") }));
    places.forEach(([cx, cy]) => svg.append(shape("circle", { class: "was", cx, cy, r: 2.5 })));
  }

  const list = shape("g", { role: "listbox", "aria-label": `Settings: ${yTitle} against ${xTitle}` });
  const tooltip = makeTooltip(host, width);
  svg.append(list);
  // Faint ones first, so that the frontier lies on top.
  for (const p of [...points].sort((a, b) => best.includes(a) - best.includes(b))) {
    const on = best.includes(p);
    const told = `${p.name}, ${p.mark.method}: ${digits(p.x)} ${xTitle}, ${digits(p.y)} ${yTitle}${on ? ", on the frontier" : ""}${p.told ?? ""}`;
    const radius = p.preset ? 7 : 5;
    p.node = shape(
      "g",
      { class: on ? "point" : "point faint", role: "option", tabindex: -1, "aria-label": told, "aria-selected": false,
        transform: `translate(${p.px} ${p.py})`, "data-name": p.name, "data-method": p.mark.method },
      dot(p.mark, radius),
      ...(p.digit ? [shape("text", { class: "digit", y: 3.5, "text-anchor": "middle", "aria-hidden": true }, p.digit)] : []),
      shape("circle", { class: "ring", r: radius + 3 }),
    );
    p.node.addEventListener("focus", () => tooltip.show(p));
    p.node.addEventListener("blur", tooltip.hide);
    list.append(p.node);
  }
  drawLabels(svg, points, { left, right, top, bottom });

  let chosen;
  const select = (p, focus) => {
    if (chosen) [["aria-selected", false], ["tabindex", -1]].forEach(([k, v]) => chosen.node.setAttribute(k, v));
    chosen = p;
    [["aria-selected", true], ["tabindex", 0]].forEach(([k, v]) => p.node.setAttribute(k, v));
    if (focus) p.node.focus({ preventScroll: true });
    onSelect(p.row);
  };
  select(points.find((p) => p.row === selected) ?? best[0], hadFocus);

  // Points in one place are chosen in turn.
  const nearest = (event, reach) => {
    const box = svg.getBoundingClientRect();
    const distance = (p) => Math.hypot(p.px - (event.clientX - box.left), p.py - (event.clientY - box.top));
    const least = Math.min(...points.map(distance));
    if (least > reach) return undefined;
    const together = points.filter((p) => distance(p) < least + 0.5);
    return together[(together.indexOf(chosen) + 1) % together.length];
  };
  svg.addEventListener("click", (event) => {
    const p = nearest(event, 44);
    if (p) select(p, true);
  });
  svg.addEventListener("pointermove", (event) => {
    const p = nearest(event, 28);
    if (p) tooltip.show(p);
    else tooltip.hide();
  });
  svg.addEventListener("pointerleave", tooltip.hide);
  list.addEventListener("keydown", (event) => {
    const keys = { ArrowRight: ["x", 1], ArrowLeft: ["x", -1], ArrowUp: ["y", 1], ArrowDown: ["y", -1], Home: ["x", -Infinity], End: ["x", Infinity] };
    const key = keys[event.key];
    if (!key) return;
    event.preventDefault();
    const order = [...points].sort((a, b) => a[key[0]] - b[key[0]]);
    const next = Math.min(Math.max(order.indexOf(chosen) + key[1], 0), order.length - 1);
    select(order[next], true);
  });
}

// The bar down to what a point's error is at least.
function drawExtent(svg, p, y, bottom, on) {
  if (p.least === undefined) return;
  const end = p.least > 0 ? Math.min(y.place(p.least), bottom) : bottom;
  // A bar that the mark hides says nothing.
  if (end < p.py + 8) return;
  const cap = end < bottom ? `M${p.px - 4} ${end}H${p.px + 4}` : "";
  svg.append(shape("path", { class: on ? "extent" : "extent faint", d: `M${p.px} ${p.py}V${end}${cap}`, "data-name": p.name }));
}

function drawAxes(svg, x, y, { left, right, top, bottom, width, height, xTitle, yTitle }) {
  for (const { value, at, labelled } of x.ticks) {
    svg.append(shape("path", { class: labelled ? "grid" : "grid minor", d: `M${at} ${top}V${bottom}` }));
    if (labelled) svg.append(shape("text", { x: at, y: bottom + 17, "text-anchor": "middle" }, tickLabel(value)));
  }
  for (const { value, at, labelled } of y.ticks) {
    svg.append(shape("path", { class: labelled ? "grid" : "grid minor", d: `M${left} ${at}H${right}` }));
    if (labelled) svg.append(shape("text", { x: left - 7, y: at + 4, "text-anchor": "end" }, tickLabel(value)));
  }
  const middle = (top + bottom) / 2;
  svg.append(
    shape("text", { x: (left + right) / 2, y: height - 6, "text-anchor": "middle" }, xTitle),
    shape("text", { x: 12, y: middle, "text-anchor": "middle", transform: `rotate(-90 12 ${middle})` }, yTitle),
  );
}

// Names the presets where there is room beside their points.
function drawLabels(svg, points, { left, right, top, bottom }) {
  const taken = points.map((p) => ({ l: p.px - 7, r: p.px + 7, t: p.py - 7, b: p.py + 7 }));
  for (const p of points.filter((p) => p.preset)) {
    const label = shape("text", { class: "label", "aria-hidden": true }, p.name);
    svg.append(label);
    const wide = label.getComputedTextLength();
    const places = [[p.px + 11, p.py + 4], [p.px - 11 - wide, p.py + 4], [p.px - wide / 2, p.py - 13], [p.px - wide / 2, p.py + 22]];
    const free = places.find(([l, y]) => {
      const box = { l, r: l + wide, t: y - 11, b: y + 3 };
      const inside = box.l > left && box.r < right && box.t > top && box.b < bottom;
      return inside && !taken.some((o) => o.l < box.r && o.r > box.l && o.t < box.b && o.b > box.t);
    });
    if (!free) {
      label.remove();
      continue;
    }
    label.setAttribute("x", free[0]);
    label.setAttribute("y", free[1]);
    taken.push({ l: free[0], r: free[0] + wide, t: free[1] - 11, b: free[1] + 3 });
  }
}

function makeTooltip(host, width) {
  const box = document.createElement("div");
  box.className = "tooltip";
  box.hidden = true;
  host.append(box);
  const show = (p) => {
    box.textContent = p.node.getAttribute("aria-label");
    box.hidden = false;
    const at = Math.min(Math.max(p.px - box.offsetWidth / 2, 0), width - box.offsetWidth);
    const above = p.py - box.offsetHeight - 16;
    box.style.left = `${at}px`;
    box.style.top = `${above > 0 ? above : p.py + 16}px`;
  };
  return { show, hide: () => { box.hidden = true; } };
}
