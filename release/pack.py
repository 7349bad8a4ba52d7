#!/usr/bin/env python3
"""Packs a folder as a zip file whose bytes depend on nothing but names, contents and execution bits.

    release/pack.py FOLDER FILE.zip
    release/pack.py --again FILE.zip      packs an existing file once more
"""
import io
import os
import sys
import zipfile
from pathlib import Path

# The first date that a zip can state.
DATE = (1980, 1, 1, 0, 0, 0)


def pack(files, target):
    """Writes pairs of a name and (content, mode), in the order of their names."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as archive:
        for name, (content, mode) in sorted(files.items()):
            entry = zipfile.ZipInfo(name, DATE)
            entry.compress_type, entry.create_system = zipfile.ZIP_DEFLATED, 3
            entry.external_attr = (0o100755 if mode & 0o100 else 0o100644) << 16
            archive.writestr(entry, content)
    partial = target.with_name(target.name + ".part")
    partial.write_bytes(buffer.getvalue())
    os.replace(partial, target)


def main():
    if sys.argv[1] == "--again":
        target = Path(sys.argv[2])
        with zipfile.ZipFile(target) as archive:
            files = {entry.filename: (archive.read(entry), entry.external_attr >> 16) for entry in archive.infolist() if not entry.is_dir()}
    else:
        folder, target = Path(sys.argv[1]), Path(sys.argv[2])
        found = (path for path in folder.rglob("*") if path.is_file())
        files = {path.relative_to(folder).as_posix(): (path.read_bytes(), path.stat().st_mode) for path in found}
    pack(files, target)


if __name__ == "__main__":
    main()
