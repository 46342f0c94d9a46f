#!/usr/bin/env bash
# Makes a small chart of two scenes, one setting of which does not fit, and a small table of stability; tests their pages in a browser.
# Leaves them and screenshots in out/web.
set -euo pipefail
cd "$(dirname "$0")/../.."
rm -rf out/web
mkdir -p out/web
target/release/twobounce chart assets/cornell-area.glb assets/cornell-point.glb -o out/web/chart \
  --size 64x64 --set voxels=16 --presets fast,printed --sweep cones.set=g6 --sweep rays.diffuse=1,32 --sweep voxels=64 \
  --memory-limit 24MiB --reference-noise 5
python3 tests/web/chart_page.py out/web/chart/index.html out/web
target/release/twobounce stability -o out/web/stability --quick --case leak-1/2,self-light-plane,slide --preset fast,cones --grid 32,64
python3 tests/web/stability_page.py out/web/stability/index.html out/web
