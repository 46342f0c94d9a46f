#!/usr/bin/env python3
"""Plants the faults of tests/faults/faults.toml, one at a time, and writes into docs/notes/faults.md which test caught
which.

The tracked files are copied into target/faults/tree, and everything is built and run there: the repository itself is
never touched but for the page. A fault of a shader is planted at run time first, in a copy of the GLSL that the tests
on a device take (TWOBOUNCE_TEST_GLSL); if they let it pass, and for every other fault, the program is built with it. A
fault is caught by the first test that fails; in the end, each test that caught one must pass without any fault. Exit
code 1 if a fault was not caught.

    scripts/planted-faults.py                  # all of them: make faults
    scripts/planted-faults.py --list
    scripts/planted-faults.py --only pi-dropped --only lists-kept
"""

import argparse
import os
import pathlib
import re
import shutil
import signal
import subprocess
import sys
import tomllib

ROOT = pathlib.Path(__file__).resolve().parent.parent
SCRATCH = ROOT / "target" / "faults"
TREE = SCRATCH / "tree"
GLSL = SCRATCH / "glsl"
PAGE = ROOT / "docs" / "notes" / "faults.md"
# Most of the time goes into building: the package alone is built quickly, its dependencies as ever.
CARGO = ["cargo", "--config", "profile.release.package.twobounce.opt-level=1"]
ENVIRONMENT = {**os.environ, "CARGO_TARGET_DIR": str(SCRATCH / "target"), "CARGO_INCREMENTAL": "1"}
# Files that setup.sh fetched are not tracked, so they are not in the copied tree.
ENVIRONMENT.setdefault("SHADERC_LIB_DIR", str(ROOT / ".cache" / "shaderc"))
TEST_SECONDS = 1500
# Tests of texts: the first fails by any fault's text.
NOT_RUN = ["faults_listed::", "docs::"]
NOT_CAUGHT = "NOT CAUGHT"
# Shaders that do not compile, or whose bindings differ from the program's: the program must be built with them.
NOT_TAKEN = "the planted shaders: "


def copy_tree():
    """Copies the tracked files; equal files are left alone, so that they are not built again."""
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, check=True, capture_output=True, text=True).stdout
    files = {name for name in listed.split("\0") if name and (ROOT / name).is_file()}
    for old in [path for path in TREE.rglob("*") if path.is_file()] if TREE.exists() else []:
        if str(old.relative_to(TREE)) not in files:
            old.unlink()
    for name in files:
        to, data = TREE / name, (ROOT / name).read_bytes()
        if not to.exists() or to.read_bytes() != data:
            to.parent.mkdir(parents=True, exist_ok=True)
            to.write_bytes(data)
            to.chmod((ROOT / name).stat().st_mode)


def run(command, seconds=None, more={}):
    """Runs a command; returns exit code and output, without a code where it did not end in time."""
    job = subprocess.Popen(command, cwd=TREE, env={**ENVIRONMENT, **more}, text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                           start_new_session=True)
    try:
        output, _ = job.communicate(timeout=seconds)
        return job.returncode, output
    except subprocess.TimeoutExpired:
        os.killpg(job.pid, signal.SIGKILL)
        return None, job.communicate()[0]
    except KeyboardInterrupt:
        os.killpg(job.pid, signal.SIGKILL)
        raise


def first_failure(test, more={}):
    """The test that fails first in a binary, in one of its files `binary::file`, or in one test `binary::file::test`;
    nothing if all pass. `more`: environment variables."""
    binary, _, name = test.partition("::")
    is_file = name and "::" not in name and binary != "lib"
    chosen_tests = [name + "::"] if is_file else [name, "--exact"] if name else []
    skipped = [word for file in NOT_RUN for word in ("--skip", file)]
    chosen = ["test", "--release", "--locked", "--features", "hot-reload"] + (["--lib"] if binary == "lib" else ["--test", binary])
    code, output = run([*CARGO, *chosen, "--no-run"])
    if code != 0:
        sys.exit(f"{binary} does not build:\n{output[-3000:]}")
    code, output = run([*CARGO, *chosen, "--", *chosen_tests, *skipped], TEST_SECONDS, more)
    if name and "running 0 tests" in output:
        sys.exit(f"there is no test {test}")
    if code == 0:
        return None
    if NOT_TAKEN in output:
        return NOT_TAKEN
    failed = re.findall(r"^test (\S+) \.\.\. FAILED", output, re.MULTILINE)
    if len(failed) > 1:
        print(f"  {binary} fails in {', '.join(failed)}", flush=True)
    return f"{binary}::{failed[0]}" if failed else test if name else f"{binary} ({'hangs' if code is None else 'breaks off'})"


def compiled_shaders():
    """The output of build.rs by path. It is restored with a fault's text, so that code that includes it is not compiled
    again."""
    made = (SCRATCH / "target/release/build").glob("twobounce-*/out/*")
    return {path: path.read_bytes() for path in made if path.suffix in (".spv", ".text")}


def binaries():
    folder = TREE / "tests"
    names = {path.stem for path in folder.glob("*.rs")} | {path.parent.name for path in folder.glob("*/main.rs")}
    # Most faults are in passes.
    return ["lib"] + sorted(names, key=lambda name: (name != "device", name))


def plant(fault, shaders, first_only):
    """Plants a fault and returns the first test that fails; `shaders`: those compiled without the fault."""
    path = TREE / fault["file"]
    text = path.read_text()
    if text.count(fault["find"]) != 1:
        sys.exit(f"{fault['name']}: its text stands {text.count(fault['find'])} times in {fault['file']}, not once")
    changed = text.replace(fault["find"], fault["replace"])
    if fault["file"].startswith("glsl/"):
        shutil.rmtree(GLSL, ignore_errors=True)
        shutil.copytree(TREE / "glsl", GLSL)
        (GLSL / fault["file"].removeprefix("glsl/")).write_text(changed)
        for test in fault["first"]:
            caught = test.startswith("device") and first_failure(test, {"TWOBOUNCE_TEST_GLSL": str(GLSL)})
            if caught and caught != NOT_TAKEN:
                return caught
    path.write_text(changed)
    try:
        rest = [] if first_only else [name for name in binaries() if name not in fault["first"]]
        for test in fault["first"] + rest:
            caught = first_failure(test)
            if caught:
                return caught
        return NOT_CAUGHT
    finally:
        path.write_text(text)
        for made, data in shaders.items():
            if made.read_bytes() != data:
                made.write_bytes(data)


def driver():
    """The driver of the first device that `twobounce info` lists, which tests choose."""
    _, output = run([*CARGO, "run", "--release", "--locked", "--features", "hot-reload", "--quiet", "--", "info"])
    found = re.search(r"^\s.*driver (.+)$", output, re.MULTILINE)
    return found[1] if found else "an unknown driver"


def read_page():
    if not PAGE.exists():
        return {}
    rows = [line.strip("|").split(" | ") for line in PAGE.read_text().splitlines() if line.startswith("| `")]
    return {row[0].strip(" `"): row[-1].strip(" `") for row in rows}


def write_page(faults, caught, device):
    lines = [
        "# Planted faults",
        "",
        "This note lists faults that were planted in shaders and passes, and the test that caught each, for readers who judge the",
        "tests. `make faults` (`scripts/planted-faults.py`) writes it: it plants each fault of `tests/faults/faults.toml` alone in a",
        "copy of the tree, builds it, and runs tests until one fails. That test passes without the fault. `make test` only checks",
        "that every fault can still be planted and has its row (`tests/values/faults_listed.rs`).",
        "",
        f"*Run on {device}.*",
        "",
        "| fault | what is wrong | file | caught by |",
        "|---|---|---|---|",
    ]
    for fault in faults:
        if fault["name"] in caught:
            lines.append(f"| `{fault['name']}` | {fault['wrong']} | `{fault['file']}` | `{caught[fault['name']]}` |")
    PAGE.write_text("\n".join(lines) + "\n")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--list", action="store_true", help="say what there is and plant nothing")
    parser.add_argument("--only", action="append", metavar="NAME", help="this fault; the page keeps its other rows")
    parser.add_argument("--first-only", action="store_true", help="run only the tests that a fault names; write no page")
    options = parser.parse_args()
    faults = tomllib.loads((ROOT / "tests/faults/faults.toml").read_text())["fault"]
    chosen = [fault for fault in faults if not options.only or fault["name"] in options.only]
    unknown = set(options.only or []) - {fault["name"] for fault in faults}
    if unknown:
        sys.exit(f"there is no fault {', '.join(sorted(unknown))}; see --list")
    if options.list:
        for fault in chosen:
            print(f"{fault['name']}: {fault['wrong']}")
        return

    copy_tree()
    device = driver()
    shaders = compiled_shaders()
    caught = read_page() if options.only else {}
    for fault in chosen:
        caught[fault["name"]] = plant(fault, shaders, options.first_only)
        print(f"{fault['name']}: {caught[fault['name']]}", flush=True)
        if not options.first_only:
            write_page(faults, caught, device)
    names = [fault["name"] for fault in chosen]
    wrong = [name for name in names if caught[name] == NOT_CAUGHT]
    # A test that fails without the fault, or because shaders are replaced at run time, catches nothing.
    shutil.rmtree(GLSL, ignore_errors=True)
    shutil.copytree(TREE / "glsl", GLSL)
    for test in sorted({caught[name].split(" ")[0] for name in names if name not in wrong}):
        if first_failure(test, {"TWOBOUNCE_TEST_GLSL": str(GLSL)}):
            wrong += [name for name in names if caught[name].split(" ")[0] == test]
            print(f"{test} fails without a fault too", flush=True)
    if wrong:
        sys.exit(f"not caught: {', '.join(wrong)}")


main()
