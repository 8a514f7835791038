"""Chromium, driven through its debugging pipe. Needs nothing but Python."""

from __future__ import annotations

import base64
import json
import os
import shutil
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

BROWSERS = ("chromium", "chromium-browser", "google-chrome")
OPTIONS = (
    "--headless",
    "--no-sandbox",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--hide-scrollbars",
    "--remote-debugging-pipe",
)


class Browser:
    """A page of Chromium, driven through its debugging pipe."""

    def __init__(self, profile: Path) -> None:
        name = next((name for name in BROWSERS if shutil.which(name)), None)
        if name is None:
            raise SystemExit(f"none of {BROWSERS} is installed")
        # the browser reads from descriptor 3 and writes to 4
        to_read, self.out = os.pipe()
        self.into, to_write = os.pipe()
        command = f'exec 3<&{to_read} 4>&{to_write}; exec "$@"'
        line = ["bash", "-c", command, "bash", name, *OPTIONS, f"--user-data-dir={profile}"]
        self.process = subprocess.Popen(
            [*line, "about:blank"], pass_fds=(to_read, to_write), stderr=subprocess.DEVNULL
        )
        os.close(to_read)
        os.close(to_write)
        self.count, self.rest, self.faults = 0, b"", []
        self.frames: dict[str, str] = {}
        self.session: str | None = None
        pages = self.send("Target.getTargets")["targetInfos"]
        page = next(page for page in pages if page["type"] == "page")["targetId"]
        attached = self.send("Target.attachToTarget", targetId=page, flatten=True)
        self.session = attached["sessionId"]
        for domain in ("Page", "Runtime", "Log"):
            self.send(f"{domain}.enable")
        # the views have an origin of their own, and a process of their own
        self.send(
            "Target.setAutoAttach", autoAttach=True, waitForDebuggerOnStart=False, flatten=True
        )

    def send(self, method: str, session: str | None = None, **values: Any) -> Any:
        self.count += 1
        message = {"id": self.count, "method": method, "params": values}
        if session or self.session:
            message["sessionId"] = session or self.session
        os.write(self.out, json.dumps(message).encode() + b"\0")
        while True:
            answer = self.next()
            if answer.get("id") == self.count:
                if "navigated" in json.dumps(answer.get("error")):
                    # asked while the page was being loaded again
                    return {"result": {}}
                if "error" in answer:
                    raise SystemExit(f"{method}: {answer['error']}")
                return answer["result"]

    def next(self) -> Any:
        while b"\0" not in self.rest:
            part = os.read(self.into, 1 << 20)
            if not part:
                raise SystemExit("the browser has ended")
            self.rest += part
        one, self.rest = self.rest.split(b"\0", 1)
        message = json.loads(one)
        method, values = message.get("method"), message.get("params", {})
        if method == "Runtime.exceptionThrown":
            self.faults.append(values["exceptionDetails"])
        elif method == "Log.entryAdded" and values["entry"]["level"] == "error":
            self.faults.append(values["entry"])
        elif method == "Target.attachedToTarget":
            if values["targetInfo"]["type"] == "iframe":
                self.frames[values["sessionId"]] = values["targetInfo"]["targetId"]
        elif method == "Target.detachedFromTarget":
            self.frames.pop(values["sessionId"], None)
        elif method == "Page.javascriptDialogOpening":
            self.count += 1
            accept = {
                "id": self.count,
                "method": "Page.handleJavaScriptDialog",
                "params": {"accept": True},
                "sessionId": self.session,
            }
            os.write(self.out, json.dumps(accept).encode() + b"\0")
        return message

    def value(self, script: str) -> Any:
        result = self.send("Runtime.evaluate", expression=script, returnByValue=True)
        if "exceptionDetails" in result:
            raise SystemExit(f"{script}: {result['exceptionDetails']}")
        return result["result"].get("value")

    def inside(self, part: str, script: str) -> Any:
        """The value of a script in the view whose address contains a text."""
        end = time.monotonic() + 60.0
        while time.monotonic() < end:
            for session in list(self.frames):
                try:
                    at = f"location.href.includes({json.dumps(part)})"
                    both = f"{at} && document.readyState === 'complete' ? [{script}] : null"
                    result = self.send(
                        "Runtime.evaluate", session, expression=both, returnByValue=True
                    )
                except SystemExit:
                    continue  # the view has been replaced
                if "exceptionDetails" in result:
                    raise SystemExit(f"{script}: {result['exceptionDetails']}")
                if result["result"].get("value"):
                    return result["result"]["value"][0]
            time.sleep(0.1)
            self.value("1")
        raise SystemExit(f"no view of {part}: {self.frames}")

    def until_inside(self, part: str, script: str) -> None:
        end = time.monotonic() + 60.0
        while not self.inside(part, script):
            if time.monotonic() > end:
                raise SystemExit(f"in vain in {part}: {script}")
            time.sleep(0.1)

    def click(self, x: float, y: float, shift: bool = False) -> None:
        common = {"x": x, "y": y, "button": "left", "clickCount": 1, "modifiers": 8 * shift}
        self.send("Input.dispatchMouseEvent", type="mousePressed", buttons=1, **common)
        self.send("Input.dispatchMouseEvent", type="mouseReleased", **common)

    def until(self, script: str, seconds: float = 60.0) -> None:
        end = time.monotonic() + seconds
        # a page that is being loaded has no elements yet
        while not self.value(f"(() => {{ try {{ return {script} }} catch {{ return false }} }})()"):
            if time.monotonic() > end:
                state = self.value("document.body.innerText")
                raise SystemExit(f"in vain: {script}\n{state}\n{self.faults}")
            time.sleep(0.1)

    def key(self, key: str, code: str = "", modifiers: int = 0, text: str = "") -> None:
        # Windows' key codes, by which Chromium finds what a key does
        codes = {"Enter": 13, "Tab": 9, "ArrowLeft": 37, "ArrowRight": 39, "ArrowDown": 40}
        codes |= {" ": 32, "s": 83, "z": 90}
        common = {
            "key": key,
            "code": code or key,
            "modifiers": modifiers,
            "windowsVirtualKeyCode": codes.get(key, 0),
        }
        text = text or {"Enter": "\r", " ": " "}.get(key, "")
        kind = "keyDown" if text else "rawKeyDown"
        self.send("Input.dispatchKeyEvent", type=kind, text=text, **common)
        self.send("Input.dispatchKeyEvent", type="keyUp", **common)

    def size(self, width: int, height: int) -> None:
        self.send(
            "Emulation.setDeviceMetricsOverride",
            width=width,
            height=height,
            deviceScaleFactor=1,
            mobile=False,
        )
        time.sleep(0.4)

    def picture(self, file: Path) -> None:
        # without a GPU, the views take a while to be drawn
        time.sleep(3.0)
        shot = self.send("Page.captureScreenshot", format="png", captureBeyondViewport=True)
        file.write_bytes(base64.b64decode(shot["data"]))

    def close(self) -> None:
        self.process.terminate()
        self.process.wait()


@contextmanager
def page(program: str, folder: Path, file: str) -> Iterator[tuple[Browser, str]]:
    """A browser, and the address of the page that `slipstick ui` serves for a file of the folder."""
    server = subprocess.Popen(
        [program, "ui", file, "--no-browser", "--json"], cwd=folder, stdout=subprocess.PIPE, text=True
    )
    assert server.stdout
    url = json.loads(server.stdout.readline())["url"]
    browser = Browser(folder / "profile")
    try:
        yield browser, url
    finally:
        browser.close()
        server.terminate()
        server.wait()
