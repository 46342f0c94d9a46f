#!/usr/bin/env bash
# Renders the gallery and a Cornell box on the system's driver and on Mesa 25, and compares the images.
# Bit-identical is the aim; what differs is printed with its size. Usage: compare-drivers.sh
set -euo pipefail
cd "$(dirname "$0")/.."
out=out/drivers
mkdir -p "$out"
differing=0
for scene in gallery cornell-area cornell-point; do
  for preset in corrected printed; do
    name=$scene-$preset
    render=(target/release/twobounce render "assets/$scene.glb" --size 128x128 --set voxels=32 --preset "$preset")
    scripts/guard.sh 120 "${render[@]}" -o "$out/$name-system.exr" >/dev/null
    scripts/guard.sh 120 scripts/mesa25.sh "${render[@]}" -o "$out/$name-mesa25.exr" >/dev/null
    target/release/twobounce compare "$out/$name-mesa25.exr" "$out/$name-system.exr"
  done
done
