#!/usr/bin/env bash
# Installs what Strandcast builds and runs with, from Debian 12's own packages; does nothing when all is there.
# Run as root or as a user who may use sudo. Arguments are further packages to install.
set -euo pipefail

packages=(
  g++ cmake ninja-build pkg-config protobuf-compiler
  libboost1.81-dev libprotobuf-dev libzstd-dev libssl-dev libspdlog-dev libfmt-dev libcli11-dev libglm-dev
  libegl-dev libepoxy-dev libegl1 libgl1-mesa-dri libglfw3-dev libimgui-dev
  libturbojpeg0-dev libpng-dev libwebp-dev libvpx-dev libyuv-dev libgtest-dev libgmock-dev libbenchmark-dev libbullet-dev
  libmeshoptimizer-dev libdraco-dev libzfp-dev
  "$@"
)

missing=()
for package in "${packages[@]}"; do
  if ! dpkg-query --show --showformat='${db:Status-Status}\n' "$package" 2>/dev/null | grep -qx installed; then
    missing+=("$package")
  fi
done
if [ ${#missing[@]} -eq 0 ]; then
  exit 0
fi

echo "Installing from Debian's packages: ${missing[*]}"
as_root=()
if [ "$(id -u)" -ne 0 ]; then
  command -v sudo >/dev/null || { echo "Please install these packages as root: ${missing[*]}" >&2; exit 2; }
  as_root=(sudo)
fi
"${as_root[@]}" apt-get update -qq
DEBIAN_FRONTEND=noninteractive "${as_root[@]}" apt-get install -y -qq --no-install-recommends "${missing[@]}" >/dev/null
