"""The Wrapper of a design framework: a request in a folder is answered there."""

from pathlib import Path

from ..errors import FileError, ParameterError
from ..workers import AbstractExecutor
from .case_answer import answered, case_of, of_case
from .design import driven
from .differencing import differenced
from .document import read
from .exchange import LAYOUTS, REQUEST, Answer, deliver
from .model import Design
from .problems import problems
from .wrapper import LIMIT


def answer(
    path: Path | str,
    folder: Path | str = ".",
    layout: str | None = None,
    limit: float = LIMIT,
    executor: AbstractExecutor | None = None,
) -> Answer:
    """Read `model.input.xml` in a folder, and leave the surface and `model.output.xml` there.

    `path` is a Model's document, which names a Case of ours or a Wrapper of somebody else's, a
    design document with Intersects, or a case file. Whatever fails raises, and leaves the folder
    without half an answer. `layout` is how derivatives of the surface are written: `both` unless
    the document says otherwise in its attribute Layout. `limit` [s] and `executor` are for runs of
    other programs: as many at a time as there are cores, where none is given.
    """
    place, here = Path(path), Path(folder)
    if not here.is_dir():
        raise FileError(f"{here}: no such folder, expected the one with {REQUEST}")
    request = read(here / REQUEST)
    if wrong := problems(request):
        raise FileError("\n".join(wrong[:8]))
    asked = Design(request)
    if place.suffix.lower() == ".toml":
        from ..case import load

        found = of_case(load(place), asked)
        chosen = layout or asked.target.get("Layout")
    else:
        source = Design(read(place))
        _check(asked, source)
        found = served(asked, source, here, limit, executor)
        chosen = layout or source.target.get("Layout") or asked.target.get("Layout")
    deliver(found, here, _layout(chosen, place))
    return found


def served(
    asked: Design,
    source: Design,
    folder: Path,
    limit: float = LIMIT,
    executor: AbstractExecutor | None = None,
) -> Answer:
    """The answer of whatever a document describes; nothing but runs of others is written."""

    def again(asked: Design, source: Design, folder: Path) -> Answer:
        return served(asked, source, folder, limit, executor)

    if source.intersects:
        return driven(asked, source, folder, again)
    if source.target.get("Case"):
        if not case_of(source).is_file():
            source.document.refuse(
                source.target,
                f"Case={source.target.get('Case')!r}: there is no such file beside the document",
            )
        return answered(asked, source, folder, again)
    if source.target.get("Wrapper"):
        _check_loop(source)
        return differenced(asked, source, folder, limit, executor)
    source.document.refuse(
        source.target,
        "expected an attribute Case with the case file behind it, a Wrapper with somebody else's "
        "program, or Intersects of such Models",
    )


def _check(asked: Design, source: Design) -> None:
    """Refuse a request to another Model."""
    if (asked.target.tag, asked.target.id) != (source.target.tag, source.target.id):
        raise FileError(
            f"{asked.document.path}: asks {asked.target.label}, but {source.document.path} is "
            f"{source.target.label}; is it the right folder?"
        )


def _check_loop(source: Design) -> None:
    """Refuse a Wrapper that would serve the very document that names it."""
    words = (source.target.get("Wrapper") or "").split()
    own = source.document.path.resolve()
    if "serve" in words and own in {(own.parent / word).resolve() for word in words}:
        source.document.refuse(
            source.target,
            'its Wrapper serves this same document, which names no Case; add Case="..." or the '
            "Wrapper of the program that makes the surface",
        )


def _layout(layout: str | None, path: Path) -> str:
    word = (layout or "both").strip().lower()
    if word not in LAYOUTS:
        raise ParameterError(f"{path}: Layout={layout!r}, expected one of {', '.join(LAYOUTS)}")
    return word
