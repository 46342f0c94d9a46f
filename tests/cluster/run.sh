#!/usr/bin/env bash
# Runs docs/cluster.md's recipe for GNU parallel with two workers, one of which is killed in the middle. Leaves the chart in out/cluster.
set -euo pipefail
cd "$(dirname "$0")/../.."
export PATH="$PWD/target/release:$PATH"
scene=$PWD/assets/cornell-point.glb
rm -rf out/cluster
mkdir -p out/cluster
cd out/cluster
export TWOBOUNCE_CACHE=$PWD/cache
chart() { twobounce chart "$scene" --size 24x24 --set voxels=32 --presets fast,printed --sweep rays.diffuse=1,2,3,4 --reference-noise 20 -q "$@"; }
twobounce chart "$scene" --size 24x24 --set voxels=32 --presets fast,printed --sweep rays.diffuse=1,2,3,4 --reference-noise 20 -o out --list 4 > jobs
work() { parallel --will-cite --jobs 2 --joblog log "$@" < jobs; }
work &
# The first worker that has a row dies in the middle of its next one.
until pid=$(pgrep -P "$(pgrep -P $! -d, || echo 0)" -x twobounce | head -1; ) && ls out.*/rows/*.json >/dev/null 2>&1; do sleep 0.02; done
kill -9 "$pid" 2>/dev/null || true
wait || true
md5sum out.*/rows/*.json > before
work --resume-failed
md5sum --check --quiet before
twobounce merge out.* -o out
chart -o whole
for name in whole out; do
  python3 - "$name" > "$name.lasting" <<'END'
import json, sys
for row in json.load(open(sys.argv[1] + "/rows.json"))["rows"]:
    print(row["key"], row["name"], row["measured"]["full"], row["measured"]["same"])
END
done
cmp whole.lasting out.lasting
echo "GNU parallel: $(wc -l < out.lasting) rows, the same as of one process"
