#!/usr/bin/env python3
"""Formats the shaders by clang-format 14 and glsl/.clang-format; with --check it only says which are not formatted.

clang-format knows no GLSL: the instance name of a block, and blocks of one member, are put back on one line.
The program is `clang-format-14` of Debian and Ubuntu, or `clang-format` of that version from PyPI.
"""

import os
import pathlib
import re
import shutil
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
COLUMNS = 120


def program():
    for name in (os.environ.get("CLANG_FORMAT"), "clang-format-14", "clang-format"):
        if name and shutil.which(name):
            version = subprocess.run([name, "--version"], capture_output=True, text=True, check=True).stdout
            if " 14." in version:
                return name
    sys.exit("clang-format 14 is missing: apt install clang-format-14, or pip install clang-format==14.0.6")


def block_on_one_line(match):
    line = f"{match[1]} {{ {match[2]} }}{match[3] or ''};{match[4]}"
    return line if len(line) <= COLUMNS else match[0]


def formatted(name, text):
    style = f"--style=file:{ROOT / 'glsl/.clang-format'}"
    job = subprocess.run([name, "--assume-filename=shader.cpp", style], input=text, capture_output=True, text=True, check=True)
    text = re.sub(r"\n\}\n(\w+(?:\[\w*\])?;)", r"\n} \1", job.stdout)
    one_member = r"^([^\n]*\bbuffer \w+) \{\n    ([^\n{}/]*;)\n\}( \w+(?:\[\w*\])?)?;([^\n]*)"
    return re.sub(one_member, block_on_one_line, text, flags=re.MULTILINE)


def main():
    check = sys.argv[1:] == ["--check"]
    if sys.argv[1:] and not check:
        sys.exit(__doc__)
    name, wrong = program(), []
    shaders = [path for path in (ROOT / "glsl").rglob("*") if path.suffix in (".glsl", ".comp", ".vert", ".geom", ".frag")]
    for path in sorted(shaders):
        text = path.read_text()
        new = formatted(name, text)
        if new != text:
            wrong.append(str(path.relative_to(ROOT)))
            if not check:
                path.write_text(new)
    if wrong:
        print("\n".join(wrong))
    if wrong and check:
        sys.exit("these shaders are not formatted: run scripts/format-glsl.py")


main()
