# SPDX-License-Identifier: Apache-2.0
"""A headless Chromium told what to do over the DevTools protocol, through a pair of pipes: the standard library is enough."""
import base64
import json
import os
import pathlib
import select
import shutil
import subprocess
import tempfile
import time

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
FLAGS = ["--headless=new", "--no-sandbox", "--hide-scrollbars", "--disable-extensions", "--disable-background-networking", "--no-first-run",
         "--disable-component-update", "--disable-sync", "--remote-debugging-pipe", "--force-color-profile=srgb"]
SOFTWARE_GL = ["--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
NO_GL = ["--disable-gpu", "--disable-3d-apis"]


def program():
    """The browser's path, or None where there is none."""
    return next(filter(None, map(shutil.which, NAMES)), None)


class Failed(Exception):
    pass


class Chromium:
    def __init__(self, webgl=True):
        self.profile = tempfile.TemporaryDirectory(prefix="polygmap_report_", ignore_cleanup_errors=True)
        command_read, self.write_fd = os.pipe()
        self.read_fd, answer_write = os.pipe()
        # The browser reads commands on its 3 and answers on its 4.
        script = f'exec "$0" "$@" 3<&{command_read} 4>&{answer_write}'
        words = [program(), *FLAGS, *(SOFTWARE_GL if webgl else NO_GL), f"--user-data-dir={self.profile.name}", "about:blank"]
        self.process = subprocess.Popen(["/bin/bash", "-c", script, *words], pass_fds=(command_read, answer_write), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        os.close(command_read)
        os.close(answer_write)
        self.received, self.number, self.answers, self.events = b"", 0, {}, []

    def __enter__(self):
        return self

    def __exit__(self, *_):
        try:
            self.call("Browser.close", timeout_s=5)
            self.process.wait(5)
        except (Failed, OSError, subprocess.TimeoutExpired):
            self.process.kill()
            self.process.wait()
        os.close(self.write_fd)
        os.close(self.read_fd)
        self.profile.cleanup()

    def call(self, method, session=None, timeout_s=60, **parameters):
        self.number += 1
        message = {"id": self.number, "method": method, "params": parameters} | ({"sessionId": session} if session else {})
        os.write(self.write_fd, json.dumps(message).encode() + b"\0")
        until = time.monotonic() + timeout_s
        while self.number not in self.answers:
            self.receive(until - time.monotonic(), method)
        answer = self.answers.pop(self.number)
        if "error" in answer:
            raise Failed(f"{method}: {answer['error']['message']}")
        return answer["result"]

    def receive(self, timeout_s, waiting_for):
        if timeout_s <= 0 or not select.select([self.read_fd], [], [], timeout_s)[0]:
            raise Failed(f"the browser did not answer {waiting_for} in time")
        part = os.read(self.read_fd, 1 << 16)
        if not part:
            raise Failed(f"the browser ended while it was to answer {waiting_for}")
        self.received += part
        while b"\0" in self.received:
            text, self.received = self.received.split(b"\0", 1)
            message = json.loads(text)
            if "id" in message:
                self.answers[message["id"]] = message
            else:
                self.events.append(message)

    def cpu_s(self):
        """User and system time of the browser and all processes that it started, by now."""
        children, ticks = {}, {}
        for folder in pathlib.Path("/proc").glob("[0-9]*"):
            try:
                fields = (folder / "stat").read_text().rsplit(")", 1)[1].split()
            except OSError:
                continue
            children.setdefault(int(fields[1]), []).append(int(folder.name))
            ticks[int(folder.name)] = sum(map(int, fields[11:15]))
        total, open_list = 0, [self.process.pid]
        while open_list:
            pid = open_list.pop()
            total += ticks.get(pid, 0)
            open_list += children.get(pid, [])
        return total / os.sysconf("SC_CLK_TCK")

    def open(self, path, fragment="", width=1280, height=720, dark=False, mobile=False):
        return Page(self, path, fragment, width, height, dark, mobile)


class Page:
    """A page in a tab of its own; what it and the browser complained of is in complaints()."""

    def __init__(self, browser, path, fragment, width, height, dark, mobile):
        self.browser = browser
        target = browser.call("Target.createTarget", url="about:blank")["targetId"]
        self.target = target
        self.session = browser.call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Log", "Performance"):
            self.call(f"{domain}.enable")
        self.call("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=2 if mobile else 1, mobile=mobile)
        self.call("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": "dark" if dark else "light"}])
        # Whatever the page asks the network for is a fault of a page that is to be whole by itself.
        self.call("Network.enable")
        before_s, started = browser.cpu_s(), time.monotonic()
        self.call("Page.navigate", url=pathlib.Path(path).resolve().as_uri() + fragment)
        self.wait("document.documentElement?.dataset?.ready === 'yes' || !!document.querySelector('#page > header:only-child')")
        # Two pictures of the screen later the first frame has been shown.
        self.run("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => done(true))))")
        self.first_frame_cpu_s, self.first_frame_s = browser.cpu_s() - before_s, time.monotonic() - started

    def call(self, method, **parameters):
        return self.browser.call(method, session=self.session, **parameters)

    def run(self, expression):
        """The value of an expression in the page; a promise's when it is kept."""
        done = self.call("Runtime.evaluate", expression=expression, awaitPromise=True, returnByValue=True)
        if "exceptionDetails" in done:
            details = done["exceptionDetails"]
            raise Failed(f"{expression[:80]}: {details.get('exception', {}).get('description', details['text'])}")
        return done["result"].get("value")

    def wait(self, condition, timeout_s=60):
        until = time.monotonic() + timeout_s
        while not self.run(condition):
            if time.monotonic() > until:
                raise Failed(f"the page never came to: {condition}; it complains of {self.complaints()}")
            time.sleep(0.02)

    def complaints(self):
        """Errors and warnings in the console, exceptions that nobody caught, and addresses asked for."""
        self.run("1")  # what has been said so far has arrived then
        out = []
        for event in self.browser.events:
            if event.get("sessionId") != self.session:
                continue
            method, p = event["method"], event["params"]
            if method == "Runtime.consoleAPICalled" and p["type"] in ("error", "warning", "assert"):
                out.append(" ".join(str(a.get("value", a.get("description", ""))) for a in p["args"]))
            elif method == "Runtime.exceptionThrown":
                out.append(p["exceptionDetails"].get("exception", {}).get("description", p["exceptionDetails"]["text"]))
            elif method == "Log.entryAdded" and p["entry"]["level"] in ("error", "warning"):
                out.append(p["entry"]["text"])
            elif method == "Network.requestWillBeSent" and p["request"]["url"].split(":")[0] in ("http", "https", "ws", "wss"):
                out.append(f"it asked for {p['request']['url']}")
        return out

    def key(self, key, shift=False):
        codes = {" ": 32, "ArrowLeft": 37, "ArrowRight": 39, "Home": 36, "End": 35}
        parameters = {"key": key, "windowsVirtualKeyCode": codes.get(key, ord(key[0])), "modifiers": 8 if shift else 0}
        self.call("Input.dispatchKeyEvent", type="keyDown", **parameters)
        self.call("Input.dispatchKeyEvent", type="keyUp", **parameters)

    def picture(self, path, whole=False):
        if whole:
            size = self.call("Page.getLayoutMetrics")["cssContentSize"]
            shot = self.call("Page.captureScreenshot", format="png", captureBeyondViewport=True, clip={"x": 0, "y": 0, "width": size["width"], "height": size["height"], "scale": 1})
        else:
            shot = self.call("Page.captureScreenshot", format="png")
        pathlib.Path(path).write_bytes(base64.b64decode(shot["data"]))

    def close(self):
        self.browser.call("Target.closeTarget", targetId=self.target)
