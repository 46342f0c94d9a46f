#!/usr/bin/env bash
# Builds the Python package's native part beside the rest, and runs its tests with the system's Python, numpy and pytest.
set -euo pipefail
cd "$(dirname "$0")/../python"
target=${CARGO_TARGET_DIR:-$PWD/../target}
# The interpreter that loads it has Python's symbols: nothing of Python is linked.
export PYO3_BUILD_EXTENSION_MODULE=1

cargo fmt --check
cargo clippy --release --locked --target-dir "$target" -- -D warnings
cargo build --release --locked --target-dir "$target"
package=$target/python/twobounce
rm -rf "$package"
mkdir -p "$package"
cp src/twobounce/* "$package"
cp "$target/release/lib_core.so" "$package/_core.abi3.so"
# Debian's Python is the one that Debian's numpy belongs to.
python=/usr/bin/python3
[ -x "$python" ] || python=python3
PYTHONPATH=$target/python exec "$python" -m pytest -q -p no:cacheprovider
