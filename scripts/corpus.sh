#!/bin/sh
# Renders every .gltf and .glb below a folder and writes what became of each.
#
#   scripts/corpus.sh FOLDER OUT [flags of `twobounce render` …]
#
# OUT/tally.tsv: outcome (rendered, refused, failed), seconds, file, and the reason or the notes.
# OUT/index.html: a contact sheet of the same. Exits 1 if anything failed: a crash, a hang, or an exit code that is
# neither 0 (done) nor 2 (refused in one sentence).
set -eu
if [ $# -lt 2 ]; then
    echo "usage: scripts/corpus.sh FOLDER OUT [flags of twobounce render]" >&2
    exit 2
fi
folder=$1 out=$2
shift 2
program=${TWOBOUNCE:-target/release/twobounce}
seconds_max=${SECONDS_MAX:-120}
mkdir -p "$out"
tally=$out/tally.tsv sheet=$out/index.html
: >"$tally"
cat >"$sheet" <<'END'
<!doctype html><meta charset="utf-8"><title>Contact sheet</title>
<style>body{font:12px sans-serif;background:#222;color:#ddd;display:flex;flex-wrap:wrap;gap:8px}
figure{margin:0;width:256px}img{width:256px}.refused{color:#fb6}.failed{color:#f66;font-weight:bold}</style>
END

escape() { sed 's/&/\&amp;/g; s/</\&lt;/g; s/>/\&gt;/g'; }

number=0
find "$folder" -type f \( -iname '*.gltf' -o -iname '*.glb' \) | LC_ALL=C sort >"$out/files"
while IFS= read -r file; do
    number=$((number + 1))
    image=$(printf '%03d.png' "$number")
    rm -f "$out/$image"
    start=$(date +%s)
    code=0
    timeout "$seconds_max" "$program" render "$file" -o "$out/$image" "$@" >"$out/log" 2>&1 </dev/null || code=$?
    seconds=$(($(date +%s) - start))
    case $code in
    0) outcome=rendered said=$(grep 'note:' "$out/log" || true) ;;
    2) outcome=refused said=$(grep -v 'note:' "$out/log" | tail -n 1) ;;
    *) outcome=failed said="exit code $code: $(tail -n 1 "$out/log")" ;;
    esac
    # A refusal is one sentence and leaves no image; a success leaves one.
    if [ $code -eq 0 ] && [ ! -s "$out/$image" ]; then outcome=failed said="no image was written"; fi
    if [ $code -eq 2 ] && [ -e "$out/$image" ]; then outcome=failed said="refused, but wrote an image"; fi
    said=$(printf '%s' "$said" | tr '\n\t' '; ')
    name=${file#"$folder"/}
    printf '%s\t%s\t%s\t%s\n' "$outcome" "$seconds" "$name" "$said" >>"$tally"
    {
        printf '<figure class="%s">' "$outcome"
        if [ "$outcome" = rendered ]; then printf '<img src="%s" alt="">' "$image"; fi
        printf '<figcaption>%s<br>%s</figcaption></figure>\n' "$(printf '%s' "$name" | escape)" "$(printf '%s' "$said" | escape)"
    } >>"$sheet"
done <"$out/files"
rm -f "$out/log" "$out/files"

for outcome in rendered refused failed; do
    printf '%s: %s\n' "$outcome" "$(grep -c "^$outcome" "$tally" || true)"
done
! grep -q '^failed' "$tally"
