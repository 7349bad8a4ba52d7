"""Opens the files of `shibo render --as` with the libraries of the programs: MaterialX, OpenUSD, OpenImageIO.

    python read.py FOLDER        files below FOLDER; prints the errors, and exits 1 if there are any
"""
import ast
import os
import struct
import sys
import zipfile

import MaterialX as mx
import OpenImageIO as oiio
from pxr import Sdf, Usd, UsdGeom, UsdShade, UsdValidation

wrong = []
seen = {"mtlx": 0, "usda": 0, "usdz": 0, "pictures": 0, "levels": 0, "scripts": 0}


def fail(path, text):
    wrong.append(f"{path}: {text}")


def read_picture(path):
    picture = oiio.ImageInput.open(path)
    if picture is None:
        return fail(path, oiio.geterror())
    spec = picture.spec()
    pixels = picture.read_image(oiio.FLOAT)
    if pixels is None or pixels.shape[:2] != (spec.height, spec.width):
        fail(path, "its pixels cannot be read")
    if spec.tile_width:
        read_levels(path, picture, pixels)
    picture.close()
    seen["pictures"] += 1


def read_levels(path, picture, before):
    """Checks that each level is the box average of the one before: by its mean, and for colours by each texel."""
    size, level = before.shape[:2], 0
    before = before.reshape(*size, -1)
    while max(size) > 1:
        level += 1
        size = tuple(max(1, side // 2) for side in size)
        pixels = picture.read_image(0, level, 0, before.shape[2], oiio.FLOAT) if picture.seek_subimage(0, level) else None
        if pixels is None or pixels.shape[:2] != size:
            return fail(path, f"has no level {level} of {size[1]} by {size[0]} pixels")
        pixels = pixels.reshape(*size, -1)
        if "ormal" in path and abs(((pixels * 2 - 1) ** 2).sum(-1) - 1).max() > 5e-3:
            fail(path, f"level {level} holds no unit vectors")
        if all(old in (new, 2 * new) for old, new in zip(before.shape, size)):
            parts = before.reshape(size[0], before.shape[0] // size[0], size[1], before.shape[1] // size[1], -1)
            half = parts.mean((1, 3))
            if "olor" in path and abs(half - pixels).max() > 2e-3 * max(1.0, abs(half).max()):
                fail(path, f"level {level} is not the average of the one before")
            if "oughness" in path and (pixels < half - 2e-3).any():
                fail(path, f"level {level} is smoother than what it is made of")
        elif "olor" in path and abs(before.mean() - pixels.mean()) > 2e-3 * max(1.0, abs(pixels).max()):
            fail(path, f"level {level} has another mean than the one before")
        before = pixels
    if picture.spec().getattribute("wrapmodes") is None:
        fail(path, "does not say whether it repeats")
    if picture.seek_subimage(0, level + 1):
        fail(path, "has levels beyond the last")
    seen["levels"] += level


libraries = mx.createDocument()
mx.loadLibraries(mx.getDefaultDataLibraryFolders(), mx.getDefaultDataSearchPath(), libraries)


def read_materialx(path):
    document = mx.createDocument()
    mx.readFromXmlFile(document, path)
    document.importLibrary(libraries)
    valid, message = document.validate()
    if not valid:
        fail(path, message)
    if not [node for node in document.getMaterialNodes() if node.getCategory() == "surfacematerial"]:
        fail(path, "there is no material")
    for element in document.traverseTree():
        if isinstance(element, mx.Input) and element.getType() == "filename" and not element.hasSourceUri():
            file = element.getValueString()
            if file and not os.path.exists(os.path.join(os.path.dirname(path), file)):
                fail(path, f"names {file}, which does not exist")
    seen["mtlx"] += 1


checks = UsdValidation.ValidationContext(UsdValidation.ValidationRegistry().GetOrLoadAllValidators())


def read_usd(path):
    stage = Usd.Stage.Open(path)
    if UsdGeom.GetStageMetersPerUnit(stage) != 1.0 or UsdGeom.GetStageUpAxis(stage) != "Y":
        fail(path, "one unit is not a metre, y up")
    for error in checks.Validate(stage):
        # The package on PyPI lacks the definitions of MaterialX's shaders.
        if "ND_" not in error.GetMessage():
            fail(path, f"{error.GetName()}: {error.GetMessage()}")
    meshes = [prim for prim in stage.Traverse() if prim.IsA(UsdGeom.Mesh)]
    for mesh in meshes:
        material, _ = UsdShade.MaterialBindingAPI(mesh).ComputeBoundMaterial()
        if not material or not material.ComputeSurfaceSource()[0]:
            fail(path, f"{mesh.GetPath()} has no material")
    if not meshes:
        fail(path, "there is no mesh")
    for prim in stage.Traverse():
        for attribute in prim.GetAttributes():
            value = attribute.Get()
            if isinstance(value, Sdf.AssetPath) and not exists(value.resolvedPath):
                fail(path, f"{attribute.GetPath()} names {value.path}, which does not exist")
            for source in attribute.GetConnections():
                if not stage.GetAttributeAtPath(source):
                    fail(path, f"{attribute.GetPath()} is connected to {source}, which does not exist")
    seen[path[-4:]] += 1


def exists(path):
    """True if the file exists; it may be in a package: `package[file]`."""
    package, bracket, name = path.partition("[")
    if bracket:
        return name[:-1] in zipfile.ZipFile(package).namelist()
    return os.path.exists(path)


def read_package(path):
    """Checks that the contents are stored uncompressed at multiples of 64 bytes, the stage first."""
    entries = zipfile.ZipFile(path).infolist()
    if not entries[0].filename.endswith(".usda"):
        fail(path, f"begins with {entries[0].filename}")
    with open(path, "rb") as file:
        for entry in entries:
            file.seek(entry.header_offset + 26)
            name, extra = struct.unpack("<HH", file.read(4))
            if (entry.header_offset + 30 + name + extra) % 64 or entry.compress_type:
                fail(path, f"{entry.filename} cannot be read in place")
    read_usd(path)


for folder, _, files in sorted(os.walk(sys.argv[1])):
    for name in sorted(files):
        path = os.path.join(folder, name)
        if name.endswith(".mtlx"):
            read_materialx(path)
        elif name.endswith(".usda"):
            read_usd(path)
        elif name.endswith(".usdz"):
            read_package(path)
        elif name.endswith((".png", ".jpg", ".exr", ".tiff")):
            read_picture(path)
        elif name.endswith(".py"):
            ast.parse(open(path).read(), name)
            seen["scripts"] += 1
print(", ".join(f"{count} {kind}" for kind, count in seen.items()))
if wrong or not all(seen.values()):
    sys.exit("\n".join(wrong) or "something was not there to be read")
