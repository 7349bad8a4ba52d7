#!/usr/bin/env python3
"""Writes the papers of a release: a list of all crates and npm modules in it (CycloneDX 1.5), and their licences.

    release/papers.py FOLDER VERSION

FOLDER gets shibo-VERSION.cdx.json and LICENSES.txt. A crate or module whose licence deny.toml does not allow is an error. Those without
a licence text are listed. Two runs give the same bytes.
"""
import json
import re
import subprocess
import sys
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
TARGET = "x86_64-unknown-linux-musl"
# The features of the released command.
FEATURES = "shared-cache,mcp"
TEXTS = re.compile(r"(licen[cs]e|copying|notice|unlicense|copyright)", re.IGNORECASE)
# The crates of this project that a release builds: the command and the Python module. The WebAssembly module has no others.
ROOTS = ("shibo", "shibo-python")
# Folders with the lists of npm modules that a release contains.
MODULES = ["editors/vscode", "src/serve/page", "site/play"]


def crates():
    """The crates of others that a release is built of, as dictionaries with name, version, licence and folder."""
    command = ["cargo", "metadata", "--format-version", "1", "--locked", "--filter-platform", TARGET, "--features", FEATURES]
    data = json.loads(subprocess.run(command, cwd=ROOT, check=True, capture_output=True).stdout)
    packages = {package["id"]: package for package in data["packages"]}
    nodes = {node["id"]: node for node in data["resolve"]["nodes"]}
    found, waiting = set(), [package["id"] for package in data["packages"] if package["name"] in ROOTS]
    while waiting:
        one = waiting.pop()
        if one in found:
            continue
        found.add(one)
        for dependency in nodes[one]["deps"]:
            # Crates that only tests or build scripts use are in no release.
            if any(kind["kind"] is None for kind in dependency["dep_kinds"]):
                waiting.append(dependency["pkg"])
    foreign = (packages[one] for one in found if packages[one]["source"])
    for package in sorted(foreign, key=lambda package: (package["name"], package["version"])):
        folder = Path(package["manifest_path"]).parent
        file = [folder / package["license_file"]] if package["license_file"] else []
        yield {"type": "cargo", "name": package["name"], "version": package["version"], "license": package["license"], "texts": file, "folder": folder}


def modules():
    """The npm modules that are bundled into a release."""
    for folder in MODULES:
        lock = ROOT / folder / "package-lock.json"
        if not lock.exists():
            continue
        for path, module in sorted(json.loads(lock.read_text())["packages"].items()):
            if path and not module.get("dev"):
                name = path.rsplit("node_modules/", 1)[-1]
                yield {"type": "npm", "name": name, "version": module["version"], "license": module.get("license"), "texts": [], "folder": lock.parent / path}


def allowed(expression, allow):
    """True if a licence expression can be fulfilled with allowed licences."""
    text = expression.replace("/", " OR ")
    tokens = re.findall(r"\(|\)|[^()\s]+", text)

    def choice():
        value = both()
        while tokens and tokens[0] == "OR":
            tokens.pop(0)
            value = both() or value
        return value

    def both():
        value = one()
        while tokens and tokens[0] == "AND":
            tokens.pop(0)
            value = one() and value
        return value

    def one():
        if not tokens:
            return False
        token = tokens.pop(0)
        if token == "(":
            value = choice()
            if tokens:
                tokens.pop(0)
            return value
        if len(tokens) > 1 and tokens[0] == "WITH":
            tokens.pop(0)
            exception = tokens.pop(0)
            return token in allow or f"{token} WITH {exception}" in allow
        return token in allow

    return choice() and not tokens


def licence_texts(part):
    """The licence files of a part, without repeats."""
    folder = part["folder"]
    files = part["texts"] or (sorted(path for path in folder.iterdir() if path.is_file() and TEXTS.search(path.name)) if folder.is_dir() else [])
    texts = []
    for path in files:
        text = path.read_text(encoding="utf-8", errors="replace").replace("\r\n", "\n").strip()
        if text and text not in texts:
            texts.append(text)
    return texts


def main():
    folder, version = Path(sys.argv[1]), sys.argv[2]
    allow = set(tomllib.loads((ROOT / "deny.toml").read_text())["licenses"]["allow"])
    parts = [*crates(), *modules()]
    problems, by_text, without = [], {}, []
    for part in parts:
        label = f"{part['name']} {part['version']}"
        if not part["license"] or not allowed(part["license"], allow):
            problems.append(f"{label}: the licence `{part['license']}` is not in deny.toml")
        texts = licence_texts(part)
        if not texts:
            without.append(f"{label} ({part['license']})")
        for text in texts:
            by_text.setdefault(text, []).append(f"{label} ({part['license']})")
    if problems:
        sys.exit("\n".join(problems))
    components = []
    for part in parts:
        kind, name = part["type"], part["name"]
        url = f"pkg:{kind}/{name.replace('@', '%40')}@{part['version']}"
        components.append(
            {"type": "library", "bom-ref": url, "name": name, "version": part["version"], "licenses": [{"expression": part["license"].replace("/", " OR ")}], "purl": url}
        )
    own = {"type": "application", "bom-ref": "shibo", "name": "shibo", "version": version, "licenses": [{"expression": "MIT OR Apache-2.0"}]}
    bill = {"bomFormat": "CycloneDX", "specVersion": "1.5", "version": 1, "metadata": {"component": own}, "components": components}
    (folder / f"shibo-{version}.cdx.json").write_text(json.dumps(bill, indent=1, ensure_ascii=False) + "\n")
    rule = "-" * 100
    lines = ["Shibo is licensed as MIT OR Apache-2.0. A release contains the parts below, with these licences.", ""]
    lines += [f"{part['type']}: {part['name']} {part['version']}: {part['license']}" for part in parts]
    if without:
        lines += ["", "These packages contain no licence text; the licence that they name applies:", *without]
    for text, labels in by_text.items():
        lines += ["", rule, *labels, "", text]
    (folder / "LICENSES.txt").write_text("\n".join(lines) + "\n")
    print(f"{len(parts)} parts, {len(by_text)} licence texts, {len(without)} parts without a text")


if __name__ == "__main__":
    main()
