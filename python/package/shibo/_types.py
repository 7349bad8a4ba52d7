"""The types of arguments and results, shared by the package and the extension module."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from typing import Any, Literal, Optional, TypedDict, Union

import numpy as np
import numpy.typing as npt

Path = Union[str, "os.PathLike[str]"]
"""A file or a folder."""
Value = Union[bool, int, float, str, "os.PathLike[str]", "np.number[Any]", np.bool_, Sequence[float]]
"""The value of a parameter: a number, a switch, a text, a path, or a sequence of numbers such as a colour."""
Resolution = Union[int, tuple[int, int]]
"""Pixels of the longer side, or width and height."""
Region = tuple[int, int, int, int]
"""A part of a picture: x, y, width and height in pixels from the top left."""
Progress = Callable[[str, int, int], object]
"""A function that is called with the name of a node, its steps done and all of its steps."""
Format = Literal["png", "tiff", "exr", "svg"]
"""The format of a file."""
Depth = Literal["8", "16", "f16", "f32"]
"""Bits of a channel; those with `f` are floats."""
Array = npt.NDArray[np.float32]
"""A picture: (height, width) or (height, width, channels)."""
Rendered = Union[Array, Any]
"""An `Array`, or for a whole material a `dict[str, Array]`. The name decides at run time which one it is. `Any` stands for
the second, so that `graph.render("height").mean()` needs no `isinstance` before it."""


class Parameter(TypedDict):
    """A parameter of a graph."""

    type: Literal["Number", "Integer", "Bool", "Color", "Text", "Path", "Choice"]
    value: str
    """The current value, as RON."""
    default: str
    """The default, as RON."""
    range: Optional[tuple[float, float]]
    """The smallest and the largest number allowed."""
    unit: Optional[str]
    group: Optional[str]
    """The heading under which a panel shows it."""
    doc: str
    options: list[str]
    """The words of a `Choice`."""


class Canvas(TypedDict):
    """The canvas of a graph."""

    size_mm: tuple[float, float]
    resolution: tuple[int, int]
    tile: Literal["Both", "X", "Y", "None"]
    """The directions in which pictures repeat."""
    seed: int


Photo = Union[Path, npt.NDArray[Any]]
"""A picture file, or an array (height, width) or (height, width, channels): bytes as shown on a screen, or floats as
`Graph.render` makes them, with linear colours."""


class Measured(TypedDict):
    """A measured difference. The error of a factor is a factor."""

    value: float
    error: float


class MeasuredColor(TypedDict):
    """A difference of colours in OKLab, in hundredths: lightness, green to red, blue to yellow."""

    value: tuple[float, float, float]
    error: float


class MeasuredShift(TypedDict):
    """A shift to the right and down, in shares of the width."""

    value: tuple[float, float]
    error: float


class Parts(TypedDict):
    """The distance by groups of statistics."""

    color: float
    energy: float
    shape: float
    corr: float
    phase: float


class Comparison(TypedDict):
    """The differences of a picture from another one; None where a difference cannot be measured."""

    distance: float
    """0 for equal pictures."""
    floor: Optional[float]
    """The distance between the halves of the second picture."""
    parts: Parts
    size: Optional[Measured]
    """The factor by which the first picture is coarser."""
    turn: Optional[Measured]
    """Degrees by which the first picture is turned counter-clockwise."""
    contrast: Optional[Measured]
    color: Optional[MeasuredColor]
    detail: Optional[Measured]
    """Contrast of fine detail over all contrast, as a factor."""
    gloss: Optional[Measured]
    """Height of highlights over the contrast, as a factor."""
    shift: Optional[MeasuredShift]
    """A shift, if the pictures show one place."""
    words: list[str]
    """The differences that one would see."""


class Found(TypedDict):
    """The found value of a parameter."""

    value: Union[float, str]
    """A number, or a colour as `#rrggbb`."""
    error: float
    """Its standard error, in `unit`."""
    error_share: float
    """Its standard error as a share of the range."""
    determined: bool
    """False if the photograph does not determine the value."""
    unit: Optional[str]
    end: Optional[Literal["low", "high"]]
    """The end of the range at which the value is."""


class Light(TypedDict):
    """The direction of the light, in degrees."""

    azimuth: float
    elevation: Optional[float]
