"""How posed bones move: their controls, the chain from parents to children, the blend."""

from functools import partial
from typing import Literal, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from .._types import Array, Points, Vector
from ..errors import ParameterError
from ..numerics.rotation import increments, product, quaternion, turn
from . import dual_quaternions
from .bones import Bones

Blend = Literal["linear", "dual quaternion"]
PoseAxes = Literal["bone", "global"]

PARTS = {
    "rotation": slice(0, 3),
    "translation": slice(3, 6),
    "stretch": slice(6, 7),
    "scale": slice(7, 10),
}
"""Where each parameter of a bone is among its controls."""

COUNT = 10
"""Controls of a bone."""

AT_REST = np.array([0.0] * 6 + [1.0] * 4)
"""What they measure at rest: angles, displacements and factors."""


class Motion(NamedTuple):
    """Motions of the bones, as increments that are exactly zero at rest.

    A point x that follows one bone wholly goes to head + shift + rotation (I + growth) (x - head).
    """

    rotations: Float[Array, "b 4"]
    shifts: Float[Array, "b 3"]
    growths: Float[Array, "b 3 3"]


def parameters(bones: Bones) -> dict[str, np.ndarray]:
    """Numbers of the controls by bone and part, such as "inner.rotation"."""
    return {
        f"{bone.name}.{part}": np.arange(COUNT * i + where.start, COUNT * i + where.stop)
        for i, bone in enumerate(bones)
        for part, where in PARTS.items()
    }


def check_choices(blend: str, axes: str) -> None:
    """Refuse what is no way to blend, or no axes."""
    for name, value, choices in (("blend", blend, Blend), ("axes", axes, PoseAxes)):
        allowed = choices.__args__  # type: ignore[attr-defined]
        if value not in allowed:
            raise ParameterError(f"{name} must be one of {', '.join(allowed)}, got {value!r}")


@partial(jax.jit, static_argnums=(0, 1))
def motion(bones: Bones, axes: str, controls: Vector) -> Motion:
    """What the controls make the bones do, children carried by their parents.

    A child rides on its parent's tail: it is turned and displaced as that is, by the stretch too,
    but not scaled.
    """
    own = jnp.asarray(controls).reshape(len(bones), COUNT)
    turns, moves = own[:, PARTS["rotation"]], own[:, PARTS["translation"]]
    if axes == "bone":
        turns = jnp.einsum("bij,bj->bi", bones.axes, turns)
        moves = jnp.einsum("bij,bj->bi", bones.axes, moves)
    factors = own[:, PARTS["scale"]]
    stretch = own[:, PARTS["stretch"]]
    factors = factors.at[:, 1:2].add(stretch * (1 + factors[:, 1:2]))
    growths = jnp.einsum("bik,bk,bjk->bij", bones.axes, factors, bones.axes)
    rotations, shifts = _carried(bones, axes, quaternion(turns), moves, stretch)
    return Motion(rotations, shifts, growths)


def _carried(
    bones: Bones, axes: str, turns: Array, moves: Array, stretch: Array
) -> tuple[Array, Array]:
    """Rotations of the bones and displacements of their heads, parents first."""
    root = len(bones)  # a bone at rest, which carries those that have no parent
    parents = np.where(bones.parents < 0, root, bones.parents)[bones.order]
    heads = np.concatenate([bones.heads, np.zeros((1, 3))])
    levers = bones.heads[bones.order] - heads[parents]
    spans = np.concatenate([bones.tails - bones.heads, np.zeros((1, 3))])[parents]
    grown = jnp.concatenate([stretch, jnp.zeros((1, 1))])[parents] * spans

    def carry(found: tuple[jax.Array, jax.Array], bone: tuple[jax.Array, ...]) -> tuple:
        number, parent, own, move, lever, growth = bone
        rotations, shifts = found
        turned = rotations[parent]
        if axes == "bone":
            rotation, move = product(turned, own), move + turn(turned, move)
        else:
            rotation = product(own, turned)
        ride = turn(turned, lever + growth) + growth
        shift = shifts[parent] + ride + move
        return (rotations.at[number].set(rotation), shifts.at[number].set(shift)), None

    start = jnp.zeros((root + 1, 4)).at[:, 0].set(1.0), jnp.zeros((root + 1, 3))
    steps = (bones.order, parents, turns[bones.order], moves[bones.order], levers, grown)
    (rotations, shifts), _ = jax.lax.scan(carry, start, tuple(map(jnp.asarray, steps)))
    return rotations[:root], shifts[:root]


@partial(jax.jit, static_argnums=(0, 4))
def displaced(
    bones: Bones, motion: Motion, weights: Float[Array, "n b"], points: Points, blend: str
) -> Points:
    """Displacements of points that follow bones by their shares.

    Dual quaternions blend what is rigid: each bone's growth, which comes before it, displaces the
    point as a translation of that bone's own, as in Blender.
    """
    points, (rotations, shifts, growths) = jnp.asarray(points), motion
    if blend == "linear":
        turns = increments(rotations)
        matrices = turns + growths + turns @ growths
        rests = shifts - jnp.einsum("bij,bj->bi", matrices, bones.heads)
        return dual_quaternions.linear(points, weights, matrices, rests)
    rests = shifts - turn(rotations, bones.heads)
    offsets = points - bones.heads[:, None]
    grown = jnp.einsum("bij,bnj->bni", growths, offsets)
    return dual_quaternions.dual_quaternion(points, weights, rotations, rests, grown)
