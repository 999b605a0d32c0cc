# SPDX-License-Identifier: GPL-3.0-or-later
"""Colours for numbers, and the bar in the 3-D view that says which is which."""

from typing import Any, NamedTuple

import bpy
import numpy as np

DIVERGING = np.array(
    [
        (59, 76, 192), (98, 130, 234), (141, 176, 254), (184, 208, 249), (221, 221, 221),
        (245, 196, 173), (244, 154, 123), (222, 96, 77), (180, 4, 38),
    ],
    float,
) / 255  # fmt: skip
"""sRGB from blue by grey to red, even to the eye: K. Moreland, Diverging color maps for scientific
visualization, ISVC 2009."""

SEQUENTIAL = np.array(
    [
        (68, 1, 84), (71, 44, 122), (59, 81, 139), (44, 113, 142), (33, 144, 141),
        (39, 173, 129), (92, 200, 99), (170, 220, 50), (253, 231, 37),
    ],
    float,
) / 255  # fmt: skip
"""sRGB from dark to bright: viridis, S. van der Walt and N. Smith, 2015 (CC0)."""

STEPS = 48
WIDTH, HEIGHT, LEFT, BOTTOM = 18, 200, 24, 56
"""Pixels, at the interface's own scale."""


class Scale(NamedTuple):
    """What the colours stand for.

    Attributes
    ----------
    title
        What is shown.
    unit
        Of the numbers.
    largest
        The largest number; signed ones run from minus it.
    is_signed
        Whether zero is in the middle.
    """

    title: str
    unit: str
    largest: float
    is_signed: bool

    @property
    def low(self) -> float:
        """The number at the bottom."""
        return -self.largest if self.is_signed else 0.0

    @property
    def ticks(self) -> list[tuple[float, str]]:
        """Heights from 0 to 1, and what is written there."""
        shares = (0.0, 0.25, 0.5, 0.75, 1.0)
        values = [self.low + share * (self.largest - self.low) for share in shares]
        return [(s, f"{v:.3g}") for s, v in zip(shares, values, strict=True)]

    def shades(self, numbers: Any) -> np.ndarray:
        """Colours of numbers, (n, 3), sRGB."""
        anchors = DIVERGING if self.is_signed else SEQUENTIAL
        places = np.linspace(self.low, self.largest, len(anchors))
        return np.stack([np.interp(numbers, places, anchors[:, i]) for i in range(3)], axis=1)

    def rgba(self, numbers: Any) -> np.ndarray:
        """Colours of numbers, (n, 4), linear, as Blender's attributes hold them."""
        shades = self.shades(numbers)
        low, high = shades / 12.92, ((shades + 0.055) / 1.055) ** 2.4
        linear = np.where(shades <= 0.04045, low, high)
        return np.concatenate([linear, np.ones((len(linear), 1))], axis=1)


_shown: list[Scale] = []
_handle: list[Any] = []


def show(scale: Scale) -> None:
    """Show the bar of a scale in 3-D views, until it is hidden."""
    _shown[:] = [scale]
    if not bpy.app.background and not _handle:
        space = bpy.types.SpaceView3D
        _handle.append(space.draw_handler_add(_draw, (), "WINDOW", "POST_PIXEL"))


def hide() -> None:
    """Take the bar away."""
    _shown.clear()
    while _handle:
        bpy.types.SpaceView3D.draw_handler_remove(_handle.pop(), "WINDOW")


def shown() -> Scale | None:
    """The scale whose bar is shown."""
    return _shown[0] if _shown else None


def _draw() -> None:
    if not _shown or not bpy.context.space_data.overlay.show_overlays:
        return
    scale, size = _shown[0], bpy.context.preferences.system.ui_scale
    tools = [r.width for r in bpy.context.area.regions if r.type == "TOOLS" and r.width > 1]
    left, bottom = LEFT * size + max(tools, default=0), BOTTOM * size
    _bar(scale, left, bottom, WIDTH * size, HEIGHT * size)
    _texts(scale, left, bottom, size)


def _bar(scale: Scale, left: float, bottom: float, width: float, height: float) -> None:
    import gpu  # only a Blender with a window has a graphics context
    from gpu_extras.batch import batch_for_shader

    shares = np.linspace(0.0, 1.0, STEPS)
    shades = scale.shades(scale.low + shares * (scale.largest - scale.low))
    corners, colours = [], []
    for share, shade in zip(shares, shades, strict=True):
        for x in (left, left + width):
            corners.append((x, bottom + share * height, 0.0))
            colours.append((*map(float, shade), 1.0))
    shader = gpu.shader.from_builtin("SMOOTH_COLOR")
    batch = batch_for_shader(shader, "TRI_STRIP", {"pos": corners, "color": colours})
    batch.draw(shader)


def _texts(scale: Scale, left: float, bottom: float, size: float) -> None:
    import blf

    font = 0
    blf.size(font, 11 * size)
    blf.color(font, *_text_colour())
    for share, said in scale.ticks:
        blf.position(font, left + (WIDTH + 6) * size, bottom + share * HEIGHT * size - 4 * size, 0)
        blf.draw(font, said)
    for line, said in enumerate((f"[{scale.unit}]" if scale.unit else "", scale.title)):
        blf.position(font, left, bottom + (HEIGHT + 12 + 16 * line) * size, 0)
        blf.draw(font, said)


def _text_colour() -> tuple[float, float, float, float]:
    space = getattr(bpy.context.preferences.themes[0].view_3d, "space", None)
    return (*getattr(space, "text_hi", (1.0, 1.0, 1.0)), 1.0)


def register() -> None:
    """There is nothing to make known; the bar comes when it is shown."""


def unregister() -> None:
    """Take the bar away."""
    hide()
