#!/usr/bin/env bash
# Runs the small tests under valgrind: reads of what was never written, leaks, wild accesses.
#
#   scripts/valgrind.sh [BUILD_DIR]       (build; needs the packages of group `check`)
#
# Exit code 1 if valgrind reports anything. Long tests, and those that start other programs, are left
# to the sanitizers: valgrind is thirty times slower than they.
set -euo pipefail
cd "$(dirname "$0")/.."
build=${1:-build}
tests=(core_atomic_file core_image_metrics core_parallel wavelet_top_k prt_motion_file prt_metrics_csv
  prt_tonemap)
failed=0
for name in "${tests[@]}"; do
  binary=$build/bin/test_$name
  if [ ! -x "$binary" ]; then
    echo "valgrind.sh: $binary is not there, expected a build with tests" >&2
    exit 1
  fi
  if OMP_NUM_THREADS=2 OMP_WAIT_POLICY=passive valgrind --quiet --error-exitcode=9 --leak-check=full \
    --show-leak-kinds=definite --errors-for-leak-kinds=definite \
    "$binary" --gtest_brief=1 >"$build/valgrind_$name.log" 2>&1; then
    echo "clean   $name"
  else
    echo "REPORT  $name: $build/valgrind_$name.log"
    failed=1
  fi
done
exit "$failed"
