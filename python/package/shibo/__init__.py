"""Shibo: a node-graph procedural texture engine.

    import shibo
    graph = shibo.load("shibo:calf")
    graph.set(pitch=0.9)
    height = graph.render("height", resolution=1024)     # float32, millimetres
"""

from __future__ import annotations

import json
import os
import pathlib
import threading
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any, Optional, Union

import numpy as np

from . import _shibo
from ._shibo import Diagnostic, ShiboError
from ._types import Array as Array
from ._types import Canvas as Canvas
from ._types import Comparison as Comparison
from ._types import Depth as Depth
from ._types import Format as Format
from ._types import Found as Found
from ._types import Light as Light
from ._types import Parameter as Parameter
from ._types import Path as Path
from ._types import Photo as Photo
from ._types import Progress as Progress
from ._types import Region as Region
from ._types import Rendered as Rendered
from ._types import Resolution as Resolution
from ._types import Value as Value

__version__ = _shibo.VERSION
__all__ = ["Diagnostic", "Fit", "Graph", "Session", "ShiboError", "check", "compare", "fit", "graphs", "load"]


def _cache_home() -> Optional[pathlib.Path]:
    """The user's folder for caches, as the command uses it."""
    for name, below in (("XDG_CACHE_HOME", ""), ("HOME", ".cache")):
        value = os.environ.get(name, "")
        if os.path.isabs(value):
            return pathlib.Path(value) / below
    return None


class Session:
    """Threads and caches, shared by the graphs that are loaded with it.

    `threads` is the number of threads, 0 for one per core; `memory` and `cache_size` are in MiB. Results are kept in
    `cache_dir`, by default the folder of the command, unless `cache` is false. Imports are also searched in the folders
    `import_path`, and in those of the environment variable SHIBO_IMPORT_PATH."""

    def __init__(
        self,
        *,
        threads: int = 0,
        memory: int = 1536,
        cache: bool = True,
        cache_dir: Optional[Path] = None,
        cache_size: int = 4096,
        import_path: Sequence[Path] = (),
    ) -> None:
        home = _cache_home()
        usual = False
        if cache and cache_dir is None and home is not None:
            usual, cache_dir = True, home / "shibo"
        named = [folder for folder in os.environ.get("SHIBO_IMPORT_PATH", "").split(os.pathsep) if folder]
        self._native = _shibo.Session(
            threads=threads,
            memory=memory,
            cache_dir=cache_dir if cache else None,
            cache_size=cache_size,
            usual_cache=usual,
            import_path=[*import_path, *named],
        )

    @property
    def cache_error(self) -> Optional[str]:
        """The reason if the cache folder cannot be used."""
        return self._native.cache_error


_lock = threading.Lock()
_default: Optional[Session] = None


def _session(session: Optional[Session]) -> _shibo.Session:
    """The given session, or the shared default one."""
    global _default
    if session is not None:
        return session._native
    with _lock:
        if _default is None:
            _default = Session()
        return _default._native


class Graph:
    """A graph file with values for its parameters; made by `load`.

    The file is read again for every render, so edits take effect. Threads may use one graph, or several, at the same
    time."""

    def __init__(
        self,
        path: Path,
        *,
        preset: Optional[str] = None,
        session: Optional[Session] = None,
        values: Optional[Mapping[str, Value]] = None,
    ) -> None:
        self._native = _shibo.Graph(path, _session(session), preset, dict(values or {}))

    def __repr__(self) -> str:
        return f"<shibo.Graph {self.path}>"

    @property
    def path(self) -> pathlib.Path:
        """The file."""
        return pathlib.Path(self._native.path)

    @property
    def preset(self) -> Optional[str]:
        """The preset in use, or several as `a+b`; may be set."""
        return self._native.preset

    @preset.setter
    def preset(self, preset: Optional[str]) -> None:
        self._native.preset = preset

    @property
    def presets(self) -> list[str]:
        """The names of the presets."""
        return self._native.presets

    @property
    def outputs(self) -> list[str]:
        """The names of the outputs."""
        return self._native.outputs

    @property
    def params(self) -> dict[str, Parameter]:
        """The parameters by name: `type`, `value` and `default` as RON, `range`, `unit`, `doc`, `options`."""
        return self._native.params

    @property
    def canvas(self) -> Canvas:
        """`size_mm`, `resolution`, `tile` and `seed`."""
        return self._native.canvas

    @property
    def diagnostics(self) -> list[Diagnostic]:
        """Warnings, and advice that needs the whole graph."""
        return self._native.diagnostics

    def set(self, values: Optional[Mapping[str, Value]] = None, /, **more: Value) -> None:
        """Sets parameters; `{"left.gap": 2}` sets one of the sub-graph `left`. `seed` is the canvas' seed unless a
        parameter has that name. A wrong value raises `ShiboError` with the valid values, and nothing changes."""
        self._native.set_values({**(values or {}), **more})

    def render(
        self,
        name: str,
        *,
        resolution: Optional[Resolution] = None,
        region: Optional[Region] = None,
        values: Optional[Mapping[str, Value]] = None,
        progress: Optional[Progress] = None,
    ) -> Rendered:
        """Renders an output to a new array of 32-bit floats, (height, width) or (height, width, channels), and a whole
        material to a dict of arrays. `name` is an output, `OUTPUT.CHANNEL`, or a channel that only one material has.

        Colours are scene-linear Rec.709, heights are millimetres, normals are ½ + ½n with y up. `values` sets
        parameters for this picture only. Ctrl-C, or an exception in `progress`, stops the work at once."""
        return self._native.render(
            name, resolution=resolution, region=region, values=None if values is None else dict(values), progress=progress
        )

    def seeds(
        self,
        name: str,
        seeds: Iterable[int],
        *,
        resolution: Optional[Resolution] = None,
        region: Optional[Region] = None,
    ) -> Iterator[tuple[int, Rendered]]:
        """Renders an output for several seeds of the canvas, one after another: yields (seed, array)."""
        for seed in seeds:
            yield seed, self.render(name, resolution=resolution, region=region, values={"seed": seed})

    def write(
        self,
        out: Path,
        *,
        outputs: Sequence[str] = (),
        resolution: Optional[Resolution] = None,
        region: Optional[Region] = None,
        target: Optional[str] = None,
        format: Optional[Format] = None,
        depth: Optional[Depth] = None,
        values: Optional[Mapping[str, Value]] = None,
        progress: Optional[Progress] = None,
    ) -> list[pathlib.Path]:
        """Writes the outputs as files to the folder `out`, which is created if necessary. The files equal those of
        `shibo render`, byte by byte. Either all files are written or none.

        `outputs` names the outputs, by default all. `target` writes the materials for another program, named as in
        `shibo render --as`. `format` (png, tiff, exr or svg) and `depth` (8, 16, f16 or f32) replace those of the
        graph."""
        files = self._native.write(
            out,
            outputs=list(outputs),
            resolution=resolution,
            region=region,
            target=target,
            format=format,
            depth=depth,
            values=None if values is None else dict(values),
            progress=progress,
        )
        return [pathlib.Path(file) for file in files]


def load(
    path: Path, *, preset: Optional[str] = None, session: Optional[Session] = None, **params: Value
) -> Graph:
    """Loads the graph file at `path`, or a shipped graph, `shibo:NAME`. A graph with errors raises `ShiboError`."""
    return Graph(path, preset=preset, session=session, values=params)


def check(path: Path, *, session: Optional[Session] = None) -> list[Diagnostic]:
    """Returns the errors and warnings of a graph file, without computing anything."""
    return _shibo.check(path, _session(session))


def graphs() -> list[str]:
    """Returns the names of the shipped graphs, which load as `shibo:NAME`."""
    return _shibo.graphs()


class Fit:
    """The values with which a graph looks like a photograph; made by `fit`. `graph.set(found.values)` takes them over."""

    def __init__(self, native: _shibo.Fit) -> None:
        self._native = native
        self._data: dict[str, Any] = json.loads(native.json)

    def __repr__(self) -> str:
        return f"<shibo.Fit at distance {self.distance:.2f}>"

    @property
    def values(self) -> dict[str, str]:
        """The values of the preset, as RON."""
        return dict(self._native.values)

    @property
    def parameters(self) -> dict[str, Found]:
        """The fitted parameters by name, each with its error."""
        return dict(self._data["parameters"])

    @property
    def distance(self) -> float:
        """The distance from the photograph."""
        return float(self._data["distance"])

    @property
    def floor(self) -> Optional[float]:
        """The distance between two seeds of the found values; None if the time was too short for it."""
        return _number(self._data["floor"])

    @property
    def start(self) -> Optional[float]:
        """The distance of the graph before the fit; None if it refuses its values at this size."""
        return _number(self._data["start"])

    @property
    def renders(self) -> int:
        """The number of renders."""
        return int(self._data["renders"])

    @property
    def width_mm(self) -> float:
        """Width of the compared square in mm: given, or fitted."""
        return float(self._data["width_mm"])

    @property
    def light(self) -> Optional[Light]:
        """The found direction of the light; None if it was no unknown."""
        light: Optional[Light] = self._data["light"]
        return light

    @property
    def unreached(self) -> list[str]:
        """The groups of statistics whose difference is clearly above the floor."""
        return list(self._data["unreached"])

    @property
    def report(self) -> str:
        """The report of `shibo fit`, in words."""
        return self._native.report

    def write(self, name: Optional[str] = None) -> None:
        """Writes the values into the graph file as a preset, by default named after the photograph. An existing preset of
        that name is replaced; all other text stays byte for byte."""
        self._native.write(name)


def _number(value: Optional[float]) -> Optional[float]:
    return None if value is None else float(value)


def _photo(photo: Photo) -> Photo:
    """A path as it is; an array of bytes or of 32-bit floats."""
    if isinstance(photo, (str, os.PathLike)):
        return photo
    array = np.asarray(photo)
    return array if array.dtype == np.uint8 else array.astype(np.float32, copy=False)


def compare(
    a: Photo, b: Photo, *, width_mm: Optional[float] = None, width_mm_b: Optional[float] = None
) -> Comparison:
    """Returns the differences of the picture `a` from `b`, as `shibo compare` does. Pictures need not show the same place.

    `width_mm` is the width of the pictures, `width_mm_b` that of the second one if it is another one."""
    found: Comparison = json.loads(_shibo.compare(_photo(a), _photo(b), width_mm=width_mm, width_mm_b=width_mm_b))
    return found


def fit(
    graph: Union[Graph, Path],
    photo: Photo,
    *,
    width_mm: Optional[float] = None,
    output: Optional[str] = None,
    only: Sequence[str] = (),
    fixed: Sequence[str] = (),
    light: Union[str, tuple[float, float]] = "auto",
    crop: Optional[Region] = None,
    fine: bool = False,
    seconds: Optional[float] = None,
    renders: Optional[int] = None,
    seed: int = 1,
    threads: int = 0,
    progress: Optional[Progress] = None,
) -> Fit:
    """Finds the values with which a graph looks like a photograph, as `shibo fit` does. The graph stays as it is.

    `width_mm` is the width of the photograph; without it the size is fitted too. The search begins with the preset and the
    values of the graph. `only` fits these parameters, `fixed` all but these. `light` is `auto`, `graph`, or azimuth and
    elevation in degrees. `crop` takes a part of the photograph. `renders` bounds the work; so does `seconds`, but then the
    result depends on the speed of the machine. `progress` is called with "fit", the finished renders and all renders.
    Ctrl-C, or an exception in `progress`, stops the work. Faults of the photograph are warnings."""
    if not isinstance(graph, Graph):
        graph = load(graph)
    options = {
        "width_mm": width_mm,
        "output": output,
        "only": list(only),
        "fixed": list(fixed),
        "light": light if isinstance(light, str) else ",".join(map(str, light)),
        "crop": crop,
        "fine": fine,
        "seconds": seconds,
        "renders": renders,
        "seed": seed,
        "threads": threads,
    }
    return Fit(graph._native.fit(_photo(photo), options, progress=progress))
