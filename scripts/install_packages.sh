#!/usr/bin/env bash
# Installs the Debian packages that Haarlight needs, those that are missing only.
#
#   scripts/install_packages.sh [build] [demo] [test]      (nothing: these three)
#   scripts/install_packages.sh check                      (for sanitizers, fuzzers and valgrind)
#
# As root, or as a user with sudo. Debian 12; asks no questions.
set -euo pipefail

# openimageio-tools: Debian's CMake files of OpenImageIO name its programs and do not load without.
build=(g++ cmake ninja-build pkg-config libopenimageio-dev openimageio-tools libopenexr-dev
  libimath-dev libeigen3-dev libassimp-dev libembree-dev libtbb-dev libcli11-dev nlohmann-json3-dev
  libspdlog-dev libfmt-dev libzstd-dev libxxhash-dev libopenmpi-dev openmpi-bin libglfw3-dev libepoxy-dev libimgui-dev
  libstb-dev fonts-dejavu-core)
demo=(python3 python3-numpy python3-matplotlib)
test=(patch python3 python3-numpy python3-matplotlib libgtest-dev librapidcheck-dev libbenchmark-dev
  xvfb xauth libgl1-mesa-dri libgl1 assimp-testmodels)

check=(clang libclang-rt-14-dev libomp-dev valgrind)

groups=("$@")
if [ ${#groups[@]} -eq 0 ]; then groups=(build demo test); fi
wanted=()
for group in "${groups[@]}"; do
  case "$group" in
    build) wanted+=("${build[@]}") ;;
    demo) wanted+=("${demo[@]}") ;;
    test) wanted+=("${test[@]}") ;;
    check) wanted+=("${check[@]}") ;;
    *)
      echo "install_packages.sh: group '$group' is not known, wanted build, demo, test or check" >&2
      exit 2
      ;;
  esac
done

missing=()
for package in "${wanted[@]}"; do
  case " ${missing[*]-} " in *" $package "*) continue ;; esac
  status=$(dpkg-query -W -f='${db:Status-Status}' "$package" 2>/dev/null || true)
  [ "$status" = installed ] || missing+=("$package")
done
if [ ${#missing[@]} -eq 0 ]; then
  echo "All packages are there."
  exit 0
fi

as_root=()
if [ "$(id -u)" -ne 0 ]; then
  if ! command -v sudo >/dev/null; then
    echo "install_packages.sh: packages are missing (${missing[*]}): run as root, or install sudo" >&2
    exit 1
  fi
  as_root=(sudo)
  # Without a terminal nobody can type a password: fail instead of waiting.
  [ -t 0 ] || as_root=(sudo -n)
fi
echo "Installing: ${missing[*]}"
as_root+=(env DEBIAN_FRONTEND=noninteractive)
"${as_root[@]}" apt-get -q update </dev/null
"${as_root[@]}" apt-get -qq install -y --no-install-recommends "${missing[@]}" </dev/null
