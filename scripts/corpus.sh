#!/usr/bin/env bash
# Renders small images of all .gltf and .glb files under a folder. Writes out/corpus/tally.md, with the result for each file and
# its reason, and a contact sheet. Fails if twobounce crashes, hangs or gives no one-sentence message for a file.
# Usage: corpus.sh DIR [further flags for twobounce render]
set -euo pipefail
if [ $# -lt 1 ] || [ ! -d "$1" ]; then
  echo "usage: corpus.sh DIR [flags for twobounce render]; DIR is a folder of .gltf and .glb files" >&2
  exit 2
fi
models=$(cd "$1" && pwd)
shift
cd "$(dirname "$0")/.."
out=out/corpus
seconds=120
columns=16
rm -rf "$out"
mkdir -p "$out/images"

declare -A count=([rendered]=0 [refused]=0 [failed]=0)
rows=()
images=()
while IFS= read -r -d '' file; do
  name=${file#"$models"/}
  image=$out/images/$(printf '%04d' ${#rows[@]}).png
  start=$(date +%s.%N)
  status=0
  said=$(timeout --kill-after=10 "$seconds" target/release/twobounce render "$file" -o "$image" --size 96x96 --set voxels=32 --noise off "$@" \
    2>&1 >/dev/null) || status=$?
  took=$(awk "BEGIN { printf \"%.1f\", $(date +%s.%N) - $start }")
  case $status in
    0) result=rendered ;;
    2) result=refused ;;
    124 | 137) result=failed said="not finished after $seconds s" ;;
    *) result=failed ;;
  esac
  # A refusal prints one sentence and writes no image.
  if [ $result = refused ] && { [ "$(wc -l <<<"$said")" -ne 1 ] || [ -z "$said" ] || [ -e "$image" ]; }; then result=failed; fi
  cell=
  if [ $result = rendered ]; then
    cell="$((${#images[@]} / columns + 1)), $((${#images[@]} % columns + 1))"
    images+=("$image")
  fi
  count[$result]=$((count[$result] + 1))
  said=${said//"$models"\//}
  rows+=("| \`$name\` | $result | $took | $cell | $(tr '\n|' ' /' <<<"$said") |")
  echo "$result ${took}s $name"
done < <(find "$models" \( -iname '*.gltf' -o -iname '*.glb' \) -print0 | sort -z)

{
  echo "# ${#rows[@]} files: ${count[rendered]} rendered, ${count[refused]} refused, ${count[failed]} failed"
  echo
  echo "A cell is a row and a column of the contact sheet."
  echo
  echo "| file | result | seconds | cell | message |"
  echo "|---|---|---|---|---|"
  printf '%s\n' "${rows[@]}"
} >"$out/tally.md"
head -n 1 "$out/tally.md"
echo "The tally: $out/tally.md"

if ! command -v montage >/dev/null; then
  echo "No contact sheet: it needs ImageMagick (apt-get install imagemagick)"
elif [ ${#images[@]} -gt 0 ]; then
  montage "${images[@]}" -tile "${columns}x" -geometry 96x96+2+2 -background '#202020' "$out/sheet.png"
  echo "The contact sheet: $out/sheet.png"
fi
[ "${count[failed]}" -eq 0 ]
