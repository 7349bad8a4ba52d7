# The extension module. Use the package, which documents its classes and functions.

from pathlib import Path as FilePath
from typing import Any, Optional, Union, final

from ._types import Array, Canvas, Depth, Format, Parameter, Path, Photo, Progress, Region, Resolution, Value

__all__ = ["VERSION", "Diagnostic", "Fit", "Graph", "Session", "ShiboError", "check", "compare", "graphs"]

VERSION: str

@final
class Diagnostic:
    @property
    def code(self) -> str: ...
    @property
    def message(self) -> str: ...
    @property
    def help(self) -> Optional[str]: ...
    @property
    def file(self) -> Optional[str]: ...
    @property
    def line(self) -> int: ...
    @property
    def column(self) -> int: ...
    @property
    def warning(self) -> bool: ...

class ShiboError(Exception):
    diagnostics: list[Diagnostic]

@final
class Session:
    def __new__(
        cls,
        *,
        threads: int = 0,
        memory: int = 1536,
        cache_dir: Optional[Path] = None,
        cache_size: int = 4096,
        usual_cache: bool = False,
        import_path: list[Path] = ...,
    ) -> Session: ...
    @property
    def cache_error(self) -> Optional[str]: ...

@final
class Graph:
    def __new__(cls, path: Path, session: Session, preset: Optional[str], values: dict[str, Value]) -> Graph: ...
    @property
    def path(self) -> FilePath: ...
    @property
    def preset(self) -> Optional[str]: ...
    @preset.setter
    def preset(self, preset: Optional[str]) -> None: ...
    @property
    def presets(self) -> list[str]: ...
    @property
    def outputs(self) -> list[str]: ...
    @property
    def params(self) -> dict[str, Parameter]: ...
    @property
    def canvas(self) -> Canvas: ...
    @property
    def diagnostics(self) -> list[Diagnostic]: ...
    def set_values(self, values: dict[str, Value]) -> None: ...
    def render(
        self,
        name: str,
        *,
        resolution: Optional[Resolution] = None,
        region: Optional[Region] = None,
        values: Optional[dict[str, Value]] = None,
        progress: Optional[Progress] = None,
    ) -> Union[Array, dict[str, Array]]: ...
    def write(
        self,
        out: Path,
        *,
        outputs: list[str] = ...,
        resolution: Optional[Resolution] = None,
        region: Optional[Region] = None,
        target: Optional[str] = None,
        format: Optional[Format] = None,
        depth: Optional[Depth] = None,
        values: Optional[dict[str, Value]] = None,
        progress: Optional[Progress] = None,
    ) -> list[FilePath]: ...
    def fit(self, photo: Photo, options: dict[str, Any], *, progress: Optional[Progress] = None) -> Fit: ...

@final
class Fit:
    @property
    def json(self) -> str: ...
    @property
    def report(self) -> str: ...
    @property
    def values(self) -> list[tuple[str, str]]: ...
    @property
    def name(self) -> str: ...
    def write(self, name: Optional[str]) -> None: ...

def check(path: Path, session: Session) -> list[Diagnostic]: ...
def compare(a: Photo, b: Photo, *, width_mm: Optional[float] = None, width_mm_b: Optional[float] = None) -> str: ...
def graphs() -> list[str]: ...
