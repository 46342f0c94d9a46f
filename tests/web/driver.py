"""A headless browser over the WebDriver protocol, with Python's standard library alone."""

import base64
import json
import shutil
import subprocess
import tempfile
import urllib.error
import urllib.request

FLAGS = [
    "--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking",
    "--disable-component-update", "--disable-sync", "--hide-scrollbars",
]


class Browser:
    def __init__(self):
        self.profile = tempfile.mkdtemp(prefix="twobounce-web-")
        self.driver = subprocess.Popen(["chromedriver", "--port=0"], stdout=subprocess.PIPE, text=True)
        try:
            self.url = self._address()
            options = {"args": FLAGS + [f"--user-data-dir={self.profile}"]}
            wanted = {"browserName": "chrome", "goog:chromeOptions": options, "goog:loggingPrefs": {"browser": "ALL"}}
            self.url += "/session/" + self._post("/session", {"capabilities": {"alwaysMatch": wanted}})["sessionId"]
        except BaseException:
            self._stop()
            raise

    def __enter__(self):
        return self

    def __exit__(self, *_):
        try:
            self._request("DELETE", "", None)
        finally:
            self._stop()

    def _stop(self):
        self.driver.terminate()
        self.driver.wait()
        shutil.rmtree(self.profile, ignore_errors=True)

    def _address(self):
        for line in self.driver.stdout:
            if "started successfully on port" in line:
                return "http://127.0.0.1:" + line.rstrip(".\n").split()[-1]
        raise RuntimeError("chromedriver did not start")

    def _request(self, method, path, body):
        data = None if body is None else json.dumps(body).encode()
        request = urllib.request.Request(self.url + path, data, {"Content-Type": "application/json"}, method=method)
        # No proxy, because the driver runs on this machine.
        opener = urllib.request.build_opener(urllib.request.ProxyHandler({}))
        try:
            with opener.open(request, timeout=60) as answer:
                return json.load(answer)["value"]
        except urllib.error.HTTPError as error:
            raise RuntimeError(f"{path}: {json.load(error)['value']['message']}") from None

    def _post(self, path, body):
        return self._request("POST", path, body)

    def open(self, path):
        self._post("/url", {"url": path.resolve().as_uri()})

    def run(self, script, *arguments):
        """The return value of a function with this body."""
        return self._post("/execute/sync", {"script": script, "args": list(arguments)})

    def _act(self, source):
        self._post("/actions", {"actions": [source]})
        self._request("DELETE", "/actions", None)

    def click(self, x, y, pointer="mouse"):
        """Clicks at a place in the viewport, in CSS pixels."""
        self.drag([(x, y)], pointer)

    def drag(self, places, pointer="mouse"):
        moves = [{"type": "pointerMove", "duration": 0, "x": round(x), "y": round(y)} for x, y in places]
        down, up = {"type": "pointerDown", "button": 0}, {"type": "pointerUp", "button": 0}
        actions = [moves[0], down, *moves[1:], up]
        self._act({"type": "pointer", "id": pointer, "parameters": {"pointerType": pointer}, "actions": actions})

    def move(self, x, y):
        actions = [{"type": "pointerMove", "duration": 0, "x": round(x), "y": round(y)}]
        self._act({"type": "pointer", "id": "mouse", "parameters": {"pointerType": "mouse"}, "actions": actions})

    def press(self, key):
        self._act({"type": "key", "id": "keys", "actions": [{"type": t, "value": key} for t in ("keyDown", "keyUp")]})

    def console(self):
        """Everything that the console shows since the last call."""
        return [f"{e['level']}: {e['message']}" for e in self._post("/se/log", {"type": "browser"})]

    def devtools(self, command, **parameters):
        self._post("/goog/cdp/execute", {"cmd": command, "params": parameters})

    def look(self, width, height, scheme):
        """Sets the viewport in CSS pixels, and the colour scheme: light or dark."""
        size = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": width < 600}
        self.devtools("Emulation.setDeviceMetricsOverride", **size)
        self.devtools("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": scheme}])

    def screenshot(self, path):
        """Saves the viewport as a PNG."""
        path.write_bytes(base64.b64decode(self._request("GET", "/screenshot", None)))


def nothing_is_wider_than(browser, width):
    wide = browser.run("return document.scrollingElement.scrollWidth")
    assert wide <= width, f"the page is {wide} pixels wide on a screen of {width}"


def quiet(browser, when):
    messages = browser.console()
    assert not messages, f"the console says, {when}: {messages}"
    resources = browser.run("return performance.getEntriesByType('resource').map((r) => r.name).filter((n) => !n.startsWith('data:'))")
    assert not resources, f"the page loads {resources}"
