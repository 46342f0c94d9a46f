#!/bin/sh
# Checks the light of scenes against committed references, with twobounce and without a GPU. docs/ci.md of twobounce explains it.
#
#   light.sh install     Debian's packages, Rust if it is missing, and twobounce from $TWOBOUNCE, a git address or folder, at $REVISION
#   light.sh check       renders scenes/NAME.glb or .gltf and compares with scenes/NAME.exr; 1: a limit is exceeded
#   light.sh reference   path-traces scenes/NAME.exr where there is none: look at it, then commit it
#   light.sh stability   measures where the renderer's methods fail; 1: a number is worse than in twobounce's own table
#
# Beside a scene lie flags: NAME.view of render and reference (size, camera), NAME.render of render alone, NAME.limits of compare.
# $SCENES: the scenes' folder, by default beside this script. $OUT: what is written, by default out/light. $PREFIX: where twobounce lies.
set -eu
here=$(cd "$(dirname "$0")" && pwd)
SCENES=${SCENES:-$here/scenes}
OUT=${OUT:-out/light}
PREFIX=${PREFIX:-/usr/local}
PATH="$PREFIX/bin:${CARGO_HOME:-$HOME/.cargo}/bin:$PATH"

stop() {
  echo "light.sh: $*" >&2
  exit 2
}

install() {
  export DEBIAN_FRONTEND=noninteractive
  apt-get update -q
  apt-get install -y -q --no-install-recommends ca-certificates curl git libvulkan1 mesa-vulkan-drivers
  if [ -x "$PREFIX/bin/twobounce" ]; then return; fi # such as from a cache
  [ -n "${TWOBOUNCE:-}" ] || stop "set TWOBOUNCE to the git address or folder of twobounce's source"
  if ! command -v cargo >/dev/null; then
    curl --proto '=https' --tlsv1.2 -sSf -o /tmp/rustup-init "https://static.rust-lang.org/rustup/dist/$(uname -m)-unknown-linux-gnu/rustup-init"
    chmod +x /tmp/rustup-init
    /tmp/rustup-init -y -q --profile minimal
  fi
  source=$(mktemp -d)
  git clone -q "$TWOBOUNCE" "$source"
  (cd "$source" && git checkout -q "${REVISION:-HEAD}" && scripts/setup.sh demo && cargo install -q --locked --no-default-features --path . --root "$PREFIX")
  mkdir -p "$PREFIX/share/twobounce"
  cp "$source/tests/stability/quick.csv" "$PREFIX/share/twobounce/stability.csv"
  rm -rf "$source"
}

# Calls `$1 NAME SCENE` for every scene; remembers the worst exit code.
for_each_scene() {
  worst=0
  found=false
  for scene in "$SCENES"/*.glb "$SCENES"/*.gltf; do
    [ -e "$scene" ] || continue
    found=true
    name=$(basename "${scene%.*}")
    echo "== $name"
    code=0
    "$1" "$name" "$scene" || code=$?
    [ "$code" -le "$worst" ] || worst=$code
  done
  $found || stop "no .glb or .gltf is in $SCENES"
  exit "$worst"
}

# The words of a file, which may be missing: flags.
flags() {
  [ ! -e "$1" ] || cat "$1"
}

check_one() {
  [ -e "$SCENES/$1.exr" ] || { echo "light.sh: $SCENES/$1.exr is missing; make it with: light.sh reference" >&2; return 2; }
  [ -s "$SCENES/$1.limits" ] || { echo "light.sh: $SCENES/$1.limits is missing; write limits of twobounce compare into it, such as --max-rel 0.1" >&2; return 2; }
  mkdir -p "$OUT/$1"
  # shellcheck disable=SC2046
  twobounce render "$2" -o "$OUT/$1/now.exr" --aov direct --noise off $(flags "$SCENES/$1.view") $(flags "$SCENES/$1.render") &&
    twobounce compare "$OUT/$1/now.exr" "$SCENES/$1.exr" --json "$OUT/$1/compare.json" --out "$OUT/$1" $(flags "$SCENES/$1.limits")
}

reference_one() {
  if [ -e "$SCENES/$1.exr" ]; then echo "$SCENES/$1.exr is there"; return; fi
  # shellcheck disable=SC2046
  twobounce reference "$2" -o "$SCENES/$1.exr" --noise 2 --aov direct,diffuse $(flags "$SCENES/$1.view")
}

stability() {
  twobounce stability --quick -o "$OUT/stability" --against "$PREFIX/share/twobounce/stability.csv"
}

case ${1:-} in
  install) install ;;
  check) for_each_scene check_one ;;
  reference) for_each_scene reference_one ;;
  stability) stability ;;
  *) stop "say what to do: install, check, reference or stability" ;;
esac
