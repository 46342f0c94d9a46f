#!/usr/bin/env bash
# Runs a command with Mesa 25's software driver. The driver is unpacked from Debian 12's backports into .cache; the system's own
# driver does not change. Usage: mesa25.sh COMMAND...
set -euo pipefail
root=$(cd "$(dirname "$0")/.." && pwd)/.cache/mesa25

if [ ! -f "$root/driver.json" ]; then
  if ! grep -q '^VERSION_CODENAME=bookworm' /etc/os-release || ! command -v apt-get >/dev/null; then
    echo "mesa25: the packages are for Debian 12 (bookworm), and this is another system" >&2
    exit 2
  fi
  echo "mesa25: fetching Mesa from bookworm-backports into $root" >&2
  rm -rf "$root"
  mkdir -p "$root/apt/lists/partial" "$root/apt/cache/archives/partial" "$root/deb" "$root/tree"
  # From the mirror that this system uses.
  mirror=$(apt-get indextargets --format '$(REPO_URI)' 'Created-By: Packages' 'Codename: bookworm' | head -n 1)
  if [ -z "$mirror" ]; then
    echo "mesa25: apt has no mirror of bookworm; run apt-get update first" >&2
    exit 2
  fi
  echo "deb [signed-by=/usr/share/keyrings/debian-archive-keyring.gpg] $mirror bookworm-backports main" >"$root/apt/sources.list"
  # Separate lists and cache, so that the system's do not change.
  private=(-q -o "Dir::Etc::sourcelist=$root/apt/sources.list" -o Dir::Etc::sourceparts=/dev/null
    -o "Dir::State::lists=$root/apt/lists" -o "Dir::Cache=$root/apt/cache" -o APT::Sandbox::User=)
  apt-get "${private[@]}" update >/dev/null
  (cd "$root/deb" && apt-get "${private[@]}" download {mesa-vulkan-drivers,libdrm2,libdrm-amdgpu1}/bookworm-backports >/dev/null)
  for package in "$root"/deb/*.deb; do dpkg -x "$package" "$root/tree"; done
  library=$(find "$root/tree" -name libvulkan_lvp.so)
  sed "s|\"library_path\": *\"[^\"]*\"|\"library_path\": \"$library\"|" "$root"/tree/usr/share/vulkan/icd.d/lvp_icd*.json \
    >"$root/driver.json.part"
  rm -rf "$root/apt" "$root/deb"
  mv "$root/driver.json.part" "$root/driver.json"
fi

export VK_DRIVER_FILES=$root/driver.json
# For loaders older than 1.3.207.
export VK_ICD_FILENAMES=$VK_DRIVER_FILES
libraries=$(dirname "$(find "$root/tree" -name libvulkan_lvp.so)")
export LD_LIBRARY_PATH=$libraries${LD_LIBRARY_PATH:+:$LD_LIBRARY_PATH}
exec "$@"
