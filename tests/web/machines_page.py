"""Tests the page of a chart that two machines made, in a real browser. Usage: machines_page.py PAGE.html FOLDER"""

import pathlib
import sys

from driver import Browser, nothing_is_wider_than, quiet

LINES = "return document.querySelectorAll('.frontier').length"
TOLD = "return [...document.querySelectorAll('.point')].map((p) => p.getAttribute('aria-label'))"


def main(page, folder):
    with Browser() as browser:
        browser.look(1280, 900, "light")
        browser.open(page)
        quiet(browser, "after loading")
        assert browser.run(LINES) == 2, "each machine has a frontier"
        told = browser.run(TOLD)
        assert all("machine anna" in text or "machine bert" in text for text in told), told
        digits = set(browser.run("return [...document.querySelectorAll('.digit')].map((d) => d.textContent)"))
        assert digits == {"1", "2"}, digits
        machines = browser.run("return document.querySelector('#machines').innerText")
        assert "anna" in machines and "bert" in machines, machines
        browser.run("const s = document.querySelector('[name=place]'); s.selectedIndex = 1; s.dispatchEvent(new Event('change', {bubbles: true}))")
        assert browser.run(LINES) == 1
        told = browser.run(TOLD)
        assert told and all("machine anna" in text for text in told), told
        browser.screenshot(folder / "machines.png")
        browser.look(375, 812, "dark")
        nothing_is_wider_than(browser, 375)
        quiet(browser, "at the end")
    print("the page of two machines works")


if __name__ == "__main__":
    main(pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2]))
