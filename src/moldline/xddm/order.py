"""In which order things are computed that are made of each other."""

from collections.abc import Iterable, Iterator, Mapping


def ordered(made_of: Mapping[str, Iterable[str]]) -> tuple[list[str], list[str]]:
    """Names, each after those it is made of; and a circle of names where there is one.

    Names that are made of nothing need not be there.
    """
    done: dict[str, None] = {}
    for first in made_of:
        trail: dict[str, Iterator[str]] = {} if first in done else {first: iter(made_of[first])}
        while trail:
            name = next(reversed(trail))
            following = next((n for n in trail[name] if n in made_of and n not in done), None)
            if following is None:
                trail.pop(name)
                done[name] = None
            elif following in trail:
                names = list(trail)
                return list(done), names[names.index(following) :]
            else:
                trail[following] = iter(made_of[following])
    return list(done), []
