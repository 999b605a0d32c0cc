"""The text of a case, edited: comments and order stay."""

import copy
import math
import re
import tomllib
from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import pairwise
from typing import Any

import tomli_w
import tomlkit
from tomlkit.exceptions import TOMLKitError

from ..errors import ParameterError
from . import schema

TOLD = "the case's text"
"""What errors call it."""

VERBS = ("set", "remove", "append", "insert")

MOST = 1000
"""Edits at a time."""

_HEADER = re.compile(r"(\s*\[.*\])\s*(#.*)?")

_MARK = "#@"
"""Before the number of a block of comments, in a text that has none."""


def amended(text: str, edits: Sequence[Any]) -> str:
    """A case's text with some edits, one after the other, validated as a case file is.

    An edit is {"set": path, "to": value}, {"remove": path}, {"append": path, "value": one more} or
    {"insert": path, "value": one that takes this place}; a path is a list of keys and indices.
    Tables on the way that are not there are made.
    """
    if len(edits) > MOST:
        raise ParameterError(f"{len(edits)} edits; at most {MOST} are made at a time")
    schema.parse(text, TOLD)
    wanted = tomllib.loads(text)
    for number, edit in enumerate(edits):
        _edit(wanted, edit, f"edit {number}", copy.deepcopy)
    found = _styled(text, edits, wanted)
    schema.parse(found, TOLD)
    return found


def rewritten(text: str, tables: dict[str, Any]) -> str:
    """A text that says what tables do; where it says that already it stays as it is."""
    try:
        before = tomllib.loads(text)
    except ValueError:
        return tomli_w.dumps(tables)
    return _styled(text, list(_differences(before, tables, [])), tables)


def _differences(old: Any, new: Any, path: list[str | int]) -> Iterator[dict[str, Any]]:
    """Edits that make tables of others."""
    if isinstance(old, dict) and isinstance(new, dict):
        for key in [key for key in old if key not in new]:
            yield {"remove": [*path, key]}
        for key, one in new.items():
            if key not in old:
                yield {"set": [*path, key], "to": one}
            else:
                yield from _differences(old[key], one, [*path, key])
    elif _is_tables(old) and _is_tables(new) and len(old) == len(new):
        for i, (one, other) in enumerate(zip(old, new, strict=True)):
            yield from _differences(one, other, [*path, i])
    elif old != new:
        yield {"set": path, "to": new}


def _styled(text: str, edits: Sequence[Any], wanted: dict[str, Any]) -> str:
    """The edits made in the text as it is written; written anew where that cannot be."""
    if not edits:
        return text
    try:
        masked, blocks = _masked(text)
        document = tomlkit.parse(masked)
        for edit in edits:
            _edit(document, edit, "", _item)
        found = _unmasked(tomlkit.dumps(document), blocks)
        is_right = tomllib.loads(found) == wanted
    except (TOMLKitError, ParameterError, TypeError, ValueError, KeyError, AttributeError):
        is_right = False
    if not is_right:  # tables in an order that the library cannot edit
        return tomli_w.dumps(wanted)
    spaced = _spaced(found, text)
    return spaced if tomllib.loads(spaced) == wanted else found


def _edit(tree: Any, edit: Any, where: str, made: Callable[[Any], Any]) -> None:
    """Make one edit in tables, of which new parts are made by a function."""
    verb, path, value = _read(edit, where)
    told = ".".join(map(str, path))
    here, way = tree, [tree]
    for place, part in enumerate(path[:-1]):
        is_lacking = isinstance(part, str) and isinstance(here, dict) and part not in here
        if is_lacking and verb != "remove" and isinstance(path[place + 1], str):
            here[part] = made({})
        here = _at(here, part, f"{where}: {told}")
        way.append(here)
    last = path[-1]
    if verb == "append" and isinstance(here, dict):
        if last not in here:
            here[last] = made([value])
        else:
            _listed(here[last], f"{where}: {told}").append(made(value))
    elif verb == "insert":
        rows, index = _listed(here, f"{where}: {told}"), last
        if type(index) is not int or not 0 <= index <= len(rows):
            raise ParameterError(f"{where}: {told}: it takes a place from 0 to {len(rows)}")
        rows.insert(index, made(value))
    elif verb == "append":
        _listed(_at(here, last, f"{where}: {told}"), f"{where}: {told}").append(made(value))
    elif verb == "remove":
        _at(here, last, f"{where}: {told}")
        for parent, part in zip(reversed(way), reversed(path), strict=True):
            del parent[part]
            if len(parent):  # a table that holds nothing has no place in the text
                break
    else:
        if isinstance(here, list) or not isinstance(last, str):
            _at(here, last, f"{where}: {told}")
        elif not isinstance(here, dict):
            raise ParameterError(f"{where}: {told}: there is no table to set it in")
        here[last] = made(value)


def _read(edit: Any, where: str) -> tuple[str, list[str | int], Any]:
    """What an edit says."""
    verbs = [verb for verb in VERBS if isinstance(edit, Mapping) and verb in edit]
    if len(verbs) != 1:
        raise ParameterError(f"{where}: one of {', '.join(VERBS)}, got {edit!r:.80}")
    (verb,) = verbs
    path = edit[verb]
    is_path = isinstance(path, list) and path and all(type(part) in (str, int) for part in path)
    if not is_path:
        raise ParameterError(f"{where}: a path is a list of keys and indices, got {path!r:.80}")
    key = {"set": "to", "append": "value", "insert": "value"}.get(verb)
    if key is None:
        return verb, path, None
    if edit.get(key) is None:
        raise ParameterError(f"{where}: {verb} needs {key!r}; to take a key out, remove it")
    _check(edit[key], f"{where}: {'.'.join(map(str, path))}")
    return verb, path, edit[key]


def _check(value: Any, where: str, depth: int = 0) -> None:
    """Refuse what TOML cannot say, and what is no number."""
    if depth > 20:
        raise ParameterError(f"{where}: nested too deep")
    inner = value.items() if isinstance(value, dict) else enumerate(value) if (
        isinstance(value, list)
    ) else ()  # fmt: skip
    for key, one in inner:
        _check(one, f"{where}.{key}", depth + 1)
    if value is None or (isinstance(value, float) and math.isnan(value)):
        raise ParameterError(f"{where}: {value} is no value; leave the key out")


def _at(here: Any, part: str | int, where: str) -> Any:
    """One step of a path."""
    if isinstance(here, dict) and isinstance(part, str):
        if part in here:
            return here[part]
        there = ", ".join(map(str, here)) or "nothing"
        raise ParameterError(f"{where}: {part!r} is not there; there is: {there:.200}")
    if isinstance(here, list) and isinstance(part, int) and 0 <= part < len(here):
        return here[part]
    if isinstance(here, list):
        raise ParameterError(f"{where}: {part!r} is no index of {len(here)}, counted from 0")
    raise ParameterError(f"{where}: {part!r} is no key of it")


def _listed(rows: Any, where: str) -> Any:
    if not isinstance(rows, list):
        raise ParameterError(f"{where}: is no list")
    return rows


def _item(value: Any) -> Any:
    """A value as a person writes it: tables of tables with headers, small ones in a line."""
    if isinstance(value, dict):
        table = tomlkit.table()
        plain = {k: v for k, v in value.items() if not _has_header(v)}
        for key, one in plain.items():
            table.add(key, _inline(one))
        for key, one in value.items():
            if key not in plain:
                table.add(key, _item(one))
        return table
    if _is_tables(value):
        rows = tomlkit.aot()
        for row in value:
            rows.append(_item(row))
        return rows
    return _inline(value)


def _inline(value: Any) -> Any:
    if not isinstance(value, dict):
        return tomlkit.item(value)
    table = tomlkit.inline_table()
    for key, one in value.items():
        table.append(key, _inline(one))
    return table


def _has_header(value: Any) -> bool:
    if _is_tables(value):
        return True
    return isinstance(value, dict) and any(isinstance(v, dict) for v in value.values())


def _is_tables(value: Any) -> bool:
    return isinstance(value, list) and bool(value) and isinstance(value[0], dict)


def _masked(text: str) -> tuple[str, list[list[str]]]:
    """Comments above a header put behind it, since the library takes them for the table before."""
    lines, blocks, waiting = list[str](), list[list[str]](), list[str]()
    for line in text.split("\n"):
        if not line.strip() or line.strip().startswith("#"):
            waiting.append(line)
            continue
        header = _HEADER.fullmatch(line)
        if header is None or not waiting:
            lines += [*waiting, line]
        else:
            lines.append(f"{header[1]} {_MARK}{len(blocks)}")
            blocks.append([*waiting, line])
        waiting = []
    masked = "\n".join([*lines, *waiting])
    is_same = _MARK not in text and tomllib.loads(masked) == tomllib.loads(text)
    return (masked, blocks) if is_same else (text, [])


def _unmasked(text: str, blocks: list[list[str]]) -> str:
    lines = []
    for line in text.split("\n"):
        _, mark, number = line.rpartition(_MARK)
        lines += blocks[int(number)] if mark and blocks else [line]
    return "\n".join(lines)


def _spaced(text: str, before: str) -> str:
    """An empty line before each new header."""
    old, lines = before.splitlines(), list[str]()
    known = set(pairwise(old))
    for line in text.splitlines():
        above = lines[-1].strip() if lines else ""
        is_new = not lines or (lines[-1], line) not in known
        if is_new and _HEADER.fullmatch(line) and above and not above.startswith("#"):
            lines.append("")
        lines.append(line)
    return "\n".join(lines).rstrip("\n") + "\n"
