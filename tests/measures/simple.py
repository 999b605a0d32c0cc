"""Shapes and sections whose measures are known."""

import numpy as np
from wings import airfoil, wing

import moldline as ml

BOX = np.array([[x, y, z] for x in (0, 4) for y in (0, 2) for z in (0, 1)], float)
SIDES = np.array(
    [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1],
     [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]]
)  # fmt: skip
"""A box of 4 x 2 x 1, its faces looking outwards."""


def naca0012(count=200, base=0.0, chord=1.0):
    """With a closed or a blunt trailing edge, in the x-y plane."""
    flat = chord * airfoil(count, base=base)
    return ml.Section(np.column_stack([flat, np.zeros(len(flat))]), is_closed=not base)


def tapered(rows=13, base=0.0, camber=0.0, twist=0.0):
    """A wing to y = 10, its chord 4 at the root and 1.5 at the tip, unswept quarter chords."""
    y = np.linspace(0, 10, rows)
    section = airfoil(40, base=base, camber=camber)
    return wing(y, 4 - 0.25 * y, twist, sweep=0.0, dihedral=0.0, section=section)
