"""Operates the page of `slipstick ui` in Chromium as a user would, and writes screenshots.

python docs/measure/ui/browser.py PROGRAM FOLDER    PROGRAM is slipstick; the pictures go to FOLDER

Needs Chromium and nothing but Python. Every step fails if the page does not show what it should within a minute,
or if the browser's console reports an error.
"""

from __future__ import annotations

import base64
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
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
        self.session: str | None = None
        pages = self.send("Target.getTargets")["targetInfos"]
        page = next(page for page in pages if page["type"] == "page")["targetId"]
        attached = self.send("Target.attachToTarget", targetId=page, flatten=True)
        self.session = attached["sessionId"]
        for domain in ("Page", "Runtime", "Log"):
            self.send(f"{domain}.enable")

    def send(self, method: str, **values: Any) -> Any:
        self.count += 1
        message = {"id": self.count, "method": method, "params": values}
        if self.session:
            message["sessionId"] = self.session
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
        codes = {"Enter": 13, "Tab": 9, "ArrowRight": 39, "ArrowDown": 40, " ": 32, "s": 83}
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


def main(program: str, pictures: Path) -> None:
    """Operates the page from a mistake in a case to the report of its run."""
    program = str(Path(program).resolve())
    pictures.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as name:
        folder = Path(name)
        subprocess.run([program, "new", "half-ball", "-q"], cwd=folder, check=True)
        case = folder / "half_ball.toml"
        server = subprocess.Popen(
            [program, "ui", "half_ball.toml", "--no-browser", "--json"],
            cwd=folder,
            stdout=subprocess.PIPE,
            text=True,
        )
        assert server.stdout
        url = json.loads(server.stdout.readline())["url"]
        browser = Browser(folder / "profile")
        try:
            operate(browser, url, program, case, pictures)
        finally:
            browser.close()
            server.terminate()
            server.wait()


def operate(browser: Browser, url: str, program: str, case: Path, pictures: Path) -> None:
    text = case.read_text(encoding="utf-8")

    def type_text(now: str) -> None:
        set_text = f"source.focus(); source.value = {json.dumps(now)}"
        browser.value(f"{{ {set_text}; source.dispatchEvent(new Event('input')) }}")

    def press(command: str) -> None:
        """With the keyboard: the button gets the focus, and Enter."""
        browser.until(f"!document.querySelector('[data-command={command}]').disabled")
        browser.value(f"document.querySelector('[data-command={command}]').focus()")
        browser.key("Enter")

    ended = "element('status').textContent"
    browser.size(1400, 900)
    browser.send("Page.navigate", url=url)
    browser.until("document.documentElement.dataset.ready === 'true'")
    browser.until("element('outline').textContent.includes('Contacts')")
    browser.picture(pictures / "1_model_1400.png")
    assert browser.value("version") == 1, "the model is loaded once"
    # the surfaces of the contact pair
    browser.value(
        "[...document.querySelectorAll('#outline button')].find(b => b.textContent.includes(' on ')).click()"
    )
    browser.picture(pictures / "2_contact_1400.png")
    # a mistake is shown at its line, with code and remedy, while one types
    type_text(text.replace("friction = ", "frction = ", 1))
    browser.until("element('diagnostics').textContent.includes('slipstick::case::unknown_key')")
    assert browser.value("element('comments').children.length") == 1
    assert browser.value("document.querySelector('[data-command=solve]').disabled")
    browser.picture(pictures / "3_mistake_1400.png")
    # saved with the button
    type_text(f"# saved\n{text}")
    browser.until("changed() && !element('save').disabled")
    browser.value("element('save').click()")
    browser.until("element('save').disabled")
    assert case.read_text(encoding="utf-8") == f"# saved\n{text}"
    # fewer steps and iterations, saved with Ctrl-S
    shorter = text.replace("steps = 10", "steps = 5").replace("iterations = 40", "iterations = 12")
    type_text(shorter)
    browser.until("element('verdict').textContent.startsWith('0 errors') && changed()")
    browser.key("s", "KeyS", modifiers=2)
    browser.until("element('save').disabled")
    assert case.read_text(encoding="utf-8") == shorter
    press("check")
    browser.until(f"{ended} === 'check: done'")
    assert browser.value("element('log').textContent.includes('supports and motions')")
    press("solve")
    browser.until(f"{ended} === 'solve: done'")
    browser.until("element('frame').dataset.shows.includes('report?run=half_ball_solve')")
    browser.picture(pictures / "4_solved_1400.png")
    press("optimize")
    browser.until("document.querySelectorAll('#charts figure').length > 1")
    # a reload in the middle shows the run again
    browser.send("Page.reload")
    browser.until("document.documentElement.dataset.ready === 'true'")
    browser.until("element('line').textContent.includes('optimize half_ball.toml --out half_ball')")
    browser.until("document.querySelectorAll('#charts figure').length > 1")
    browser.picture(pictures / "5_running_1400.png")
    browser.value("element('stop').focus()")
    browser.key("Enter")
    browser.until(f"{ended}.startsWith('optimize: interrupted')")
    browser.until("element('frame').dataset.shows.includes('report?run=half_ball&')")
    assert browser.value("element('failure').hidden")
    browser.picture(pictures / "6_stopped_1400.png")
    press("resume")
    browser.until(f"{ended} === 'resume: done'")
    browser.size(800, 1000)
    browser.until("element('frame').dataset.shows.includes('report?run=half_ball&')")
    browser.picture(pictures / "7_finished_800.png")
    # a run that fails shows its error
    press("solve")
    browser.until(
        "element('failure').textContent.includes('already contains the results of a run')"
    )
    browser.picture(pictures / "8_refused_800.png")
    # of two quick choices, the later one is shown under its name, though its answer is the earlier one
    second = case.with_name("second.toml")
    second.write_text(f"# second\n{text}", encoding="utf-8")
    browser.value("names()")
    browser.until("[...element('case').options].some(option => option.value === 'second.toml')")
    browser.value("""{
      const fetched = window.fetch;
      window.fetch = async (path, ...given) => {
        if (path.startsWith('case?') && path.includes('half_ball')) await new Promise(done => setTimeout(done, 1500));
        return fetched(path, ...given);
      };
      for (const name of ['half_ball.toml', 'second.toml']) {
        element('case').value = name;
        element('case').dispatchEvent(new Event('change'));
      }
    }""")
    browser.until("element('text-title').textContent === 'second.toml'")
    time.sleep(2.0)
    assert browser.value("source.value.startsWith('# second') && now.case === 'second.toml'")
    # a command whose results another terminal is writing cannot be started
    choose = "{{ element('{0}').value = '{1}'; element('{0}').dispatchEvent(new Event('change')) }}"
    line = [program, "optimize", case.name, "--out", "half_ball", "--force", "-q"]
    other = subprocess.Popen(line, cwd=case.parent)
    try:
        browser.value(choose.format("case", case.name))
        browser.until(f"now.case === '{case.name}' && now.commands.length === 2")
        browser.value(choose.format("run", "half_ball"))
        browser.until(f"{ended} === 'half_ball runs in another terminal; stop it there'")
        assert browser.value("document.querySelector('[data-command=optimize]').disabled")
        assert not browser.value("document.querySelector('[data-command=solve]').disabled")
    finally:
        other.terminate()
        other.wait()
    # everything that can be operated has a name and can be reached with Tab
    unnamed = """[...document.querySelectorAll('button, select, input, textarea, iframe')]
      .filter(e => !(e.textContent || e.title || e.getAttribute('aria-label')
        || (e.labels && e.labels.length))).length"""
    assert browser.value(unnamed) == 0
    assert browser.value("[...document.querySelectorAll('[tabindex]')].every(e => e.tabIndex >= 0)")
    assert browser.value("document.documentElement.scrollWidth <= innerWidth"), (
        "the page is too wide"
    )
    refusals = [fault for fault in browser.faults if "400" not in json.dumps(fault)]
    assert not refusals, refusals
    print(f"pictures in {pictures}")


if __name__ == "__main__":
    if len(sys.argv) != 3:
        raise SystemExit(__doc__)
    main(sys.argv[1], Path(sys.argv[2]))
