#!/usr/bin/env bash
# Renders six images of the demo, two seconds apart and of 8 passes each, into docs/demo.png, a picture of docs/usage.md.
# Needs ImageMagick. Usage: film.sh
set -euo pipefail
cd "$(dirname "$0")/.."
command -v montage >/dev/null || { echo "film.sh needs ImageMagick (apt-get install imagemagick)" >&2; exit 2; }
out=out/film
mkdir -p "$out"
target/release/twobounce demo -o "$out/%d.png" --fps 0.5 --size 320x180 --preset balanced --set image.passes=8
montage "$out"/[0-5].png -tile 3x -geometry 320x180+2+2 -background white -depth 8 -strip docs/demo.png
echo "wrote docs/demo.png"
