#!/usr/bin/env bash
# Makes a small chart of two scenes, one setting of which does not fit, as two machines' parts; and a small table of stability; tests
# their pages in a browser. Leaves them and screenshots in out/web.
set -euo pipefail
cd "$(dirname "$0")/../.."
rm -rf out/web
mkdir -p out/web
chart() {
  target/release/twobounce chart assets/cornell-area.glb assets/cornell-point.glb \
    --size 64x64 --set voxels=16 --presets fast,printed --sweep cones.set=g6 --sweep rays.diffuse=1,32 --sweep voxels=64 \
    --memory-limit 24MiB --reference-noise 5 --paths 1,4 "$@"
}
chart -o out/web/chart --label first
# The rows again, as another build would make them: the rows that the first one measured become history.
for row in out/web/chart/rows/*.toml; do
  sed -i 's/^program = "[0-9a-f]\{64\}"/program = "0000000000000000000000000000000000000000000000000000000000000000"/' "$row"
done
chart -o out/web/chart --label second --history
python3 tests/web/chart_page.py out/web/chart/index.html out/web
chart -o out/web/part.1 --shard 1/2 --machine anna
chart -o out/web/part.2 --shard 2/2 --machine bert
target/release/twobounce merge out/web/part.1 out/web/part.2 -o out/web/merged
python3 tests/web/machines_page.py out/web/merged/index.html out/web
python3 tests/web/follow_page.py out/web
target/release/twobounce stability -o out/web/stability --quick --case leak-1/2,self-light-plane,slide --preset fast,cones --grid 32,64
python3 tests/web/stability_page.py out/web/stability/index.html out/web
