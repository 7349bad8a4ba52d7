"""Checks the JSON Schema of graphs by the library jsonschema: it accepts all given graphs, and refuses single faults.

    schema.py FOLDER    with schema.json, nodes.json (`shibo nodes --format json`) and graphs as *.graph.json

Prints one line for each wrong answer, and the numbers of graphs and faults. Writes the faulty graphs to FOLDER/faults.
"""
import copy
import json
import pathlib
import sys

import jsonschema

folder = pathlib.Path(sys.argv[1])
schema = json.loads((folder / "schema.json").read_text())
jsonschema.Draft202012Validator.check_schema(schema)
validator = jsonschema.Draft202012Validator(schema)
wrong = 0


def say(message):
    global wrong
    wrong += 1
    print(message)


def deepest(error):
    """The message of the innermost error."""
    while error.context:
        error = max(error.context, key=lambda inner: len(inner.absolute_path))
    return f"{'/'.join(map(str, error.absolute_path))}: {error.message[:200]}"


graphs = sorted(folder.glob("*.graph.json"))
for path in graphs:
    error = next(validator.iter_errors(json.loads(path.read_text())), None)
    if error:
        say(f"refuses {path.name}: {deepest(error)}")

faults = []


def refuse(name, code, graph):
    faults.append((name, code, graph))
    if validator.is_valid(graph):
        say(f"accepts {name} ({code})")


def node(kind, fields, **more):
    return {"nodes": {"x": {"Perlin": {}}, "a": {kind: fields}}, "outputs": {"x": "x"}, **more}


def outside(range_, above):
    """Numbers outside of a range."""
    least, most = range_
    if least is not None:
        yield least if above else least - max(1, abs(least))
    if most is not None:
        yield most + max(1, abs(most))


def minimal(kind):
    fields = {port["name"]: ["x"] if port["list"] else "x" for port in kind["ports"] if port["required"]}
    fields.update({param["name"]: "file" for param in kind["parameters"] if param["required"]})
    return fields


for kind in json.loads((folder / "nodes.json").read_text())["nodes"]:
    name, fields = kind["kind"], minimal(kind)
    error = next(validator.iter_errors(node(name, fields)), None)
    if error:
        say(f"refuses {name}: {deepest(error)}")
    refuse(f"{name}-kind", "unknown-kind", node(name + "x", fields))
    refuse(f"{name}-field", "unknown-field", node(name, {**fields, "no_such_field": 1}))
    for missing in fields:
        refuse(f"{name}-no-{missing}", "missing-input", node(name, {k: v for k, v in fields.items() if k != missing}))
    for port in kind["ports"]:
        for number in outside(port["range"], False) if port["range"] and not port["list"] else ():
            refuse(f"{name}-{port['name']}-{number}", "out-of-range", node(name, {**fields, port["name"]: number}))
    for param in kind["parameters"]:
        field = param["name"]
        if param["range"] and param["type"] in ("Number", "Integer", "Range", "Linear", "Xy"):
            for number in outside(param["range"], param["above_min"]):
                number = int(number) if param["type"] == "Integer" else number
                refuse(f"{name}-{field}-{number}", "out-of-range", node(name, {**fields, field: number}))
        if param["choices"]:
            refuse(f"{name}-{field}-word", "unknown-variant", node(name, {**fields, field: "NoSuchWord"}))
        else:
            # A default is valid, and so is a formula.
            good = [value for value in (param["default"],) if value is not None and param["type"] != "Path"]
            for value in [*good, *(["= 1"] if param["type"] in ("Number", "Integer") else [])]:
                error = next(validator.iter_errors(node(name, {**fields, field: value})), None)
                if error:
                    say(f"refuses {name}.{field}: {value}: {deepest(error)}")

plain = node("Perlin", {})
for name, code, path, value in [
    ("root", "unknown-field", ["node"], {}),
    ("canvas", "unknown-field", ["canvas"], {"size": 3}),
    ("tile", "unknown-variant", ["canvas"], {"tile": "All"}),
    ("size", "out-of-range", ["canvas"], {"size_mm": 0}),
    ("type", "unknown-variant", ["params"], {"p": {"Float": {"default": 1}}}),
    ("default", "missing-input", ["params"], {"p": {"Number": {"doc": "d"}}}),
    ("param-field", "unknown-field", ["params"], {"p": {"Number": {"default": 1, "max": 3}}}),
    ("input-type", "unknown-variant", ["inputs"], {"i": {"Grey": {"default": 1}}}),
    ("format", "unknown-variant", ["outputs"], {"o": {"File": {"from": "x", "format": "Gif"}}}),
    ("from", "missing-input", ["outputs"], {"o": {"File": {"format": "Png"}}}),
    ("target", "missing-input", ["outputs"], {"o": {"Gltf": {"mesh": "Sphere"}}}),
    ("use", "missing-input", ["nodes", "u"], {"Use": {"seed": 1}}),
    ("use-field", "unknown-field", ["nodes", "u"], {"Use": {"graph": "g", "size": 1}}),
    ("over", "out-of-range", ["nodes", "u"], {"Each": {"graph": "g", "ids": "x", "over": 65}}),
    ("inline", "unknown-kind", ["nodes", "u"], {"Blur": {"input": {"Perlim": {}}}}),
    ("held", "unknown-kind", ["pins"], {"change": 1, "hold": {"Perlim": 1}}),
]:
    graph = copy.deepcopy(plain)
    place = graph
    for key in path[:-1]:
        place = place[key]
    place[path[-1]] = value
    refuse(name, code, graph)
del plain["nodes"]
refuse("nodes", "missing-input", plain)

(folder / "faults").mkdir(exist_ok=True)
for name, code, graph in faults:
    (folder / "faults" / f"{name}.{code}.json").write_text(json.dumps(graph))
print(f"{len(graphs)} graphs, {len(faults)} faults, {wrong} wrong answers")
sys.exit(wrong > 0)
