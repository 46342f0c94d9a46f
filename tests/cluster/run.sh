#!/usr/bin/env bash
# Runs each recipe of docs/cluster.md as printed, with two workers on this machine, and kills each part in the middle. Then the same lines again must
# continue it, repeat nothing that was finished, and find the rows that one process finds. Leaves the charts in out/cluster.
# Usage: run.sh [parallel|slurm|hyperqueue]...
set -euo pipefail
cd "$(dirname "$0")/../.."
root=$PWD
export PATH="$root/target/release:$PATH"
rm -rf out/cluster
mkdir -p out/cluster
cd out/cluster
export TWOBOUNCE_CACHE=$PWD/cache
chart="chart scene.glb --size 64x64 --set voxels=32 --presets fast,printed --sweep $(seq -s, 1 24 | sed 's/^/rays.diffuse=/') --reference-noise 20"

# The lines of a recipe: the first block below a heading of docs/cluster.md, for a small chart.
recipe() {
  awk -v heading="## $1" '$0 == heading { inside = 1 } inside && /^```$/ { exit } block { print } inside && /^```sh$/ { block = 1 }' "$root/docs/cluster.md" |
    sed "s|chart scene.glb|$chart|"
}

# Parts of a chart that do not depend on the moment: keys, names and errors.
lasting() {
  python3 - "$1" <<'END'
import json, sys
for row in json.load(open(sys.argv[1] + "/rows.json"))["rows"]:
    print(row["key"], row["name"], row["measured"]["full"], row["measured"]["same"])
END
}

# Ends every part once, as soon as it has kept a row, while process $1 lives. `harm PID` says how.
end_parts() {
  local pid part ended=" "
  while kill -0 "$1" 2>/dev/null; do
    for pid in $(pgrep -x twobounce); do
      [ "$(readlink "/proc/$pid/cwd")" = "$PWD" ] || continue
      part=$(cat "/proc/$pid/cmdline" 2>/dev/null | tr "\0" "\n" | grep -x "out\.[0-9]*") || continue
      if [[ $ended != *" $part "* ]] && ls "$part"/rows/*.toml >/dev/null 2>&1; then
        harm "$pid" || continue
        ended+="$part "
      fi
    done
    sleep 0.01
  done
}

harm() { kill -9 "$1"; }

# Runs the recipe $1 in the folder $2 while its parts are ended, then once more.
engine() {
  mkdir "$2"
  cd "$2"
  cp "$root/assets/cornell-point.glb" scene.glb
  recipe "$1" > recipe.sh
  test -s recipe.sh
  bash -e recipe.sh > first.log 2>&1 &
  end_parts $!
  if wait $!; then echo "$1: the recipe did not say that parts were killed" >&2; exit 1; fi
  test ! -e out || { echo "$1: merged although parts failed" >&2; exit 1; }
  md5sum out.*/rows/*.toml > before
  bash -e recipe.sh > second.log 2>&1 || { cat second.log >&2; exit 1; }
  md5sum --check --quiet before
  lasting out > lasting
  cmp ../whole.lasting lasting
  test "$(wc -l < before)" -lt "$(wc -l < lasting)" || { echo "$1: no part was killed before its end" >&2; exit 1; }
  echo "$1: $(wc -l < lasting) rows, the same as of one process; $(wc -l < before) were kept when all parts had been killed"
  cd ..
}

cp "$root/assets/cornell-point.glb" scene.glb
# shellcheck disable=SC2086
twobounce $chart -q -o whole
lasting whole > whole.lasting

[ $# -gt 0 ] || set -- parallel slurm hyperqueue
for name; do
  # shellcheck source=/dev/null
  (. "$root/tests/cluster/$name.sh")
done
