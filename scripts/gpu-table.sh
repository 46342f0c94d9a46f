#!/usr/bin/env bash
# Measures every pass of the presets on the machine's device, and how far their images are from the path tracer's. Leaves
# FOLDER/gpu.json and FOLDER/gpu.md, the tables of docs/gpu.md. In four minutes at most; a run for which no time is left is a dash.
#
#   scripts/gpu-table.sh [-o FOLDER] [--atrium SCENE] [--device NAME]
set -euo pipefail
cd "$(dirname "$0")/.."
scripts/setup.sh demo
cargo build --release --locked
exec python3 scripts/gpu-table.py "$@"
