"""Operates the page of `slipstick ui` in Chromium as a user would, and writes screenshots.

python docs/measure/ui/browser.py PROGRAM FOLDER    PROGRAM is slipstick; the pictures go to FOLDER

Needs Chromium and nothing but Python. Every step fails if the page does not show what it should within a minute,
or if the browser's console reports an error.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from chromium import Browser, page


def main(program: str, pictures: Path) -> None:
    """Operates the page from a mistake in a case to the report of its run."""
    program = str(Path(program).resolve())
    pictures.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as name:
        folder = Path(name)
        subprocess.run([program, "new", "half-ball", "-q"], cwd=folder, check=True)
        case = folder / "half_ball.toml"
        with page(program, folder, case.name) as (browser, url):
            operate(browser, url, program, case, pictures)


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
    pick_faces(browser, pictures)
    fill_a_form(browser, text, type_text, pictures)
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
    choose_on_curves(browser, pictures)
    export_and_compare(browser, case.parent, pictures)
    # a run that fails shows its error
    press("solve")
    browser.until(
        "element('failure').textContent.includes('already contains the results of a run')"
    )
    browser.picture(pictures / "8_refused_800.png")
    # of two quick choices, the later one is shown under its name, though its answer is the earlier one
    second = case.with_name("second.toml")
    second.write_text(f"# second\n{text}", encoding="utf-8", newline="\r\n")
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
    # its lines still end as they did when it is saved
    type_text(f"# third\n{text}")
    browser.until("changed()")
    browser.key("s", "KeyS", modifiers=2)
    browser.until("element('save').disabled")
    assert second.read_bytes() == f"# third\n{text}".replace("\n", "\r\n").encode()
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


def pick_faces(browser: Browser, pictures: Path) -> None:
    """With the mouse and with the keyboard: a face with a name, a face without one, several, and none."""
    view = "model?case=half_ball.toml"
    told = "element('pick-count').textContent"
    browser.value("element('frame').scrollIntoView({ block: 'center' })")
    browser.inside(view, "document.querySelector('.picking input[type=checkbox]').click()")
    box = browser.value("(({ x, y }) => [x, y])(element('frame').getBoundingClientRect())")

    def at(x: float, y: float, shift: bool = False) -> None:
        """Clicks at a fraction of the canvas."""
        script = "(r => [r.x + r.width * {}, r.y + r.height * {}])(element('canvas').getBoundingClientRect())"
        place = browser.inside(view, script.format(x, y))
        browser.click(box[0] + place[0], box[1] + place[1], shift)

    at(0.5, 0.5)
    browser.until(f"{told}.includes('area')")
    first = browser.value(told)
    browser.picture(pictures / "2a_picked_1400.png")
    # a contact pair needs faces of two bodies
    use = "element('pick-use').value = '{}'; element('pick-use').dispatchEvent(new Event('change'))"
    browser.value(f"{{ {use.format('contact')} }}")
    browser.until(f"{told}.includes('faces of two bodies')")
    browser.value(f"{{ {use.format('')} }}")
    browser.until(f"{told} === {json.dumps(first)}")
    # Shift adds another face, and removes it again
    at(0.5, 0.72, shift=True)
    browser.until(f"{told}.includes('area') && {told} !== {json.dumps(first)}")
    browser.picture(pictures / "2b_two_picked_1400.png")
    at(0.5, 0.72, shift=True)
    browser.until(f"{told} === {json.dumps(first)}")
    # nothing is left after a click beside the model; Enter picks at the cross
    at(0.02, 0.02)
    browser.until("element('pick').hidden")
    browser.inside(view, "element('canvas').focus()")
    browser.value("element('frame').focus()")
    browser.key("Enter")
    browser.until(f"{told} === {json.dumps(first)}")
    # with a small angle, only a part of the curved face is picked, which has no name
    browser.inside(
        view,
        "(e => { e.value = 3; e.dispatchEvent(new Event('input')); })"
        "(document.querySelector('.picking input[type=range]'))",
    )
    at(0.5, 0.5)
    browser.until(f"{told} !== {json.dumps(first)} && !{told}.includes('looking')")
    browser.picture(pictures / "2c_small_angle_1400.png")
    at(0.5, 0.72, shift=True)
    browser.until(f"{told}.includes('area') || element('pick-count').className === 'error'")
    browser.value("element('pick-use').value = 'pressure'")
    browser.value("element('pick-use').dispatchEvent(new Event('change'))")
    time.sleep(1.0)
    browser.until("!element('pick-write').disabled || element('pick-count').className === 'error'")
    if browser.value("element('pick-count').className") != "error":
        before = browser.value("source.value")
        # what is typed while the tables are tried is kept, and the tables are not written
        browser.value("""{
          const fetched = window.fetch;
          window.fetch = async (path, ...given) => {
            const answer = await fetched(path, ...given);
            if (path.includes('sure=true')) { window.fetch = fetched; source.value += '# typed'; }
            return answer;
          };
        }""")
        browser.value("element('pick-write').focus()")
        browser.key("Enter")
        browser.until("element('failure').textContent.includes('changed meanwhile')")
        assert browser.value("source.value") == f"{before}# typed"
        browser.value(f"source.value = {json.dumps(before)}")
        browser.value("element('pick-use').dispatchEvent(new Event('change'))")
        browser.until("!element('pick-write').disabled")
        browser.value("element('pick-write').focus()")
        browser.key("Enter")
        browser.until("changed() && source.value.includes('pressure = 1')")
        browser.until(
            "['0 errors', 'The text is a valid'].some(w => element('verdict').textContent.startsWith(w))"
        )
        browser.picture(pictures / "2d_written_1400.png")
        # Ctrl-Z takes it back
        browser.value("source.focus()")
        browser.key("z", "KeyZ", modifiers=2)
        browser.until(f"source.value === {json.dumps(before)}")


def fill_a_form(
    browser: Browser, text: str, type_text: Callable[[str], None], pictures: Path
) -> None:
    """A field changes its value in the text; a wrong one has the program's message beside it."""
    field = "element('field-contact[0].friction')"
    browser.value("element('form-switch').focus()")
    browser.key("Enter")
    browser.until("element('form-of').options.length > 3")
    browser.value("element('form-of').value = 'contact[0]'")
    browser.value("element('form-of').dispatchEvent(new Event('change'))")
    browser.until(f"{field} !== null")
    before = browser.value(f"{field}.value")

    def fill(value: str) -> None:
        browser.value(f"{field}.focus(), {field}.select()")
        browser.send("Input.insertText", text=value)
        browser.key("Enter")

    fill("-0.5")
    browser.until(f"{field}.getAttribute('aria-invalid') === 'true'")
    browser.picture(pictures / "3a_form_1400.png")
    fill(before)
    browser.until(f"!{field}.hasAttribute('aria-invalid')")
    browser.until(f"source.value === {json.dumps(text)}")
    browser.size(800, 1000)
    browser.picture(pictures / "3b_form_800.png")
    browser.size(1400, 900)
    # what is being typed stays when the fields are made anew
    browser.value(f"{field}.focus(), {field}.select()")
    browser.send("Input.insertText", text="0.7")
    browser.value("{ form(); 1 }")
    time.sleep(1.0)
    assert browser.value(f"{field}.value === '0.7' && document.activeElement === {field}")
    browser.key("Enter")
    browser.until("source.value.includes('friction = 0.7')")
    fill(before)
    browser.until(f"source.value === {json.dumps(text)}")
    # a key is removed from the text, with the keyboard
    browser.value("element('remove-contact[0].friction').focus()")
    browser.key("Enter")
    browser.until("!source.value.includes('friction = ')")
    browser.until("document.activeElement.id === 'add-contact[0]'")
    assert browser.value("element('remove-contact[0].slave')") is None, "the pair needs it"
    type_text(text)
    browser.until(f"{field} !== null && !changed()")
    # a list over several lines keeps them
    rows = "min = [\n  -1.5,\n  -1.0, -1.5]"
    type_text(text.replace("min = [-1.5, -1.0, -1.5]", rows))
    box = "element('field-body[0].box.min')"
    browser.value("element('form-of').value = 'body[0]'")
    browser.value("element('form-of').dispatchEvent(new Event('change'))")
    browser.until(f"{box} && {box}.tagName === 'TEXTAREA'")
    browser.value(f"{box}.focus(), {box}.select()")
    browser.send("Input.insertText", text=rows[6:].replace("-1.0", "-1.25"))
    browser.value("element('form-of').focus()")
    browser.until(f"source.value.includes({json.dumps(rows.replace('-1.0', '-1.25'))})")
    type_text(text)
    browser.until("!changed()")
    # a new table has the keys that it needs
    browser.value("element('form-add').value = '[[contact]]'")
    browser.value("element('form-add').dispatchEvent(new Event('change'))")
    browser.until("document.activeElement.id === 'field-contact[1].master'")
    browser.send("Input.insertText", text="plate_ymin")
    browser.key("Enter")
    browser.until("""source.value.endsWith('[[contact]]\\nmaster = "plate_ymin"\\n')""")
    browser.until("element('form-messages').textContent.includes('slave')")
    browser.picture(pictures / "3c_new_table_1400.png")
    type_text(text)
    browser.until("!changed()")
    browser.value("element('form-switch').click()")
    assert browser.value("element('form').hidden")


def choose_on_curves(browser: Browser, pictures: Path) -> None:
    """A point of a curve, with the mouse and with the keyboard, shows its state in the view."""
    browser.size(1400, 900)
    status = "element('status').textContent"
    place = browser.value("""(() => {
      const dots = document.querySelectorAll('#charts figure')[0].querySelectorAll('circle');
      dots[0].scrollIntoView({ block: 'center' });
      const box = dots[0].getBoundingClientRect();
      return [box.x + box.width / 2, box.y + box.height / 2];
    })()""")
    browser.click(*place)
    browser.until(f"{status}.includes('iteration') && {status}.includes('shown')")
    assert "iteration 0 is shown" in browser.value(status), browser.value(status)
    browser.inside("report?run=half_ball&", "document.querySelector('#controls select').value")
    browser.value("element('frame').scrollIntoView()")
    browser.picture(pictures / "7a_iteration_1400.png")
    browser.value("[...document.querySelectorAll('#charts svg[tabindex]')].at(-1).focus()")
    for key in ("ArrowLeft", "ArrowLeft", "Enter"):
        browser.key(key)
    browser.until(f"{status} === 'load step 3 is shown'")
    browser.picture(pictures / "7b_step_1400.png")


def export_and_compare(browser: Browser, folder: Path, pictures: Path) -> None:
    """Each export is the command that is shown; two runs are compared."""
    for kind, name in (
        ("vtu", "half_ball.vtu"),
        ("step", "half_ball.step"),
        ("deck", "half_ball_deck"),
    ):
        browser.value(f"element('kind').value = '{kind}'")
        browser.value("document.querySelector('[data-command=export]').focus()")
        browser.key("Enter")
        browser.until(
            f"element('line').textContent === 'slipstick export half_ball --{kind} {name}'"
        )
        browser.until("element('status').textContent === 'export: done'")
        assert (folder / name).exists()
    browser.value("element('other').value = 'half_ball_solve'")
    browser.value("element('other').dispatchEvent(new Event('change'))")
    browser.until(
        "!element('comparison').hidden && element('comparison').textContent.includes('half_ball_solve')"
    )
    for run in ("half_ball&", "half_ball_solve&"):
        browser.inside(f"report?run={run}", "document.documentElement.dataset.ready")
    browser.value("element('picture').scrollIntoView()")
    browser.picture(pictures / "9_compared_1400.png")
    browser.size(800, 1000)
    browser.value("element('second').scrollIntoView({ block: 'center' })")
    browser.picture(pictures / "9_compared_800.png")
    browser.value("element('other').value = ''")
    browser.value("element('other').dispatchEvent(new Event('change'))")
    browser.until("element('second').hidden")


if __name__ == "__main__":
    if len(sys.argv) != 3:
        raise SystemExit(__doc__)
    main(sys.argv[1], Path(sys.argv[2]))
