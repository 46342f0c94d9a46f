#!/usr/bin/env bash
# Looks through the dependencies of Cargo.lock: cargo-deny for licences and sources (deny.toml), cargo-audit for known faults.
# A part that this machine or its network does not allow is named in a sentence, and the others are run.
# Usage: audit.sh
set -euo pipefail
cd "$(dirname "$0")/.."
database=https://github.com/RustSec/advisory-db
status=0

if command -v cargo-deny >/dev/null; then
  cargo deny --locked check licenses bans sources || status=1
  cargo deny --locked --manifest-path python/Cargo.toml check --config python/deny.toml licenses bans sources || status=1
else
  echo "audit: cargo-deny is missing, so nobody looked at licences and sources; scripts/setup.sh audit installs it" >&2
fi
if ! command -v cargo-audit >/dev/null; then
  echo "audit: cargo-audit is missing, so nobody looked for known faults; scripts/setup.sh audit installs it" >&2
elif ! timeout 60 git ls-remote --quiet "$database" HEAD >/dev/null 2>&1; then
  echo "audit: $database cannot be reached from here, so nobody looked for known faults; run make audit where it can" >&2
else
  cargo audit || status=1
  cargo audit --file python/Cargo.lock || status=1
fi
exit $status
