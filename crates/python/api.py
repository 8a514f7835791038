"""Writes docs/python_api.md, the reference of the Python package, from its docstrings.

python crates/python/api.py           writes the page
python crates/python/api.py --check   fails if the page is not what it would write
"""

from __future__ import annotations

import inspect
import re
import sys
import textwrap
from pathlib import Path
from typing import Any

import slipstick as ss

PAGE = Path(__file__).parents[2] / "docs" / "python_api.md"

# the names of the package, in the order in which a reader needs them
GROUPS = {
    "Cases": ["Case", "templates", "Inspection"],
    "Problems": ["Problem", "Parameter", "PullBack", "GradientCheck"],
    "Load paths": ["Path", "Step", "Contact", "Evaluations", "Evaluation"],
    "Meshes": ["Mesh", "Body"],
    "Optimizations": ["Result", "Iteration", "Term", "Bound", "resume", "open_run"],
    "Studies": ["run_study", "Study", "StudyRun"],
    "Quantities and maps of your own": [
        "Quantity",
        "State",
        "ContactState",
        "PreviousState",
        "DesignMap",
        "MappedProblem",
    ],
    "Threads": ["set_threads", "threads"],
    "Exceptions and warnings": [
        "SlipstickError",
        "CaseError",
        "InputError",
        "AnalysisError",
        "StudyError",
        "InternalError",
        "Diagnostic",
        "SlipstickWarning",
        "CaseWarning",
    ],
}
# classes that users make; the package makes the others
MADE = ("ss.Mesh", "ss.Term", "ss.Bound")
MODULES = {"JAX": "jax", "PyTorch": "torch"}

HEAD = """\
# Python: reference

<!-- written by crates/python/api.py from the docstrings; do not edit -->

Every name of the package `slipstick`, here imported as `ss`. The chapter [Python](python.md) shows
how they work together. Arrays are numpy arrays of 64-bit floats unless said otherwise; units are in
force F and length L.
"""


def main() -> int:
    """Write or check the page; returns the exit code."""
    text = page()
    if sys.argv[1:] == ["--check"]:
        current = PAGE.exists() and PAGE.read_text(encoding="utf-8") == text
        if not current:
            print(f"{PAGE} is not up to date: run python crates/python/api.py", file=sys.stderr)
        return 0 if current else 1
    PAGE.write_text(text, encoding="utf-8")
    return 0


def page() -> str:
    """The text of the page."""
    parts = [HEAD]
    for title, names in GROUPS.items():
        parts.append(f"## {title}\n")
        parts += [part for name in names for part in described(f"ss.{name}", getattr(ss, name))]
    for title, name in MODULES.items():
        module = getattr(ss, name)
        parts.append(f"## {title}\n")
        parts.append(markdown(inspect.getdoc(module) or ""))
        for inner in module.__all__:
            parts += described(f"ss.{name}.{inner}", getattr(module, inner))
    return "\n".join(parts).rstrip() + "\n"


def described(name: str, thing: Any) -> list[str]:
    """The entry of a class or a function."""
    if not inspect.isclass(thing):
        return [heading(name, thing), markdown(inspect.getdoc(thing) or "")]
    parts = [heading(name, thing) if name in MADE else f"### `{name}`\n"]
    parts.append(markdown(inspect.getdoc(thing) or ""))
    short = name.split(".")[-1]
    for key, member in vars(thing).items():
        if key.startswith("_") and key != "__call__":
            continue
        plain = member.__func__ if isinstance(member, (classmethod, staticmethod)) else member
        if isinstance(member, property) or type(member).__name__ == "cached_property":
            doc = inspect.getdoc(member)
            if doc and f"\n{key} : " not in (inspect.getdoc(thing) or ""):
                parts += [f"#### `{variable(short)}.{key}`\n", markdown(doc)]
        elif inspect.isfunction(plain):
            of_class = isinstance(member, (classmethod, staticmethod))
            owner = name if of_class else variable(short)
            call = owner if key == "__call__" else f"{owner}.{key}"
            parts += [heading(call, plain, "####"), markdown(inspect.getdoc(plain) or "")]
    return parts


def variable(name: str) -> str:
    """A name for an instance: pull_back for PullBack."""
    return re.sub(r"(?<=[a-z])(?=[A-Z])", "_", name).lower()


def heading(name: str, thing: Any, level: str = "###") -> str:
    """The name with its parameters; types are in the text."""
    parameters = []
    star = False
    for parameter in inspect.signature(thing).parameters.values():
        if parameter.name in ("self", "cls"):
            continue
        if parameter.kind is parameter.KEYWORD_ONLY and not star:
            parameters.append("*")
            star = True
        default = parameter.default
        given = "" if default is parameter.empty else f"={default!r}"
        parameters.append(parameter.name + given)
    return f"{level} `{name}({', '.join(parameters)})`\n"


def markdown(doc: str) -> str:
    """A docstring in numpy's style as Markdown."""
    out: list[str] = []
    sections = re.split(r"^(\w[\w ]*)\n-{3,}\n", doc, flags=re.MULTILINE)
    out.append(prose(sections[0]))
    for title, body in zip(sections[1::2], sections[2::2], strict=True):
        if title == "Examples":
            out.append(examples(body))
        else:
            out += [f"*{title}*\n", entries(body)]
    return "\n".join(part for part in out if part.strip())


def prose(text: str) -> str:
    """Paragraphs, with the roles and literals of reStructuredText replaced; literals stay whole."""
    text = re.sub(r":\w+:`~?(?:slipstick\.)?([^`]*)`", r"`\1`", text.strip())
    text = re.sub(r"``([^`]*)``", r"`\1`", text)
    paragraphs = []
    for paragraph in re.split(r"\n\s*\n", text):
        if paragraph.startswith(">>>"):
            paragraphs.append(f"```python\n{paragraph}\n```")
        else:
            words = paragraph.split()
            paragraphs.append(textwrap.fill(" ".join(words), 100, break_on_hyphens=False))
    return "\n\n".join(paragraphs) + "\n" if text else ""


def entries(body: str) -> str:
    """`name : type` with an indented text below, as a list."""
    lines = []
    for name, text in re.findall(r"^(\S.*)\n?((?:[ \t]+.*\n?|\n(?=[ \t]))*)", body, re.MULTILINE):
        label, _, kind = name.partition(" : ")
        # without a type, as for what a function returns, the line is the type
        first = f"`{label}`" if label else ""
        first += f" ({kind})" if kind else ""
        text = " ".join(prose(textwrap.dedent(text)).split())
        item = f"* {first}: {text}" if text else f"* {first}"
        lines.append(textwrap.fill(item, 100, subsequent_indent="  ", break_on_hyphens=False))
    return "\n".join(lines) + "\n"


def examples(body: str) -> str:
    """Examples as blocks of a session."""
    parts = []
    for block in re.split(r"\n\s*\n", body.strip()):
        parts.append(
            f"```python\n{block}\n```" if block.startswith(">>>") else prose(block).strip()
        )
    return "\n\n".join(parts) + "\n"


if __name__ == "__main__":
    sys.exit(main())
