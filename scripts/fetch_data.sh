#!/usr/bin/env bash
# Gets real environments and meshes out of Debian packages, without installing those.
#
#   scripts/fetch_data.sh DIR      (about 70 MB of downloads; DIR/environments and DIR/meshes)
#
# Licences: the environments of blender-data are CC0 (Greg Zaal, Poly Haven; the package's
# license.txt is copied along). glmark2-data states GPL-3+ for its files; its bunny is a scan of the
# Stanford 3D Scanning Repository, credit to the Stanford Computer Graphics Laboratory. The Cornell
# box of embree-tools is Apache-2.0. assimp-testmodels holds models under several licences: see the
# copyright file that is copied along. Nothing from here is part of Haarlight.
set -euo pipefail

if [ $# -ne 1 ]; then
  echo "usage: scripts/fetch_data.sh DIR" >&2
  exit 2
fi
mkdir -p "$1"
target=$(cd "$1" && pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
for package in blender-data glmark2-data embree-tools assimp-testmodels; do
  if [ -z "$(apt-cache show "$package" 2>/dev/null)" ]; then
    echo "fetch_data.sh: apt knows no package $package, wanted Debian 12 main and apt-get update" >&2
    exit 1
  fi
done

# unpack PACKAGE: downloads it and unpacks it into ./PACKAGE.
unpack() {
  echo "$1 ..."
  # The folder is private: no user of apt's own may write there.
  apt-get -qq -o APT::Sandbox::User=root download "$1" </dev/null
  dpkg-deb -x "$1"_*.deb "$1"
  rm -f "$1"_*.deb
}

# take SOURCE FILE: copies a plain file, and only that, under a temporary name first.
take() {
  if [ ! -f "$1" ] || [ -L "$1" ]; then
    echo "fetch_data.sh: $1 is not a plain file in its package, wanted it for $2" >&2
    exit 1
  fi
  mkdir -p "$(dirname "$target/$2")"
  install -m 644 "$1" "$target/$2.part"
  mv "$target/$2.part" "$target/$2"
  (cd "$target" && sha256sum "$2")
}

unpack blender-data
world=blender-data/usr/share/blender/datafiles/studiolights/world
for name in city courtyard forest interior night studio sunrise sunset; do
  take "$world/$name.exr" "environments/$name.exr"
done
if [ -f "$world/license.txt" ]; then take "$world/license.txt" environments/license.txt; fi

unpack glmark2-data
take glmark2-data/usr/share/glmark2/models/bunny.obj meshes/bunny.obj
take glmark2-data/usr/share/doc/glmark2-data/copyright meshes/bunny.copyright

unpack embree-tools
models=embree-tools/usr/share/doc/embree3/models
for suffix in obj mtl; do take "$models/cornell_box.$suffix" "meshes/cornell_box.$suffix"; done

unpack assimp-testmodels
take "assimp-testmodels/usr/share/assimp/models/glTF2/2CylinderEngine-glTF-Binary/2CylinderEngine.glb" \
  meshes/2CylinderEngine.glb
take assimp-testmodels/usr/share/doc/assimp-testmodels/copyright meshes/assimp-testmodels.copyright

echo "Done: $target/environments, $target/meshes"
