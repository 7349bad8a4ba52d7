"""Checks the graphs that an agent wrote for the briefs, by the rules of README.md.

    check.py SHIBO [FOLDER]    the program, and the folder with a file NAME.ron for each brief; `solved` if not given

Prints a line for each brief: `passed`, or the reasons why it failed. The exit code is 0 if all briefs passed, 1 if one failed,
and 2 for wrong usage. Needs only Python 3.9 and its standard library.
"""

from __future__ import annotations

import json
import pathlib
import re
import shutil
import struct
import subprocess
import sys
import tempfile
import zlib
from dataclasses import dataclass
from typing import Any

HERE = pathlib.Path(__file__).resolve().parent
PIXELS = 512
SECONDS = 30.0

# Strings, numbers and words of RON, each of its brackets and separators, and comments, which are dropped.
TOKEN = re.compile(
    r'(?P<skip>\s+|//[^\n]*)|(?P<string>"(?:[^"\\]|\\.)*")|(?P<number>-?\d+(?:\.\d+)?)|(?P<word>\w+)|(?P<mark>[\[\](){},:])'
)
CLIPPED = re.compile(r"samples of `(?P<file>[^`]+)` lie outside 0\.\.1 and were clipped; its values are (?P<values>\S+)")


class Ron:
    """Reads the RON of briefs.ron: lists, maps and tuples as lists and dicts, and structs as dicts."""

    def __init__(self, text: str) -> None:
        self.tokens: list[tuple[str, str]] = []
        at = 0
        while at < len(text):
            found = TOKEN.match(text, at)
            if found is None:
                raise ValueError(f"line {text.count(chr(10), 0, at) + 1}: unexpected {text[at]!r}")
            if found.lastgroup != "skip":
                self.tokens.append((str(found.lastgroup), found.group()))
            at = found.end()
        self.at = 0

    def take(self) -> tuple[str, str]:
        """The next token."""
        if self.at == len(self.tokens):
            raise ValueError("the text ends too early")
        self.at += 1
        return self.tokens[self.at - 1]

    def value(self) -> Any:
        """The value that begins here."""
        kind, text = self.take()
        if kind == "string":
            return json.loads(text)
        if kind == "number":
            return float(text)
        if kind == "word":
            return text
        if text not in "[({":
            raise ValueError(f"unexpected {text!r}")
        end = {"[": "]", "(": ")", "{": "}"}[text]
        items: list[Any] = []
        fields: dict[str, Any] = {}
        while self.tokens[self.at : self.at + 1] != [("mark", end)]:
            item = self.value()
            if self.tokens[self.at : self.at + 1] == [("mark", ":")]:
                self.at += 1
                fields[item] = self.value()
            else:
                items.append(item)
            if self.tokens[self.at : self.at + 1] == [("mark", ",")]:
                self.at += 1
        self.at += 1
        return fields or items


@dataclass
class Brief:
    """A brief; README.md describes the fields."""

    name: str
    text: str
    outputs: dict[str, str]
    size_mm: list[float]
    tile: str
    color: tuple[str, list[list[float]]] | None = None
    range: tuple[str, float, float] | None = None
    params: tuple[str, ...] = ()
    fewest: float = 0


class Picture:
    """The samples of a PNG file without interlacing, from 0 to 1 and channel by channel."""

    def __init__(self, path: pathlib.Path) -> None:
        data = path.read_bytes()
        if data[:8] != b"\x89PNG\r\n\x1a\n":
            raise ValueError(f"{path.name} is no PNG file")
        packed = b""
        at = 8
        while at < len(data):
            length, kind = struct.unpack(">I4s", data[at : at + 8])
            body = data[at + 8 : at + 8 + length]
            if kind == b"IHDR":
                width, height, depth, color, _, _, interlaced = struct.unpack(">IIBBBBB", body)
            elif kind == b"IDAT":
                packed += body
            at += length + 12
        if depth not in (8, 16) or color not in (0, 2) or interlaced:
            raise ValueError(f"{path.name}: only grey and RGB of 8 and 16 bits can be read")
        self.channels = 3 if color == 2 else 1
        step = self.channels * depth // 8
        rows = unfiltered(zlib.decompress(packed), width * step, height, step)
        most = 2**depth - 1
        samples = rows if depth == 8 else struct.unpack(f">{len(rows) // 2}H", rows)
        self.samples = [[value / most for value in samples[channel :: self.channels]] for channel in range(self.channels)]


def unfiltered(data: bytes, length: int, height: int, step: int) -> bytes:
    """The rows of a PNG picture, `length` bytes each, after its filters are undone; a pixel has `step` bytes."""
    rows = bytearray()
    above = bytearray(length)
    for y in range(height):
        start = y * (length + 1)
        kind = data[start]
        row = bytearray(data[start + 1 : start + 1 + length])
        for x in range(length if kind else 0):
            left = row[x - step] if x >= step else 0
            corner = above[x - step] if x >= step else 0
            row[x] = (row[x] + predicted(kind, left, above[x], corner)) & 255
        rows += row
        above = row
    return bytes(rows)


def predicted(kind: int, left: int, up: int, corner: int) -> int:
    """The prediction of a filter of PNG, by the bytes to the left, above, and above to the left."""
    if kind == 1:
        return left
    if kind == 2:
        return up
    if kind == 3:
        return (left + up) // 2
    distances = (abs(up - corner), abs(left - corner), abs(left + up - 2 * corner))
    return (left, up, corner)[distances.index(min(distances))]


class Graph:
    """A graph file, and the pictures that the program makes of it in the folder `out`."""

    def __init__(self, shibo: str, path: pathlib.Path, out: pathlib.Path) -> None:
        self.shibo = shibo
        self.path = path
        self.out = out
        self.told = ""

    def run(self, command: str, *options: str, seconds: float = 10 * SECONDS) -> subprocess.CompletedProcess[str]:
        """Runs a command of the program on the graph."""
        line = [self.shibo, command, *options, str(self.path)]
        return subprocess.run(line, capture_output=True, text=True, encoding="utf-8", timeout=seconds, check=False)

    def render(self, outputs: list[str], *options: str) -> float:
        """Renders outputs as PNG files into `out` and returns the seconds, without the time that other programs took.

        Adds the warnings to `told`, because a run that finds its results in the cache has none.
        """
        names = [word for output in outputs for word in ("--output", output)]
        cache = ("--cache-dir", str(self.out / "cache"), "--quiet", "-o", str(self.out))
        done = self.run("render", *names, "--resolution", str(PIXELS), "--format", "png", *cache, "--stats", "json", *options)
        told = " ".join(done.stderr.split())
        if done.returncode:
            raise ValueError(f"`render` fails: {told[:200]}")
        self.told += told
        stats = json.loads(done.stdout)
        return float(min(stats["wall_s"], stats["cpu_s"]))

    def type_of(self, output: str) -> str | None:
        """The type of an output that was rendered, by its files."""
        plain = self.out / f"{output}.png"
        if plain.exists():
            return "Rgb" if Picture(plain).channels == 3 else "Gray"
        return "Material" if any(self.out.glob(f"{output}_*.png")) else None

    def picture(self, measured: str) -> Picture:
        """The picture of an output or of a channel that was rendered."""
        return Picture(self.out / f"{measured.replace('.', '_')}.png")


def errors(graph: Graph) -> list[str]:
    """The errors that `shibo check` reports, each with its line."""
    answer = graph.run("check", "--format", "json")
    if not answer.stdout:
        return [f"check fails: {' '.join(answer.stderr.split())[:200]}"]
    found = json.loads(answer.stdout)["errors"]
    return [f"line {error['line']}: {error['message']}" for error in found]


def mismatches(brief: Brief, text: dict[str, Any]) -> list[str]:
    """The differences between a brief and the text of a graph, which is in the JSON form."""
    reasons = []
    canvas = text.get("canvas", {})
    size = canvas.get("size_mm", 100)
    size = size if isinstance(size, list) else [size, size]
    if any(abs(a - b) > 1e-6 for a, b in zip(size, brief.size_mm)):
        reasons.append(f"the canvas has {size} mm instead of {brief.size_mm}")
    # `None` of a graph is `null` in JSON.
    tile = canvas.get("tile", "Both") or "None"
    if tile != brief.tile:
        reasons.append(f"`tile` is {tile} instead of {brief.tile}")
    reasons += [f"there is no parameter `{name}`" for name in brief.params if name not in text.get("params", {})]
    presets = len(text.get("presets", {}))
    if presets < brief.fewest:
        reasons.append(f"the number of presets is {presets} instead of at least {brief.fewest:.0f}")
    reasons += [f"there is no output `{name}`" for name in brief.outputs if name not in text.get("outputs", {})]
    return reasons


def color_reasons(brief: Brief, graph: Graph) -> list[str]:
    """The channels of the mean colour that lie outside of their ranges."""
    if brief.color is None:
        return []
    measured, ranges = brief.color
    means = [255 * sum(channel) / len(channel) for channel in graph.picture(measured).samples]
    return [
        f"the mean of `{measured}.{name}` is {mean:.0f} instead of {least:.0f} to {most:.0f}"
        for name, mean, (least, most) in zip("rgb", means, ranges)
        if not least <= mean <= most
    ]


def range_reasons(brief: Brief, graph: Graph) -> list[str]:
    """The values of a number output that lie outside of their range, at 16 bits."""
    if brief.range is None:
        return []
    measured, least, most = brief.range
    graph.render([measured], "--depth", "16")
    clipped = [found for found in CLIPPED.finditer(graph.told) if pathlib.Path(found["file"]).stem == measured.replace(".", "_")]
    if clipped:
        return [f"the values of `{measured}` are {clipped[0]['values']} instead of {least}..{most}"]
    samples = graph.picture(measured).samples[0]
    low, high = min(samples), max(samples)
    half = 0.5 / 65535
    if least - half <= low and high <= most + half:
        return []
    return [f"the values of `{measured}` are {low:.4f}..{high:.4f} instead of {least}..{most}"]


def judged(brief: Brief, graph: Graph) -> list[str]:
    """The reasons why a graph fails its brief; none if it passes."""
    if not graph.path.is_file():
        return [f"there is no file {graph.path.name}"]
    reasons = errors(graph)
    if reasons:
        return reasons
    text: dict[str, Any] = json.loads(graph.run("fmt", "--to", "json").stdout)
    reasons = mismatches(brief, text)
    first = next(iter(text.get("outputs", {})), None)
    if first is None or any(name not in text["outputs"] for name in brief.outputs):
        return reasons
    # The cache is empty here, so this is the time without one.
    seconds = graph.render([first])
    if seconds > SECONDS:
        reasons.append(f"`{first}` takes {seconds:.0f} s at {PIXELS} pixels instead of {SECONDS:.0f} s at most")
    others = [name for name in brief.outputs if name != first]
    if others:
        graph.render(others)
    for name, wanted in brief.outputs.items():
        type_of = graph.type_of(name)
        if type_of != wanted:
            return [*reasons, f"`{name}` is {type_of or 'no picture'} instead of {wanted}"]
    return reasons + color_reasons(brief, graph) + range_reasons(brief, graph)


def main(arguments: list[str]) -> int:
    """Checks a folder, prints the lines and returns the exit code."""
    if len(arguments) not in (1, 2):
        print(__doc__, file=sys.stderr)
        return 2
    if shutil.which(arguments[0]) is None:
        print(f"there is no program {arguments[0]}", file=sys.stderr)
        return 2
    folder = pathlib.Path(arguments[1]) if len(arguments) == 2 else HERE / "solved"
    briefs = [Brief(**fields) for fields in Ron((HERE / "briefs.ron").read_text(encoding="utf-8")).value()]
    passed = 0
    for brief in briefs:
        with tempfile.TemporaryDirectory() as out:
            try:
                reasons = judged(brief, Graph(arguments[0], folder / f"{brief.name}.ron", pathlib.Path(out)))
            except (OSError, ValueError, subprocess.TimeoutExpired) as error:
                reasons = [str(error)]
        passed += not reasons
        print(f"{brief.name:14} {'; '.join(reasons) or 'passed'}", flush=True)
    print(f"{passed} of {len(briefs)} passed")
    return 0 if passed == len(briefs) else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
