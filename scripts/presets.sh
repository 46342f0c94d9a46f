#!/usr/bin/env bash
# Renders the gallery with every preset and by path tracing with unlimited bounces, into docs/presets.png and docs/methods/,
# the pictures of docs/methods.md.
# Needs ImageMagick. Usage: presets.sh
set -euo pipefail
cd "$(dirname "$0")/.."
command -v montage >/dev/null || { echo "presets.sh needs ImageMagick (apt-get install imagemagick)" >&2; exit 2; }
out=out/presets
size=256
mkdir -p "$out"
twobounce=target/release/twobounce
"$twobounce" reference assets/gallery.glb -o "$out/truth.exr" --size "${size}x$size" --noise 8 --depth full
tiles=()
for preset in printed corrected corrected-16 cones photons-printed photons lpv-printed lpv fast balanced accurate probes; do
  "$twobounce" render assets/gallery.glb -o "$out/$preset.exr" --size "${size}x$size" --preset "$preset" --set voxels=64 --noise off
  # The first panel of compare.png is the image, the second the truth, both with the exposure of the truth.
  "$twobounce" compare "$out/$preset.exr" "$out/truth.exr" --out "$out/$preset"
  convert "$out/$preset/compare.png" -crop "${size}x$size+0+0" +repage "$out/$preset.png"
  [ "$preset" = probes ] || tiles+=(-label "$preset" "$out/$preset.png")
done
# The method `paths` converges to the path-traced image; its picture shows it with noise.
"$twobounce" render assets/gallery.glb -o "$out/paths.exr" --size "${size}x$size" --preset paths --time-limit 150s
"$twobounce" compare "$out/paths.exr" "$out/truth.exr" --out "$out/paths"
convert "$out/paths/compare.png" -crop "${size}x$size+0+0" +repage "$out/paths.png"
convert "$out/accurate/compare.png" -crop "${size}x$size+$size+0" +repage "$out/truth.png"
tiles+=(-label "path-traced, all light" "$out/truth.png" -label probes "$out/probes.png" -label paths "$out/paths.png")
montage "${tiles[@]}" -tile 4x -geometry "${size}x$size+3+3" -background white -depth 8 docs/presets.png
# Parts of the picture for the section of each method; a tile has 262x281 pixels with its label.
mkdir -p docs/methods
while read -r method part; do
  convert docs/presets.png -crop "$part" +repage -depth 8 -strip "docs/methods/$method.png"
done <<END
rays 786x281+0+562
cones 1048x281+0+0
photons 524x281+0+281
lpv 524x281+524+281
END
montage -label probes "$out/probes.png" -geometry "${size}x$size+3+3" -background white -depth 8 -strip docs/methods/probes.png
montage -label paths "$out/paths.png" -label "path-traced, all light" "$out/truth.png" -tile 2x -geometry "${size}x$size+3+3" \
  -background white -depth 8 -strip docs/methods/paths.png
echo "wrote docs/presets.png and docs/methods/"
