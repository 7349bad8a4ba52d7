"""The extension module. Use the package `shibo`, which is documented."""

from typing import Any, Optional

VERSION: str

class Diagnostic:
    code: str
    message: str
    help: Optional[str]
    file: Optional[str]
    line: int
    column: int
    warning: bool

class ShiboError(Exception):
    diagnostics: list[Diagnostic]

class Session:
    cache_error: Optional[str]
    def __new__(cls, library: Any, **settings: Any) -> "Session": ...

class Graph:
    path: Any
    preset: Optional[str]
    presets: list[str]
    outputs: list[str]
    params: dict[str, dict[str, Any]]
    canvas: dict[str, Any]
    diagnostics: list[Diagnostic]
    def __new__(cls, path: Any, session: Session, preset: Optional[str], values: dict[str, Any]) -> "Graph": ...
    def set_values(self, values: dict[str, Any]) -> None: ...
    def render(self, name: str, **how: Any) -> Any: ...
    def write(self, out: Any, **how: Any) -> list[Any]: ...

def check(path: Any, session: Session) -> list[Diagnostic]: ...
def graphs() -> list[str]: ...
