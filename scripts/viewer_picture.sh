#!/usr/bin/env bash
# Makes the picture of the viewer's window for the docs, under a virtual display.
#
#   scripts/viewer_picture.sh FILE.hlt ENVIRONMENT OUT.png      (build/bin/haarlight-view must be there)
set -euo pipefail
if [ $# -ne 3 ]; then
  echo "viewer_picture.sh: expected FILE.hlt ENVIRONMENT OUT.png" >&2
  exit 2
fi
view=$(dirname "$0")/../build/bin/haarlight-view
script=$(mktemp)
trap 'rm -f "$script"' EXIT
cat >"$script" <<END
wait 30
click add lamp
drag 0.62 0.2 0.62 0.2 map
key c
settle
key space
wait 240
shot $3
close
END
xvfb-run -a -s "-screen 0 1600x1200x24" "$view" "$1" --env "$2" --motion tumble --wavelets 100 \
  --size 1280x800 --no-memory --script "$script"
