"""Case files from dictionaries, for the scripts below this folder."""

import json


def inline(value):
    """A value in TOML."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{key} = {inline(inner)}" for key, inner in value.items()) + " }"
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(inline(inner) for inner in value) + "]"
    return json.dumps(value) if isinstance(value, str) else repr(value)


def toml(case):
    """A case of tables and lists of tables, as the text of a case file."""
    lines = []
    for table, entries in case.items():
        for entry in entries if isinstance(entries, list) else [entries]:
            lines.append(f"[[{table}]]" if isinstance(entries, list) else f"[{table}]")
            lines += [f"{key} = {inline(value)}" for key, value in entry.items()]
            lines.append("")
    return "\n".join(lines)
