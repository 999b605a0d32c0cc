"""A step of a pipeline that makes a geometry: a modeler, and the links to its parameters."""

from collections.abc import Mapping, Sequence

import equinox as eqx
from jaxtyping import Float

from .._types import Array, Vector
from ..errors import GeometryError, ParameterError
from ..mesh import Geometry
from ..modelers.base import AbstractMaking, AbstractModeler
from ..parameters.link import Link
from ..parameters.variable import Variable
from .stage import check_links, turned


class Construction(eqx.Module):
    """A modeler with its links.

    Attributes
    ----------
    modeler
        What makes the geometry.
    links
        For each variable the link to the modeler's parameters; what several variables do adds up.
    to
        Name of the geometry that it makes.
    of
        Names of the geometries that it is made from, as the stages before this one leave them.
    name
        What reports call it.
    """

    modeler: AbstractModeler
    links: dict[Variable, Link]
    to: str = eqx.field(static=True)
    of: tuple[str, ...] = eqx.field(static=True)
    name: str = eqx.field(static=True)

    def __init__(
        self,
        modeler: AbstractModeler,
        links: Mapping[Variable, Link] | None = None,
        to: str = "geometry",
        of: Sequence[str] = (),
        name: str = "",
    ):
        self.modeler = modeler
        self.links = dict(links or {})
        self.to = to
        self.of = tuple(of)
        self.name = name or type(modeler).__name__.lower()

    def __check_init__(self) -> None:
        check_links(self.name, self.links, self.modeler.size)
        least, most = self.modeler.takes
        if not least <= len(self.of) <= most:
            takes = f"{least}" if least == most else f"{least} or more"
            raise ParameterError(
                f"stage {self.name!r} takes {takes} geometries, got {len(self.of)}: of = "
                f"{list(self.of)}"
            )
        if len(set(self.of)) < len(self.of):
            raise ParameterError(f"stage {self.name!r} takes a geometry twice: {list(self.of)}")

    @property
    def is_fixed(self) -> bool:
        """Whether nothing moves what it makes."""
        return not self.links and not self.of

    def controls(self, values: Mapping[str, Float[Array, "v"]]) -> Vector:
        """Parameters from the variables' values, given in the designer's units."""
        return turned(self.modeler.values, self.links, values)

    def check(self, values: Mapping[str, Float[Array, "v"]]) -> None:
        """Refuse values that make no sense as parameters; an error names the stage."""
        try:
            self.modeler.check(self.controls(values))
        except ParameterError as error:
            raise ParameterError(f"stage {self.name!r}: {error}") from None

    def bind(self, geometries: Sequence[Geometry]) -> AbstractMaking:
        """The modeler tied to geometries; an error names the stage."""
        try:
            return self.modeler.bind(*geometries, names=self.of)
        except GeometryError as error:
            raise GeometryError(f"stage {self.name!r}: {error}") from None
