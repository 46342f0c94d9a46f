"use strict";
// Code that the pages of all experiments share: their data, elements, choices, and following the program.

const data = JSON.parse(document.getElementById("data").textContent);
data.rows = data.rows.map(({ row, pictures }) => ({ ...row, ...pictures }));
const at = (id) => document.getElementById(id);

function element(name, attributes = {}, ...children) {
  const node = Object.assign(document.createElement(name), attributes);
  node.append(...children);
  return node;
}

/** Fills the segments of a control: pairs of a value and a label, of which `chosen` is checked. */
function buildSegments(name, choices, chosen) {
  const host = at("controls").querySelector(`[data-name=${name}]`);
  for (const [value, label] of choices) {
    const input = element("input", { type: "radio", name, value, checked: String(value) === String(chosen) });
    host.append(element("label", {}, input, label));
  }
}

// While the program still fills the folder, the page loads itself again and comes back as it was. What is not to be lost is kept in
// the tab's own storage, so this works for a file too.

// `data`: has `running` and `written_unix_s`. `keep()`: what to come back with. Returns what an earlier load kept.
function follow(data, keep) {
  const name = `twobounce ${location.pathname}`;
  const box = document.getElementById("follow"), words = document.getElementById("following");
  let kept;
  try {
    kept = JSON.parse(sessionStorage.getItem(name) ?? "null") ?? undefined;
  } catch {
    kept = undefined;
  }
  box.closest("label").hidden = !data.running;
  if (!data.running) return kept;
  box.checked = kept?.following ?? true;
  const save = () => {
    const state = { ...keep(), following: box.checked, scroll: [scrollX, scrollY] };
    try {
      sessionStorage.setItem(name, JSON.stringify(state));
    } catch {
      // Without storage the page comes back as new.
    }
  };
  // Large pages are loaded less often.
  const loading = performance.timing.domInteractive - performance.timing.navigationStart;
  const every = Math.max(5000, 20 * loading);
  const again = () => {
    if (!box.checked || document.hidden) return;
    save();
    location.reload();
  };
  setInterval(again, every);
  box.addEventListener("change", save);
  const age = () => {
    const seconds = Math.max(0, Math.round(Date.now() / 1000 - data.written_unix_s));
    words.textContent = `follow: the page loads itself again while the program runs (written ${seconds} s ago)`;
  };
  age();
  setInterval(age, 1000);
  return kept;
}
