"""Runs the notebooks in docs/notebooks and stores them with their outputs.

python crates/python/notebooks.py [NAME …]    all notebooks, or some; needs nbclient and ipykernel

The test of the notebooks compares the stored numbers with those of a run.
"""

from __future__ import annotations

import os
import sys
import tempfile
from pathlib import Path

import nbformat
from nbclient import NotebookClient

FOLDER = Path(__file__).parents[2] / "docs" / "notebooks"
# of a figure, in the order in which a reader prefers them
PICTURES = ("image/gif", "image/png")


def run(path: Path) -> None:
    """Runs one notebook in an empty folder and writes it back."""
    notebook = nbformat.read(path, as_version=4)
    with tempfile.TemporaryDirectory() as folder:
        resources = {"metadata": {"path": folder}}
        client = NotebookClient(notebook, timeout=600, kernel_name="python3", resources=resources)
        client.coalesce_streams = True
        client.execute()
    for cell in (cell for cell in notebook.cells if cell.cell_type == "code"):
        # times of execution would differ in every run
        cell.metadata.pop("execution", None)
        # VTK says which display it tried first
        cell.outputs = [
            output
            for output in cell.outputs
            if "bad X server connection" not in output.get("text", "")
        ]
        for output in cell.outputs:
            if output.output_type == "stream" and output.name == "stderr":
                raise SystemExit(f"{path.name} writes to stderr:\n{output.text}")
            data = output.get("data", {})
            pictures = [kind for kind in PICTURES if kind in data]
            # the text beside a picture may name a temporary folder
            for other in [*pictures[1:], *(["text/plain"] if pictures else [])]:
                data.pop(other, None)
    notebook.metadata = {
        "kernelspec": {"display_name": "Python 3", "language": "python", "name": "python3"},
        "language_info": {"name": "python"},
    }
    nbformat.validate(notebook)
    nbformat.write(notebook, path)


if __name__ == "__main__":
    os.environ.setdefault("PYVISTA_OFF_SCREEN", "true")
    names = sys.argv[1:] or sorted(path.stem for path in FOLDER.glob("*.ipynb"))
    for name in names:
        run(FOLDER / f"{name}.ipynb")
        print(name)
