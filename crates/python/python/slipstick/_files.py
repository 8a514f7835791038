"""Files that methods write."""

from __future__ import annotations

import os
from pathlib import Path as FilePath


def free(file: str | os.PathLike[str], overwrite: bool, extensions: tuple[str, ...]) -> FilePath:
    """The file to write, if its name has one of the extensions and nothing is lost."""
    path = FilePath(file)
    if path.suffix.lower() not in extensions:
        wanted = ", ".join(extensions)
        raise ValueError(f"file is {os.fspath(file)!r}: give a name that ends in {wanted}")
    if path.exists() and not overwrite:
        raise FileExistsError(f"{path} already exists: name another file, or give overwrite=True")
    return path
