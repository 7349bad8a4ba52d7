"""Tests of the Python package, as a program uses it."""

import os
import pathlib
import shutil
import signal
import subprocess
import sys
import threading
import time

import numpy as np
import pytest
import shibo

GRAPH = """(
  canvas: (size_mm: 8, resolution: (64, 32), tile: Both, seed: 3),
  params: {
    "size": Number(default: 2, range: (0.5, 8), unit: "mm", doc: "Size of a lump"),
    "tint": Color(default: "#804020"),
    "sharp": Bool(default: false),
  },
  presets: { "fine": { "size": 1 } },
  nodes: {
    "lumps": Perlin(size: "$size"),
    "height": Levels(input: "lumps", output: (0, 0.5)),
    "normal": HeightToNormal(input: "height"),
    "skin": Material(base_color: "$tint", height: "height", normal: "normal"),
  },
  outputs: { "skin": "skin", "lumps": "lumps" },
)
"""


@pytest.fixture
def session(tmp_path):
    return shibo.Session(cache_dir=tmp_path / "cache", threads=2)


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "a.ron"
    path.write_text(GRAPH.replace("resolution: (64, 32)", "resolution: 64"))
    return path


def test_arrays_have_shapes_types_and_units(file, session):
    graph = shibo.load(file, session=session)
    assert graph.outputs == ["skin", "lumps"]
    lumps = graph.render("lumps")
    assert lumps.shape == (64, 64) and lumps.dtype == np.float32 and lumps.flags.c_contiguous
    assert lumps.std() > 0.05
    height = graph.render("height", resolution=128)
    assert height.shape == (128, 128)
    assert np.array_equal(height, graph.render("skin.height", resolution=(128, 128)))
    assert 0 <= height.min() < height.max() <= 0.5, "millimetres"
    maps = graph.render("skin")
    assert sorted(maps) == ["base_color", "height", "normal"]
    assert maps["normal"].shape == (64, 64, 3)
    length = np.linalg.norm(maps["normal"] * 2 - 1, axis=2)
    assert np.abs(length - 1).max() < 1e-3
    # #804020 in linear light.
    assert maps["base_color"][5, 7] == pytest.approx([0.2159, 0.0513, 0.0144], abs=1e-3)


def test_a_region_is_a_crop(file, session):
    graph = shibo.load(file, session=session)
    whole = graph.render("normal")
    part = graph.render("normal", region=(10, 20, 31, 17))
    assert np.array_equal(part, whole[20:37, 10:41])
    for wrong in [(0, 0, 65, 1), (64, 0, 1, 1), (0, 0, 0, 1), (0, 0, 2**32 - 1, 1)]:
        with pytest.raises(ValueError, match="does not lie within"):
            graph.render("normal", region=wrong)


def test_arrays_are_independent_copies(file, session):
    graph = shibo.load(file, session=session)
    first = graph.render("lumps")
    kept = first.copy()
    first[:] = 7
    assert np.array_equal(graph.render("lumps"), kept)


def test_parameters(file, session):
    graph = shibo.load(file, session=session)
    assert graph.params["size"] == {
        "type": "Number",
        "value": "2",
        "default": "2",
        "range": (0.5, 8.0),
        "unit": "mm",
        "group": None,
        "doc": "Size of a lump",
        "options": [],
    }
    assert graph.canvas == {"size_mm": (8.0, 8.0), "resolution": (64, 64), "tile": "Both", "seed": 3}
    plain = graph.render("lumps")
    graph.set(size=np.float32(1), tint="#ff0000", sharp=True)
    assert graph.params["sharp"]["value"] == "true"
    fine = graph.render("lumps")
    assert not np.array_equal(plain, fine)
    assert graph.render("base_color")[0, 0] == pytest.approx([1, 0, 0])
    graph.set({"size": 2, "tint": (0.5, 0.25, 0.125)}, sharp=False)
    assert graph.render("base_color")[0, 0] == pytest.approx([0.5, 0.25, 0.125])
    assert np.array_equal(graph.render("lumps"), plain)
    assert np.array_equal(shibo.load(file, session=session, preset="fine").render("lumps"), fine)
    assert np.array_equal(graph.render("lumps", values={"size": 1}), fine)
    other = shibo.load(file, session=session, size=4)
    assert other.presets == ["fine"] and other.preset is None
    other.preset = "fine"
    assert other.params["size"]["value"] == "4", "what is given comes before a preset"


def test_seeds(file, session):
    graph = shibo.load(file, session=session)
    made = dict(graph.seeds("lumps", [3, 4, 5], resolution=32))
    assert list(made) == [3, 4, 5]
    assert np.array_equal(made[3], graph.render("lumps", resolution=32)), "the seed of the file"
    assert not np.array_equal(made[3], made[4]) and not np.array_equal(made[4], made[5])


def test_errors_carry_diagnostics(file, session, tmp_path):
    broken = tmp_path / "broken.ron"
    broken.write_text(file.read_text().replace("Perlin(size:", "Perlin(sise:").replace('"normal"))', '"normall"))'))
    with pytest.raises(shibo.ShiboError) as caught:
        shibo.load(broken, session=session)
    found = caught.value.diagnostics
    assert [d.code for d in found if not d.warning][:1] == ["unknown-field"]
    first = found[0]
    assert (first.file, first.line, first.column) == (str(broken), 10, 21)
    assert "size" in first.help and str(first) in str(caught.value)
    assert [d.code for d in shibo.check(broken, session=session)] == [d.code for d in found]

    graph = shibo.load(file, session=session)
    with pytest.raises(shibo.ShiboError, match="size") as caught:
        graph.set(size=-1)
    assert caught.value.diagnostics[0].file is None
    with pytest.raises(shibo.ShiboError, match="no parameter `sise`"):
        graph.set(sise=1)
    with pytest.raises(ValueError, match="finite"):
        graph.set(size=float("nan"))
    with pytest.raises(TypeError, match="not object"):
        graph.set(size=object())
    assert graph.params["size"]["value"] == "2", "nothing has changed"
    with pytest.raises(shibo.ShiboError, match="no output `nope`") as caught:
        graph.render("nope")
    assert caught.value.diagnostics == []
    with pytest.raises(shibo.ShiboError, match="no channel `hight`"):
        graph.render("skin.hight")
    with pytest.raises(shibo.ShiboError):
        graph.render("lumps", resolution=10**6)
    with pytest.raises(shibo.ShiboError):
        shibo.load(tmp_path / "missing.ron", session=session)
    file.write_text("(nodes: {")
    with pytest.raises(shibo.ShiboError):
        graph.render("lumps")


def test_imports_are_searched_in_named_folders(tmp_path, monkeypatch):
    monkeypatch.delenv("SHIBO_IMPORT_PATH", raising=False)
    (tmp_path / "lib").mkdir()
    (tmp_path / "lib" / "part.ron").write_text(GRAPH)
    text = '(imports: { "p": "part" }, nodes: { "u": Use(graph: "p") }, outputs: { "o": "u.lumps" })'
    (tmp_path / "main.ron").write_text(text)
    main = tmp_path / "main.ron"
    alone = shibo.Session(cache=False)
    assert [found.code for found in shibo.check(main, session=alone)] == ["file-not-found"]
    named = shibo.Session(cache=False, import_path=[tmp_path / "lib"])
    assert shibo.check(main, session=named) == []
    assert shibo.load(main, session=named).outputs == ["o"]
    monkeypatch.setenv("SHIBO_IMPORT_PATH", os.pathsep.join(["nowhere", str(tmp_path / "lib")]))
    assert shibo.load(main, session=shibo.Session(cache=False)).outputs == ["o"]


def test_edits_take_effect(file, session):
    graph = shibo.load(file, session=session)
    before = graph.render("lumps")
    file.write_text(file.read_text().replace("seed: 3", "seed: 4"))
    assert not np.array_equal(graph.render("lumps"), before)


def test_files_equal_those_of_the_command(file, session, tmp_path):
    graph = shibo.load(file, session=session)
    files = graph.write(tmp_path / "out", outputs=["skin.height", "lumps"], format="exr", depth="f32")
    assert [f.name for f in files] == ["skin_height.exr", "lumps.exr"] and all(f.exists() for f in files)
    glb = graph.write(tmp_path / "glb", target="gltf")
    assert [f.name for f in glb] == ["skin.glb"] and glb[0].read_bytes()[:4] == b"glTF"
    with pytest.raises(ValueError, match="must be one of gltf"):
        graph.write(tmp_path, target="max")
    command = os.environ.get("SHIBO") or shutil.which("shibo")
    if command:
        args = ["--no-cache", "--format", "exr", "--depth", "f32", "--output", "skin.height", "-o", tmp_path / "command"]
        subprocess.run([command, "render", file, *args], check=True)
        assert (tmp_path / "command" / "skin_height.exr").read_bytes() == files[0].read_bytes()


def test_lists_and_loads_shipped_graphs(session):
    assert {"calf", "walnut", "inlay"} <= set(shibo.graphs()) and "wrinkles" not in shibo.graphs()
    graph = shibo.load("shibo:noise_basics", session=session)
    assert graph.render(graph.outputs[0], resolution=16).shape[0] == 16


def test_progress_is_reported_and_can_stop(session):
    seen = []
    graph = shibo.load("shibo:calf", session=session)
    graph.render("height", resolution=600, progress=lambda *step: seen.append(step))
    assert all(isinstance(name, str) and 0 <= done <= total for name, done, total in seen)

    def stop(name, done, total):
        raise KeyError("enough")

    graph.set(seed=99)
    with pytest.raises(KeyError, match="enough"):
        for seed in range(100):
            graph.render("height", resolution=1500, values={"seed": seed}, progress=stop)


def test_threads_render_at_the_same_time(file, session):
    graphs = [shibo.load(file, session=session, size=size) for size in (1, 2, 4)]
    expected = [graph.render("normal", resolution=96) for graph in graphs]
    results = [None] * 12

    def work(i):
        fresh = shibo.Session(cache=False, threads=1)
        which = i % 3
        graph = shibo.load(file, session=fresh, size=(1, 2, 4)[which]) if i < 6 else graphs[which]
        results[i] = np.array_equal(graph.render("normal", resolution=96), expected[which])

    threads = [threading.Thread(target=work, args=(i,)) for i in range(12)]
    [thread.start() for thread in threads]
    [thread.join() for thread in threads]
    assert all(results)


LONG = """
import shibo, sys
graph = shibo.load("shibo:calf", session=shibo.Session(cache=False))
print("begun", flush=True)
try:
    for seed in range(1000):
        graph.render("height", resolution=4096, values={"seed": seed})
except KeyboardInterrupt:
    print("interrupted", flush=True)
    sys.exit(7)
"""


def test_an_interrupt_stops_a_render():
    # Shells start background jobs with SIGINT ignored, and child processes inherit that.
    def heed_interrupts():
        signal.signal(signal.SIGINT, signal.SIG_DFL)

    process = subprocess.Popen(
        [sys.executable, "-c", LONG], stdout=subprocess.PIPE, text=True, preexec_fn=heed_interrupts
    )
    assert process.stdout.readline() == "begun\n"
    time.sleep(1.5)
    start = time.monotonic()
    process.send_signal(signal.SIGINT)
    # Much longer than stopping takes, and much shorter than the renders would take.
    assert process.wait(timeout=30) == 7, process.stdout.read()
    print(f"stopped after {time.monotonic() - start:.2f} s")
    assert process.stdout.read() == "interrupted\n"


def test_other_python_runs_meanwhile(session):
    graph = shibo.load("shibo:calf", session=session, seed=5)
    ticks = []
    done = threading.Event()

    def tick():
        while not done.wait(0.005):
            ticks.append(time.monotonic())

    thread = threading.Thread(target=tick)
    thread.start()
    graph.render("height", resolution=1024)
    done.set()
    thread.join()
    assert len(ticks) >= 3


FITTED = """(
  canvas: (size_mm: 40, resolution: 96, tile: Both, seed: 1),
  params: {
    "size": Number(default: 4, range: (2, 8), unit: "mm", doc: "Size of the bumps"),
    "amount": Number(default: 0.5, range: (0, 1), doc: "Contrast"),
    "color": Color(default: "#806040", doc: "Colour"),
  },
  presets: {
    "pale": { "color": "#a09070" }, // a comment that stays
  },
  nodes: {
    "bumps": Fractal(size: "$size", octaves: 2, seed: 1),
    "tint": "= $color * (1 - $amount * bumps)",
  },
  outputs: { "picture": "tint" },
)
"""


@pytest.fixture
def fitted(tmp_path, session):
    """A graph, and an array of it at hidden values."""
    path = tmp_path / "fitted.ron"
    path.write_text(FITTED)
    graph = shibo.load(path, session=session)
    values = {"size": 3, "amount": 0.8, "color": "#907050", "seed": 9}
    return graph, graph.render("picture", resolution=128, values=values)


def test_fit_finds_hidden_values_and_writes_a_preset(fitted):
    graph, photo = fitted
    before = graph.path.read_text()
    told = []
    found = shibo.fit(graph, photo, width_mm=40, renders=60, progress=lambda *step: told.append(step))
    assert abs(found.parameters["size"]["value"] - 3) < 0.45, found.report
    assert abs(found.parameters["amount"]["value"] - 0.8) < 0.12, found.report
    assert found.parameters["color"]["value"].startswith("#")
    assert found.distance < 2.5 * found.floor and found.distance < 0.5 * found.start
    assert found.width_mm == 40 and found.light is None
    assert told and all(name == "fit" and 0 < done <= total for name, done, total in told)
    assert graph.path.read_text() == before, "a fit alone changes nothing"
    # The same bits for any number of threads.
    again = shibo.fit(graph, photo, width_mm=40, renders=60, threads=1)
    assert (again.values, again.distance) == (found.values, found.distance)
    found.write("scan")
    lines = graph.path.read_text().splitlines()
    kept = [line for line in lines if '"scan"' not in line and "// fitted to the array, 40 mm wide: " not in line]
    assert kept == before.splitlines() and len(lines) == len(kept) + 2
    assert shibo.load(graph.path, preset="scan").params["size"]["value"] == found.values["size"]
    # The values are nearer to the picture than those of the graph.
    start = shibo.compare(graph.render("picture", resolution=128), photo, width_mm=40)["distance"]
    graph.set(found.values)
    assert shibo.compare(graph.render("picture", resolution=128), photo, width_mm=40)["distance"] < 0.5 * start


def test_fit_holds_values_and_refuses_bad_requests(fitted):
    graph, photo = fitted
    graph.set(size=3, color="#907050")
    found = shibo.fit(graph, photo, width_mm=40, only=["amount"], renders=20)
    assert list(found.parameters) == ["amount"] and found.values["size"] == "3"
    assert abs(found.parameters["amount"]["value"] - 0.8) < 0.15, found.report
    for wrong, message in [
        ({"only": ["colr"]}, "did you mean `color`"),
        ({"width_mm": 0}, "width_mm is 0; it must be a number above 0"),
        ({"output": "pictures"}, "did you mean `picture`"),
        ({"light": (30, 40)}, "no `Relief`"),
        ({"crop": (0, 0, 300, 300)}, "128 . 128 pixels"),
    ]:
        with pytest.raises(shibo.ShiboError, match=message):
            shibo.fit(graph, photo, **{"width_mm": 40, "renders": 8, **wrong})
    with pytest.raises(shibo.ShiboError, match="one colour"):
        shibo.fit(graph, np.full((64, 64, 3), 0.5), width_mm=40)
    with pytest.raises(ValueError, match="is no picture"):
        shibo.fit(graph, np.zeros((4, 4, 4, 4)), width_mm=40)
    with pytest.raises(shibo.ShiboError, match="none"):
        shibo.fit(graph, "none.png", width_mm=40)
    with pytest.raises(ValueError, match="exclude each other"):
        shibo.fit(graph, photo, only=["size"], fixed=["color"])


def test_an_exception_in_progress_stops_a_fit(fitted):
    graph, photo = fitted

    def stop(name, done, total):
        raise RuntimeError(f"stopped after {done}")

    start = time.monotonic()
    with pytest.raises(RuntimeError, match="stopped after"):
        shibo.fit(graph, photo, width_mm=40, renders=100_000, progress=stop)
    # Much longer than stopping takes, and much shorter than the fit would take.
    assert time.monotonic() - start < 60


def test_compare_takes_arrays_and_files(fitted, tmp_path):
    graph, photo = fitted
    same = shibo.compare(photo, photo, width_mm=40)
    assert same["distance"] == 0 and same["words"] == ["no difference that one would see"]
    # Bytes count as shown on a screen.
    shown = np.where(photo <= 0.0031308, 12.92 * photo, 1.055 * np.maximum(photo, 1e-9) ** (1 / 2.4) - 0.055)
    assert shibo.compare((255 * shown + 0.5).astype(np.uint8), photo, width_mm=40)["distance"] < 0.05
    graph.write(tmp_path / "out", resolution=128, values={"color": "#305090", "seed": 9})
    blue = shibo.compare(tmp_path / "out" / "picture.png", photo, width_mm=40)
    assert blue["parts"]["color"] > 1 and any("blue" in words for words in blue["words"])
    with pytest.raises(shibo.ShiboError, match="above 0"):
        shibo.compare(photo, photo, width_mm=-1)


def test_the_package_is_documented():
    for name in shibo.__all__:
        thing = getattr(shibo, name)
        assert thing.__doc__, name
    for name in ("load", "check", "compare", "fit", "graphs"):
        assert getattr(shibo, name).__annotations__, name
    assert (pathlib.Path(shibo.__file__).parent / "py.typed").exists()
