"""Tests that a chart's page follows a run and stops when it is done, from a file. Usage: follow_page.py FOLDER"""

import pathlib
import shutil
import subprocess
import sys
import time

from driver import Browser, quiet

COUNT = "return document.querySelectorAll('.point').length"
RUNNING = "return data.running"


def main(folder):
    output = folder / "followed"
    shutil.rmtree(output, ignore_errors=True)
    cache = {"TWOBOUNCE_CACHE": str(folder / "cache"), "PATH": "/usr/bin:/bin", "HOME": str(folder)}
    command = ["target/release/twobounce", "chart", "assets/cornell-area.glb", "-o", str(output), "--paths", "none", "--size", "96x96", "--set", "voxels=32",
               "--presets", "fast,balanced,printed,lpv", "--reference-noise", "1.5", "-q"]
    run = subprocess.Popen(command, env=cache)
    page = output / "index.html"
    end = time.monotonic() + 120
    while not page.exists():
        assert time.monotonic() < end and run.poll() is None, "no page while it runs"
        time.sleep(0.1)
    with Browser() as browser:
        browser.look(1280, 900, "light")
        browser.open(page)
        assert browser.run(RUNNING), "the page does not know that the program runs"
        assert browser.run("return !document.querySelector('.follow').hidden")
        assert "Errors are rough" in browser.run("return document.querySelector('.missing').textContent")
        browser.run("document.querySelector('[name=metric][value=relmse]').click(); document.querySelector('#rows-details').open = true")
        browser.run("document.querySelector('#find').focus()")
        first = browser.run(COUNT)
        while browser.run(RUNNING):
            assert time.monotonic() < end, "the page never sees the end"
            time.sleep(0.5)
        assert run.wait() == 0
        assert browser.run(COUNT) == 4 and first < 4, first
        assert browser.run("return document.querySelector('.follow').hidden"), "it goes on when all is done"
        assert browser.run("return document.querySelector('[name=metric]:checked').value") == "relmse", "what was chosen is lost"
        assert browser.run("return document.querySelector('#rows-details').open"), "what was open is closed"
        assert browser.run("return document.activeElement.id") == "find", "the focus is lost"
        browser.run("window.stays = true")
        time.sleep(7)
        assert browser.run("return window.stays === true"), "the page still loads itself"
        quiet(browser, "at the end")
    print("the page follows a run and stops")


if __name__ == "__main__":
    main(pathlib.Path(sys.argv[1]))
