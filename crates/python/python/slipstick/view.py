"""The interactive view of results in notebooks."""

from __future__ import annotations

import html
import os
from pathlib import Path as FilePath

from ._files import free

__all__ = ["View"]


class View:
    """An interactive 3D view, which a notebook shows when it is the last expression of a cell.

    The page needs no server and no network, and is stored with the notebook.

    Attributes
    ----------
    html : str
        The page.
    height : int
        Height in a notebook, in pixels.
    """

    def __init__(self, html: str, height: int) -> None:
        if height < 200:
            raise ValueError(f"height is {height}: give 200 or more pixels")
        self.html = html
        self.height = height

    def save(self, file: str | os.PathLike[str], *, overwrite: bool = False) -> FilePath:
        """Write the view as a web page.

        Parameters
        ----------
        file : path-like
            The page to write, ``*.html``.
        overwrite : bool
            Whether to replace an existing file.

        Returns
        -------
        pathlib.Path
            The page.
        """
        path = free(file, overwrite, (".html", ".htm"))
        path.write_text(self.html, encoding="utf-8")
        return path

    def _repr_html_(self) -> str:
        """A frame with a document of its own, so that several views do not disturb each other."""
        return (
            f'<iframe title="slipstick view" sandbox="allow-scripts" width="100%" '
            f'height="{self.height}" style="border: 0" srcdoc="{html.escape(self.html)}"></iframe>'
        )

    def __repr__(self) -> str:
        return f"<View: {len(self.html) / 1e6:.1f} MB>"
