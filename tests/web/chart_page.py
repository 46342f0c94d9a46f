"""Tests the page that `twobounce chart` writes, in a real browser. Usage: chart_page.py PAGE.html FOLDER

The chart must have two scenes, several settings, and one that could not run. Screenshots go into FOLDER."""

import pathlib
import sys
import time

from driver import Browser, nothing_is_wider_than, quiet

HOME, TAB, LEFT, RIGHT = "\ue011", "\ue004", "\ue012", "\ue014"

# Every point: its name and its place in the viewport.
POINTS = """
document.querySelector('#chart').scrollIntoView({block: 'center'});
return [...document.querySelectorAll('.point')].map((p) => {
  const box = p.querySelector('.dot').getBoundingClientRect();
  return {name: p.dataset.name, x: box.x + box.width / 2, y: box.y + box.height / 2};
});"""
CHOSEN = "return document.querySelector('.point[aria-selected=true]').dataset.name"
PICTURES = "return ['image', 'reference', 'difference'].map((id) => document.getElementById(id).naturalWidth)"


def wait_for(browser, script, what):
    """Waits, because pictures are decoded a little after their source is set."""
    end = time.monotonic() + 10
    while not browser.run(script):
        assert time.monotonic() < end, f"waited in vain: {what}"
        time.sleep(0.05)


def check_chosen(browser, name, how):
    chosen, title = browser.run(CHOSEN), browser.run("return document.querySelector('#name').textContent")
    assert chosen == name, f"{how}: {chosen} is chosen instead of {name}"
    assert title.startswith(name + " · "), f"{how}: {name} is chosen, but {title} is shown"
    wait_for(browser, PICTURES + ".every((width) => width > 0)", f"the pictures of {name}")


def every_point_by(browser, pointer):
    points = browser.run(POINTS)
    assert len(points) >= 4, f"only {len(points)} points"
    for point in points:
        browser.click(point["x"], point["y"], pointer)
        check_chosen(browser, point["name"], pointer)


def every_point_by_keyboard(browser):
    names = {point["name"] for point in browser.run(POINTS)}
    # From the control before the chart, Tab leads to the chosen point.
    browser.run("document.querySelector('#find').focus()")
    browser.press(TAB)
    assert browser.run("return document.activeElement.classList.contains('point')"), "Tab does not reach the points"
    browser.press(HOME)
    seen = set()
    for _ in names:
        name = browser.run("return document.activeElement.dataset.name")
        check_chosen(browser, name, "keyboard")
        ring = browser.run("return getComputedStyle(document.activeElement.querySelector('.ring')).strokeWidth")
        assert ring == "4px", f"the focus on {name} cannot be seen: ring of {ring}"
        assert browser.run("return document.activeElement.getAttribute('aria-label')").startswith(name)
        seen.add(name)
        browser.press(RIGHT)
    assert seen == names, f"the arrow keys reach {seen} of {names}"


def the_slider_moves(browser):
    cut = "return getComputedStyle(document.getElementById('image')).clipPath"
    browser.run("const s = document.getElementById('slider'); s.scrollIntoView({block: 'center'}); s.focus()")
    before = browser.run(cut)
    browser.press(LEFT)
    after = browser.run(cut)
    assert before != after, f"the slider does not follow the keys: {before}"
    box = browser.run("const b = document.getElementById('slider').getBoundingClientRect(); return [b.x, b.y, b.width, b.height]")
    middle = box[1] + box[3] / 2
    browser.drag([(box[0] + 0.5 * box[2], middle), (box[0] + 0.25 * box[2], middle)])
    value = float(browser.run("return document.getElementById('slider').value"))
    # A whole percentage, and half a pixel of the pointer.
    assert abs(value - 25) <= 1.5, f"the slider is at {value}, dragged to 25"
    wait_for(browser, f"{cut}.includes('{100 - value:.0f}%')", "the picture's edge")


def every_switch_changes_the_drawing(browser):
    # The numbers of every point, not the words around them.
    drawing = """return [...document.querySelectorAll('.point')].map((p) => {
      const told = p.getAttribute('aria-label').slice(p.dataset.name.length);
      return p.dataset.name + ' ' + told.match(/[0-9][0-9.,e-]*/g).slice(0, 2).join(' ');
    }).sort().join('\\n')"""
    choose = """
const control = document.querySelector(`[name=${arguments[0]}]`);
const radio = document.querySelector(`[name=${arguments[0]}][value="${arguments[1]}"]`);
if (radio) radio.click();
else { control.value = arguments[1]; control.dispatchEvent(new Event('change', {bubbles: true})); }"""
    scenes = browser.run("return [...document.querySelector('[name=scene]').options].map((o) => o.value)")
    assert len(scenes) == 2, scenes
    switches = [
        ("metric", ["energy", "relmse", "p95", "flip", "rel"]), ("part", ["indirect", "diffuse", "total"]),
        ("truth", ["same", "full"]), ("cost", ["cpu", "memory", "gpu"]), ("scene", [scenes[1], scenes[0]]),
    ]
    for name, values in switches:
        for value in values:
            before = browser.run(drawing)
            browser.run(choose, name, value)
            assert browser.run(drawing) != before, f"{name} = {value} does not change the drawing"
            assert browser.run("return document.querySelectorAll('.point').length") >= 4, f"{name} = {value}"
    browser.run(choose, "metric", "flip")
    browser.run(choose, "part", "indirect")
    assert browser.run("return document.querySelector('[name=metric]:checked').value") == "rel", "flip has no indirect part"
    browser.run(choose, "part", "total")


def the_tooltip_follows(browser):
    point = browser.run(POINTS)[0]
    browser.move(point["x"] + 3, point["y"])
    told = browser.run("const t = document.querySelector('.tooltip'); return t.hidden ? '' : t.textContent")
    assert told.startswith(point["name"] + ", "), f"the tooltip says {told!r} at {point['name']}"


def methods_differ(browser):
    """Checks that methods differ by colour and shape, in the drawing and the legend, and in words for screen
    readers."""
    looks = """return [...document.querySelectorAll('.point')].map((p) => {
      const d = p.querySelector('.dot');
      return [p.dataset.method, d.getAttribute('fill'), d.getAttribute('d'), p.getAttribute('aria-label')];
    })"""
    legend = """return [...document.querySelectorAll('#methods label')].map((item) => {
      const d = item.querySelector('path');
      return [item.textContent, d.getAttribute('fill'), d.getAttribute('d')];
    })"""
    points, known = browser.run(looks), browser.run(legend)
    used = {point[0] for point in points}
    assert len(used) >= 2 and used <= {item[0] for item in known}, f"{used} are drawn, the legend has {known}"
    for i in (1, 2):
        assert len({item[i] for item in known}) == len(known), f"two methods look alike: {known}"
    for method, *look, told in points:
        assert [method, *look] in known, f"{told} does not look as in the legend"
        assert f", {method}:" in told, f"{told} does not say its method"
    title = browser.run("return document.querySelector('#name').textContent")
    assert any(f" · {method} · " in title for method in used), f"{title} does not say the method"


def the_table_sorts_and_filters(browser):
    names = "return [...document.querySelectorAll('#rows tbody button')].map((b) => b.textContent)"
    browser.run("document.querySelector('#rows-details').open = true")
    seen = set()
    for column in ("x", "y", "name", "name"):
        browser.run("document.querySelector(`[data-sort=${arguments[0]}]`).click()", column)
        seen.add(tuple(browser.run(names)))
        assert browser.run("return document.activeElement.dataset.sort") == column, "the focus leaves the column's title"
        assert browser.run("return document.querySelectorAll('#rows [aria-sort]').length") == 1
    assert len(seen) >= 3, f"columns do not sort: {seen}"
    last = browser.run(names)
    assert last == sorted(last, reverse=True), last
    # A row is chosen by its name, with the keyboard.
    browser.run("document.querySelector('#rows tbody button').focus()")
    browser.press("\ue007")
    check_chosen(browser, last[0], "the table")
    everything = len(browser.run(names))
    browser.run("document.querySelector('#find').focus()")
    for letter in "rays.diffuse=32":
        browser.press(letter)
    found = browser.run(names)
    assert 0 < len(found) < everything and all("rays.diffuse=32" in name for name in found), found
    browser.run("const f = document.querySelector('#find'); f.value = ''; f.dispatchEvent(new Event('input', {bubbles: true}))")
    box = "document.querySelector('[name=method][value=cones]')"
    browser.run(box + ".click()")
    methods = browser.run("return [...new Set([...document.querySelectorAll('.point')].map((p) => p.dataset.method))]")
    assert sorted(methods) == ["path tracer", "rays"], methods
    browser.run(box + ".click()")
    assert len(browser.run(names)) == everything
    browser.run("document.querySelector('#rows-details').open = false")


def two_settings_are_compared(browser):
    points = browser.run(POINTS)
    browser.click(points[0]["x"], points[0]["y"])
    name = browser.run(CHOSEN)
    browser.run("document.querySelector('#keep').click()")
    other = next(point for point in browser.run(POINTS) if point["name"] != name)
    browser.click(other["x"], other["y"])
    assert browser.run("return !document.querySelector('#beside').hidden"), "nothing stands beside"
    title = browser.run("return document.querySelector('#beside-title').textContent")
    assert title == f"{name} and {other['name']}", title
    wait_for(browser, "return ['image-a', 'image-b'].every((id) => document.getElementById(id).naturalWidth > 0)", "both pictures")
    cells = browser.run("return [...document.querySelectorAll('#differences tbody tr')].map((r) => [...r.cells].map((c) => c.textContent))")
    rel = next(row for row in cells if row[0].startswith("rel,"))
    a, b = float(rel[1]), float(rel[2])
    assert rel[3].endswith("better" if b < a else "worse"), rel
    assert abs(abs(b - a) - float(rel[3].lstrip("+−").split(" ")[0])) < 0.02 * max(a, b), rel
    browser.run("document.querySelector('#keep').click()")
    assert browser.run("return document.querySelector('#beside').hidden")


def the_command_is_copied(browser):
    browser.run("document.querySelector('#copy').scrollIntoView({block: 'center'})")
    at = browser.run("const b = document.querySelector('#copy').getBoundingClientRect(); return [b.x + b.width / 2, b.y + b.height / 2]")
    browser.click(*at)
    wait_for(browser, "return document.querySelector('#copied').textContent !== ''", "a word that it is copied")
    assert browser.run("return document.querySelector('#copied').textContent") == "copied"
    browser.run("const f = document.querySelector('#find'); f.focus(); f.value = ''")
    browser.run("document.execCommand('paste')")
    command = browser.run("return document.querySelector('#command').textContent")
    name = browser.run(CHOSEN)
    assert command.startswith("twobounce render assets/") and f"--preset {name.split(' ')[0]}" in command, command
    assert "--set voxels=16" in command or "voxels=64" in command, command


def earlier_runs_are_shown(browser):
    assert browser.run("return !document.querySelector('#history').hidden"), "no earlier run is shown"
    lines = browser.run("return [...document.querySelectorAll('#history-rows tbody tr')].map((r) => r.innerText)")
    assert len(lines) == 2 and "first" in lines[0] and "second" in lines[1], lines
    assert browser.run("return document.querySelectorAll('#history-plot svg[aria-label]').length") == 2
    assert browser.run("return document.querySelectorAll('.trail').length") >= 4, "no trail of earlier runs"


def main(page, folder):
    with Browser() as browser:
        browser.look(1280, 900, "light")
        browser.open(page)
        wait_for(browser, PICTURES + ".every((width) => width > 0)", "the first pictures")
        quiet(browser, "after loading")
        lines = browser.run("return document.querySelector('.frontier').points.numberOfItems")
        assert lines >= 2, f"the frontier has {lines} points"
        failures = browser.run("return document.querySelector('#failures').innerText")
        assert "printed voxels=64" in failures and "--memory-limit" in failures, f"no word of what failed: {failures!r}"
        methods_differ(browser)
        every_point_by(browser, "mouse")
        every_point_by_keyboard(browser)
        the_tooltip_follows(browser)
        the_slider_moves(browser)
        every_switch_changes_the_drawing(browser)
        earlier_runs_are_shown(browser)
        the_table_sorts_and_filters(browser)
        two_settings_are_compared(browser)
        the_command_is_copied(browser)
        browser.run("scrollTo(0, 0)")
        browser.screenshot(folder / "wide.png")
        for scheme in ("light", "dark"):
            browser.look(375, 812, scheme)
            time.sleep(0.2)
            nothing_is_wider_than(browser, 375)
            every_point_by(browser, "touch")
            browser.run("document.querySelector('details').open = true")
            nothing_is_wider_than(browser, 375)
            browser.run("document.querySelector('details').open = false; scrollTo(0, 0)")
            browser.screenshot(folder / f"phone-{scheme}.png")
            browser.run("document.querySelector('#compare').scrollIntoView()")
            browser.screenshot(folder / f"phone-{scheme}-detail.png")
        quiet(browser, "at the end")
    print(f"the page works; screenshots are in {folder}")


if __name__ == "__main__":
    main(pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2]))
