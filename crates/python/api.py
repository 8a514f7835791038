"""Writes the pages in docs/python, the reference of the Python package, from its docstrings.

python crates/python/api.py           writes the pages
python crates/python/api.py --check   fails if the pages are not what it would write
"""

from __future__ import annotations

import inspect
import re
import sys
import textwrap
from pathlib import Path
from typing import Any

import slipstick as ss

FOLDER = Path(__file__).parents[2] / "docs" / "python"

# the names of the package by page and chapter, in the order in which a reader needs them
PAGES = {
    ("cases", "Cases and errors"): {
        "Cases": ["Case", "templates", "Inspection"],
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
    },
    ("problems", "Problems and gradients"): {
        "Problems": ["Problem", "Parameter", "PullBack", "GradientCheck"],
    },
    ("paths_and_meshes", "Load paths and meshes"): {
        "Load paths": ["Path", "Step", "Contact", "Evaluations", "Evaluation"],
        "Meshes": ["Mesh", "Body"],
    },
    ("optimizations", "Optimizations and studies"): {
        "Optimizations": ["Result", "View", "Iteration", "Term", "Bound", "resume", "open_run"],
        "Studies": ["run_study", "Study", "StudyRun"],
    },
    ("own_quantities", "Your own quantities and maps"): {
        "Quantities": ["Quantity", "State", "ContactState", "PreviousState"],
        "Maps": ["DesignMap", "MappedProblem"],
    },
    ("jax_and_torch", "JAX and PyTorch"): {"JAX": ["jax"], "PyTorch": ["torch"]},
}
# classes that users make; the package makes the others
MADE = ("ss.Mesh", "ss.Term", "ss.Bound")
# what the chapter on Python says once for all functions
SHARED = (
    "`density` (shape (elements,)): Densities in [0, 1]; by default",
    "`x` (shape (variables,)): The variables; by default",
    "`progress` (bool)",
    "`overwrite` (bool)",
    "`height` (int): Height in the notebook",
    "`names` (str or sequence of str): Quantities",
    "`problem` (Problem or MappedProblem)",
    "`AnalysisError`: If a load step does not converge.",
    "`KeyboardInterrupt`: After Ctrl-C",
    "`pathlib.Path`: The",
    "`CaseError`",
    "`InputError`",
    "`OSError`",
    "`FileNotFoundError`",
    "`FileExistsError`",
    "`TypeError`",
    "`ValueError",
)
# methods that a page describes for another class: those of a mapped problem are those of a problem
SAME = {
    "MappedProblem": (
        "with_parameters",
        "volume_fraction",
        "solve",
        "evaluate",
        "value_and_gradient",
        "vjp",
        "quantities",
        "steps",
        "parameters",
    )
}
# the pages show the examples of these classes; `help` shows all
SHOWN = ("DesignMap",)
# lines with which examples begin
IMPORTS = (">>> import slipstick as ss\n", ">>> import numpy as np\n")

HEAD = """\
# {title}

<!-- crates/python/api.py writes this page from the docstrings -->

See [what many functions share](../python.md#the-reference).
"""


def main() -> int:
    """Write or check the pages; returns the exit code."""
    written = {
        FOLDER / f"{name}.md": page(title, chapters) for (name, title), chapters in PAGES.items()
    }
    if sys.argv[1:] == ["--check"]:
        current = {path: path.read_text(encoding="utf-8") for path in FOLDER.glob("*.md")}
        if current != written:
            print(f"{FOLDER} is not up to date: run python crates/python/api.py", file=sys.stderr)
        return int(current != written)
    FOLDER.mkdir(exist_ok=True)
    for path, text in written.items():
        path.write_text(text, encoding="utf-8")
    return 0


def page(title: str, chapters: dict[str, list[str]]) -> str:
    """The text of a page."""
    parts = [HEAD.format(title=title)]
    for chapter, names in chapters.items():
        parts.append(f"## {chapter}\n")
        for name in names:
            thing = getattr(ss, name)
            if not inspect.ismodule(thing):
                parts += described(f"ss.{name}", thing)
                continue
            parts.append(markdown(inspect.getdoc(thing) or ""))
            for inner in thing.__all__:
                parts += described(f"ss.{name}.{inner}", getattr(thing, inner))
    return "\n".join(parts).rstrip() + "\n"


def described(name: str, thing: Any) -> list[str]:
    """The entry of a class or a function; properties of a class are a list before its methods."""
    if not inspect.isclass(thing):
        return entry(name, thing)
    about = inspect.getdoc(thing) or ""
    short = name.split(".")[-1]
    properties: list[str] = []
    methods: list[str] = []
    for key, member in vars(thing).items():
        hidden = key.startswith("_") and key != "__call__"
        if hidden or key in SAME.get(short, ()):
            continue
        plain = member.__func__ if isinstance(member, (classmethod, staticmethod)) else member
        if isinstance(member, property) or type(member).__name__ == "cached_property":
            doc = inspect.getdoc(member)
            if doc and f"\n{key} : " not in about:
                properties.append(item(f"`{key}`", doc))
        elif inspect.isfunction(plain):
            of_class = isinstance(member, (classmethod, staticmethod))
            owner = name if of_class else variable(short)
            call = owner if key == "__call__" else f"{owner}.{key}"
            methods += entry(call, plain, "####")
    first = heading(name, thing) if name in MADE else f"### `{name}`\n"
    return [first, markdown(about, properties, short in SHOWN), *methods]


def entry(name: str, thing: Any, level: str = "###") -> list[str]:
    """A function: its heading, with the type that it returns if nothing else is said, and text."""
    doc = inspect.getdoc(thing) or ""
    bare = re.search(r"^Returns\n-{3,}\n([^\n:]+)\n(?=\n|\Z)", doc + "\n", re.MULTILINE)
    if bare:
        doc = (doc + "\n").replace(bare[0], "").strip()
    return [heading(name, thing, level, bare[1] if bare else ""), markdown(doc)]


def variable(name: str) -> str:
    """A name for an instance: pull_back for PullBack."""
    return re.sub(r"(?<=[a-z])(?=[A-Z])", "_", name).lower()


def heading(name: str, thing: Any, level: str = "###", returns: str = "") -> str:
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
    arrow = f" -> {returns}" if returns else ""
    return f"{level} `{name}({', '.join(parameters)}){arrow}`\n"


def markdown(doc: str, properties: list[str] | None = None, show: bool = False) -> str:
    """A docstring in numpy's style as Markdown: text, one list with the properties, examples."""
    out: list[str] = []
    items: list[str] = []
    shown: list[str] = []
    sections = re.split(r"^(\w[\w ]*)\n-{3,}\n", doc, flags=re.MULTILINE)
    out.append(prose(sections[0]))
    for title, body in zip(sections[1::2], sections[2::2], strict=True):
        if title == "Examples":
            shown += [examples(body)] if show else []
        else:
            what = {"Returns": "returns ", "Raises": "raises ", "Warns": "warns "}.get(title, "")
            items += entries(body, what)
    items += properties or []
    if items:
        out.append("\n".join(items) + "\n")
    return "\n".join(part for part in out + shown if part.strip())


def prose(text: str) -> str:
    """Paragraphs and tables; roles and literals of reStructuredText replaced, literals whole."""
    text = re.sub(r":\w+:`~?(?:slipstick\.)?([^`]*)`", r"`\1`", text.strip())
    text = re.sub(r"``([^`]*)``", r"`\1`", text)
    paragraphs = []
    for paragraph in re.split(r"\n\s*\n", text):
        if paragraph.startswith(">>>"):
            paragraphs.append(f"```python\n{paragraph}\n```")
        elif paragraph.startswith("|"):
            paragraphs.append(paragraph)
        else:
            words = paragraph.split()
            paragraphs.append(textwrap.fill(" ".join(words), 100, break_on_hyphens=False))
    return "\n\n".join(paragraphs) + "\n" if text else ""


def entries(body: str, what: str) -> list[str]:
    """`name : type` with an indented text below, as items of a list; each begins with `what`."""
    lines = []
    for name, text in re.findall(r"^(\S.*)\n?((?:[ \t]+.*\n?|\n(?=[ \t]))*)", body, re.MULTILINE):
        label, _, kind = name.partition(" : ")
        first = f"`{label}`" if label else ""
        # without a name, as for what a function returns, the line is the type
        # arrays are arrays of numbers unless the type says otherwise
        kind = re.sub(r"^(ndarray|array_like)( of |, )(?=int|shape)", "", kind)
        # the heading shows defaults
        kind = kind.removesuffix(", optional")
        first += (f" ({kind})" if label else kind) if kind else ""
        if not item(first, textwrap.dedent(text)).removeprefix("* ").startswith(SHARED):
            lines.append(item(what + first, textwrap.dedent(text)))
    return lines


def item(name: str, text: str) -> str:
    """An item of a list."""
    text = " ".join(prose(text).split())
    text = f"* {name}: {text}" if text else f"* {name}"
    return textwrap.fill(text, 100, subsequent_indent="  ", break_on_hyphens=False)


def examples(body: str) -> str:
    """Examples as blocks of a session."""
    parts = []
    for block in re.split(r"\n\s*\n", body.strip()):
        for line in IMPORTS:
            block = block.replace(line, "")
        parts.append(
            f"```python\n{block}\n```" if block.startswith(">>>") else prose(block).strip()
        )
    return "\n\n".join(parts) + "\n"


if __name__ == "__main__":
    sys.exit(main())
