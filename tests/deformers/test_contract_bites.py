"""Each clause of the contract catches the deformer that breaks it."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import moldline as ml
from moldline.deformers import contract

CLOUD = np.random.default_rng(0).uniform(-1, 1, (20, 3))


class Lift(ml.AbstractDeformer):
    """Lifts all points by one control; what is broken is given."""

    broken: str = ""

    @property
    def size(self):
        return 1

    @property
    def neutral(self):
        return np.zeros(2) if self.broken == "size" else np.zeros(1)

    def __call__(self, points, controls):
        lift = controls[0]
        if self.broken == "neutral":
            lift = lift + 1e-16 * points[0, 0] + 1e-15
        if self.broken == "alone":
            lift = lift * jnp.mean(points)
        if self.broken == "slope by controls":
            lift = _wrong(lift)
        if self.broken == "slope at neutral":
            lift = jnp.sqrt(jnp.abs(lift))
        if self.broken == "slope by points":
            lift = lift * _wrong(points[:, 0])
        return jnp.asarray(points).at[:, 2].add(lift)

    def bind(self, points):
        return Raised(self, points, self.broken)

    def follow(self, points, controls):
        return self(points, controls) + (1e-9 * controls[0] if self.broken == "following" else 0.0)


class Raised(ml.AbstractBinding):
    """The binding of it."""

    deformer: Lift
    points: jax.Array
    broken: str

    def __call__(self, controls):
        if self.broken == "given":
            self.points[0, 0] += 1e-9 * controls[0]
        if self.broken == "binding":
            controls = controls * (1 + 1e-9)
        if self.broken == "jit" and isinstance(controls, jax.core.Tracer):
            controls = jnp.asarray(controls, jnp.float32)
        return self.deformer(self.points, controls)


@jax.custom_jvp
def _wrong(x):
    return jnp.sin(x)


_wrong.defjvp(lambda at, along: (_wrong(*at), 1.001 * jnp.cos(at[0]) * along[0]))


@pytest.mark.parametrize(
    ("broken", "clause", "message"),
    [
        ("size", contract.neutral_controls_are_as_many_as_its_size, "1 controls need a neutral"),
        ("neutral", contract.neutral_controls_leave_every_coordinate_equal, "move point 0 by"),
        ("given", contract.it_does_not_change_what_it_is_given, "changed in place"),
        ("alone", contract.a_point_moves_the_same_alone_or_in_company, "when it is alone"),
        ("binding", contract.the_binding_agrees_with_the_definition, "is not the definition"),
        ("following", contract.following_agrees_with_the_definition, "is not the definition"),
        ("jit", contract.a_jit_changes_neither_value_nor_gradient, "a jit changes the result"),
        ("slope by controls", contract.derivatives_by_controls_are_right, "fall with order 1"),
        ("slope at neutral", contract.derivatives_by_controls_are_right, "is not finite"),
        ("slope by points", contract.derivatives_by_points_are_right, "fall with order 1"),
    ],
)
def test_a_broken_deformer_is_caught(broken, clause, message):
    with pytest.raises(AssertionError, match=message):
        clause(Lift(broken), CLOUD.copy())


def test_every_clause_is_tried_and_a_sound_deformer_keeps_all():
    contract.check(Lift(), CLOUD)
