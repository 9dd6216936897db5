#!/usr/bin/env bash
# Builds asimov-contact into .cache/asimov of this checkout, for asimov_joint.py:
#
#   ARCHORD_TARGET=peers docker/run benchmarks/peers/asimov_build.sh [SOURCES]
#
# SOURCES is a folder below the checkout with the sources of asimov-contact. Without it they are cloned from GitHub.
# What the build needs beside archord's image is installed by apt-get into the container, which ends with this command.
set -euo pipefail

repository=https://github.com/Wells-Group/asimov-contact
commit=db958afe7abfafa2d0b081c01b3470d0a61feaf9 # of 7 May 2025, version 0.9.0, for dolfinx 0.9
checkout=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd -P)
place=$checkout/.cache/asimov
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

fail() {
    printf 'asimov_build.sh: %s\n' "$*" >&2
    exit 1
}

[[ -n ${ARCHORD_CONTAINER:-} ]] || fail "run me by ARCHORD_TARGET=peers docker/run benchmarks/peers/asimov_build.sh"
[[ $(id -u) == 0 ]] || fail "apt-get needs root in the container, as with podman or a rootless docker"

packages=(g++ cmake ninja-build git libdolfinx-real-dev
    python3-dev python3-pip python3-nanobind python3-scikit-build-core)
# The image leaves out the headers of Boost and static libraries. CMake looks for these of dolfinx.
rm -f /etc/dpkg/dpkg.cfg.d/archord
export DEBIAN_FRONTEND=noninteractive
apt-get update -q
boost=$(dpkg-query -S /usr/include/boost/version.hpp)
apt-get install -y -q --no-install-recommends -o Dpkg::Use-Pty=0 "${packages[@]}"
apt-get install -y -q --reinstall -o Dpkg::Use-Pty=0 "${boost%%:*}" \
    libpugixml-dev libhdf5-openmpi-dev

# a copy, so that the build leaves SOURCES as they are
if [[ $# == 0 ]]; then
    git clone -q "$repository" "$work/sources"
    git -C "$work/sources" checkout -q "$commit"
else
    cp -r "$1" "$work/sources"
fi

rm -rf "$place"
cmake -G Ninja -DCMAKE_BUILD_TYPE=Release -DCMAKE_INSTALL_PREFIX="$place" -DCMAKE_INSTALL_LIBDIR=lib \
    -B "$work/build" -S "$work/sources/cpp"
ninja -C "$work/build" install
CMAKE_PREFIX_PATH=$place python3 -m pip install --no-build-isolation --no-deps --no-index \
    --root-user-action=ignore --target "$place/python" "$work/sources/python"
python3 "$checkout/benchmarks/peers/asimov_joint.py" --probe
