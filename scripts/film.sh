#!/bin/sh
# Makes docs/demo.png: six images of the demo side by side. Asks for ImageMagick.
set -eu
cd "$(dirname "$0")/.."
frames=$(mktemp -d)
trap 'rm -rf "$frames"' EXIT
cargo build --release --locked
target/release/twobounce demo -o "$frames/%d.png" --fps 0.5 --size 320x180 --preset balanced
convert "$frames"/[0-2].png +append "$frames/above.png"
convert "$frames"/[3-5].png +append "$frames/below.png"
convert "$frames/above.png" "$frames/below.png" -append -strip docs/demo.png
