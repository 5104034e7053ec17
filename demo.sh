#!/usr/bin/env bash
# The whole way from a scene and a light to relit pictures, their errors and their times.
#
#   ./demo.sh            as root, or as a user with sudo; Debian 12
#
# Installs packages, builds, makes a potted plant and an interior light, precomputes the plant's
# transport, turns the light with NWA, BI and PBI at 30 wavelets and with the full reference, and
# leaves pictures, strips, metrics.csv and a plot in out/demo/. What is there already and newer than
# what it is made from is kept, so a second run takes seconds.
#
# Environment: BUILD_DIR (build), OUT_DIR (out/demo), JOBS (number of cores), SPP (2; shadow rays a
# texel of light where visibility changes: 4 takes longer and draws finer edges).
set -euo pipefail
cd "$(dirname "$0")"
export DEBIAN_FRONTEND=noninteractive
build=${BUILD_DIR:-build}
out=${OUT_DIR:-out/demo}
jobs=${JOBS:-$(nproc)}
spp=${SPP:-2}
wavelets=30
frames=130 stop=99
shown=0,30,75,99,104,124
methods=(nwa bi pbi reference)

started=$SECONDS step_started=$SECONDS step_name=
end_step() {
  [ -z "$step_name" ] || printf '   (%d s)\n' $((SECONDS - step_started))
  step_name=
}
step() {
  end_step
  step_name=$1 step_started=$SECONDS
  printf '\n== %s\n' "$1"
}
die() {
  echo "demo.sh: $1" >&2
  exit 1
}

# made FILE COMMAND-TEXT INPUT...: is FILE there, made by this very command, after all its inputs?
# The command that made FILE is kept in FILE.made, which is written last: a run that was cut off
# leaves none.
made() {
  local file=$1 text=$2 input
  shift 2
  [ -e "$file" ] && [ -e "$file.made" ] && [ "$(cat "$file.made")" = "$text" ] || return 1
  for input in "$@"; do
    if [ ! -e "$input" ] || [ "$input" -nt "$file.made" ]; then return 1; fi
  done
}

# make FILE "INPUT..." COMMAND...: runs COMMAND unless FILE is made already.
make() {
  local file=$1 inputs
  read -ra inputs <<<"$2"
  shift 2
  if made "$file" "$*" "${inputs[@]}"; then
    echo "$file is up to date."
    return
  fi
  rm -f "$file.made"
  "$@" || die "this command failed: $*"
  printf '%s\n' "$*" >"$file.made"
}

find_python() {
  local candidate
  for candidate in /usr/bin/python3 python3; do
    if "$candidate" -c 'import numpy, matplotlib' 2>/dev/null; then
      echo "$candidate"
      return
    fi
  done
  die "no python3 that can import numpy and matplotlib, wanted Debian's python3-matplotlib"
}

step "Packages"
scripts/install_packages.sh build demo
end_step
packages_time=$((SECONDS - started))

step "Build"
cmake -S . -B "$build" -G Ninja -DCMAKE_BUILD_TYPE=Release -DHAARLIGHT_BUILD_TESTS=OFF \
  -DHAARLIGHT_BUILD_BENCH=OFF >"$build.log" 2>&1 || { cat "$build.log" >&2; die "configuring failed"; }
rm -f "$build.log"
cmake --build "$build" -j "$jobs" --target haarlight haarlight-data
haarlight=$build/bin/haarlight data=$build/bin/haarlight-data
python=$(find_python)
mkdir -p "$out"

step "Scene and environment"
scene=$out/plant.glb light=$out/gallery.exr
make "$scene" "$data" "$data" scene plant -o "$scene"
make "$light" "$data" "$data" environment gallery -o "$light"

step "Plan: which effects a room calls for, and why"
room=$out/room.glb plan=$out/room_plan.txt
make "$room" "$data" "$data" scene room -o "$room"
make "$plan" "$haarlight $room" \
  bash -c '"$0" plan "$1" --size 160x120 --face 32 >"$2"' "$haarlight" "$room" "$plan"
cat "$plan"

# The plant alone, with direct light: what a few minutes are enough for at this size.
step "Precompute: 512 x 512 pixels, light on 6 x 64 x 64 texels"
transport=$out/plant.hlt
# The file's own checksums say whether it is whole.
if [ -e "$transport" ] && ! "$haarlight" info "$transport" >/dev/null; then rm -f "$transport.made"; fi
make "$transport" "$scene $build/precompute/libhaarlight_precompute.a" \
  "$haarlight" precompute "$scene" -o "$transport" --size 512x512 --face 64 --spp "$spp" \
  --effects shadows,color --resume

step "Relight: the light turns by 90 degrees, faster and faster, and rests from frame $stop on"
tables=()
for method in "${methods[@]}"; do
  folder=$out/$method table=$out/$method.csv
  tables+=("$table")
  compare=(--against-reference)
  if [ "$method" = reference ]; then compare=(); fi
  make "$table" "$haarlight $transport $light" \
    "$haarlight" relight "$transport" --env "$light" -o "$folder" --motion rotate --degrees 90 \
    --frames $frames --stop $stop --method "$method" --wavelets $wavelets --weight area \
    --save-frames $shown --metrics "$table" "${compare[@]}"
done

step "Plot, strips and table"
columns=("NWA-$wavelets=$out/nwa" "BI-$wavelets=$out/bi" "PBI-$wavelets=$out/pbi"
  "reference=$out/reference")
strip_inputs="${tables[*]} scripts/contact_strip.py"
make "$out/strip_moving.png" "$strip_inputs" \
  "$python" scripts/contact_strip.py "${columns[@]}" --frames 30,75 --width 320 \
  --title "the light turns" -o "$out/strip_moving.png"
make "$out/strip_stopped.png" "$strip_inputs" \
  "$python" scripts/contact_strip.py "${columns[@]}" --frames 99,104,124 --width 320 \
  --title "the light rests from frame $stop on" -o "$out/strip_stopped.png"
"$python" scripts/plot_metrics.py "${tables[@]}" --stop $stop --merged "$out/metrics.csv" \
  --title "plant under gallery, light turning by 90 degrees" -o "$out/error_over_time.png"
end_step

printf '\nIn %s: frames in nwa/ bi/ pbi/ reference/ (EXR and PNG), strip_moving.png,\n' "$out"
printf 'strip_stopped.png, error_over_time.png, metrics.csv, room_plan.txt.\n'
printf 'Took %d s after package installation (%d s).\n' \
  $((SECONDS - started - packages_time)) "$packages_time"
