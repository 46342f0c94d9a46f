"""Tests the page that `twobounce stability` writes, in a real browser. Usage: stability_page.py PAGE.html FOLDER

The table must have several cases, two presets and two grids. Screenshots go into FOLDER."""

import pathlib
import sys

from driver import Browser, nothing_is_wider_than, quiet

TAB, LEFT, UP, RIGHT, DOWN = "\ue004", "\ue012", "\ue013", "\ue014", "\ue015"

CELLS = """return [...document.querySelectorAll('#table button')].map((b) => {
  b.scrollIntoView({block: 'center', inline: 'center'});
  const box = b.getBoundingClientRect();
  return {x: box.x + box.width / 2, y: box.y + box.height / 2, case: b.dataset.case, preset: b.dataset.preset,
          told: b.getAttribute('aria-label'), text: b.textContent, look: b.className};
})"""
CHOSEN = """const b = document.querySelector('#table [aria-pressed="true"]');
return {case: b.dataset.case, preset: b.dataset.preset, focused: b === document.activeElement,
        count: document.querySelectorAll('#table [aria-pressed="true"]').length}"""
DETAIL = """const t = (id) => document.getElementById(id).textContent;
return {name: t('name'), numbers: t('numbers'), command: t('command'), image: document.getElementById('image').naturalWidth,
        grids: document.querySelectorAll('#grids circle').length, places: document.querySelectorAll('#places circle').length}"""
PLACE = """const b = document.querySelectorAll('#table button')[arguments[0]];
b.scrollIntoView({block: 'center', inline: 'center'});
const box = b.getBoundingClientRect();
return [box.x + box.width / 2, box.y + box.height / 2]"""


def every_cell_by_mouse(browser):
    cells = browser.run(CELLS)
    assert len(cells) >= 4, cells
    for i, cell in enumerate(cells):
        browser.click(*browser.run(PLACE, i))
        chosen, detail = browser.run(CHOSEN), browser.run(DETAIL)
        assert (chosen["case"], chosen["preset"], chosen["count"]) == (cell["case"], cell["preset"], 1), (chosen, cell)
        assert detail["name"].startswith(f"{cell['case']} · {cell['preset']} · "), detail
        assert f"--case {cell['case']} --preset {cell['preset']}" in detail["command"], detail
        assert detail["image"] > 0 and detail["grids"] == 2 and detail["places"] >= 2, detail
        assert "ideal" in cell["told"] and cell["look"], f"{cell} says nothing of its distance to who does not see it"


def every_cell_by_keyboard(browser):
    cells = browser.run(CELLS)
    presets = len({cell["preset"] for cell in cells})
    browser.click(*browser.run(PLACE, 0))
    for i, cell in enumerate(cells):
        chosen = browser.run(CHOSEN)
        assert (chosen["case"], chosen["preset"]) == (cell["case"], cell["preset"]) and chosen["focused"], (chosen, cell)
        if (i + 1) % presets:
            browser.press(RIGHT)
        else:
            for key in [LEFT] * (presets - 1) + [DOWN]:
                browser.press(key)
    stops = browser.run("return document.querySelectorAll('#table button[tabindex=\"0\"]').length")
    assert stops == 1, f"{stops} cells are reached by Tab"


def grids_change_the_table(browser):
    text = "return document.querySelector('#table').textContent"
    grids = browser.run("return [...document.querySelectorAll('[name=grid]')].map((i) => i.value)")
    seen = set()
    for grid in grids:
        browser.run("document.querySelector(`[name=grid][value='${arguments[0]}']`).click()", grid)
        seen.add(browser.run(text))
        assert f"--grid {grid} " in browser.run(DETAIL)["command"]
    assert len(seen) == len(grids) == 2, "a grid does not change the table"


def main(page, folder):
    with Browser() as browser:
        browser.look(1280, 900, "light")
        browser.open(page)
        quiet(browser, "after loading")
        every_cell_by_mouse(browser)
        every_cell_by_keyboard(browser)
        grids_change_the_table(browser)
        browser.run("scrollTo(0, 0)")
        browser.screenshot(folder / "stability-wide.png")
        for scheme in ("light", "dark"):
            browser.look(375, 812, scheme)
            nothing_is_wider_than(browser, 375)
            browser.screenshot(folder / f"stability-phone-{scheme}.png")
        quiet(browser, "at the end")
    print(f"the page of stability works; screenshots are in {folder}")


if __name__ == "__main__":
    main(pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2]))
