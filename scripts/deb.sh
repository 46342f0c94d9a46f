#!/usr/bin/env bash
# Builds the program and what belongs to it, and packs them: out/twobounce_*.deb. One state of the sources gives one package, byte by byte.
# Usage: deb.sh
set -euo pipefail
cd "$(dirname "$0")/.."
export PATH="$PATH:${CARGO_HOME:-${HOME:-}/.cargo}/bin"
# The time that files in the package have: that of the last commit, or of the changes where there is no repository.
SOURCE_DATE_EPOCH=${SOURCE_DATE_EPOCH:-$(git log -1 --format=%ct 2>/dev/null || stat -c %Y CHANGELOG.md)}
export SOURCE_DATE_EPOCH

cargo build --release --locked --bin twobounce
program=${CARGO_TARGET_DIR:-target}/release/twobounce
parts=out/deb
rm -rf "$parts"
mkdir -p "$parts/man"
"$program" man "$parts/man"
for shell in bash zsh fish; do
  "$program" completions "$shell" > "$parts/twobounce.$shell"
done
cargo deb --no-build --locked --output out/
