#!/usr/bin/env bash
# Installs what is missing, builds everything and runs all tests. CTest's summary comes last.
#
#   ./test.sh [CTest options]        as ./test.sh -R Projection, or ./test.sh -L wavelet
#
# Environment: BUILD_DIR (build), JOBS (number of cores), CI (set: warnings are errors).
set -euo pipefail
cd "$(dirname "$0")"
export DEBIAN_FRONTEND=noninteractive
build=${BUILD_DIR:-build}
jobs=${JOBS:-$(nproc)}

echo "== Packages"
scripts/install_packages.sh build test

echo "== Build"
options=(-DHAARLIGHT_BUILD_TESTS=ON -DHAARLIGHT_BUILD_BENCH=ON)
if [ -n "${CI:-}" ]; then options+=(-DHAARLIGHT_WERROR=ON); fi
cmake -S . -B "$build" -G Ninja "${options[@]}"
cmake --build "$build" -j "$jobs"

echo "== Tests"
exec ctest --test-dir "$build" --output-on-failure --no-tests=error -j "$jobs" "$@" </dev/null
