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
  . "$(dirname "$0")/beside.sh"
  unpack_beside "$root" bookworm-backports download {mesa-vulkan-drivers,libdrm2,libdrm-amdgpu1}/bookworm-backports
  library=$(find "$root/tree" -name libvulkan_lvp.so)
  sed "s|\"library_path\": *\"[^\"]*\"|\"library_path\": \"$library\"|" "$root"/tree/usr/share/vulkan/icd.d/lvp_icd*.json \
    >"$root/driver.json.part"
  mv "$root/driver.json.part" "$root/driver.json"
fi

export VK_DRIVER_FILES=$root/driver.json
# For loaders older than 1.3.207.
export VK_ICD_FILENAMES=$VK_DRIVER_FILES
libraries=$(dirname "$(find "$root/tree" -name libvulkan_lvp.so)")
export LD_LIBRARY_PATH=$libraries${LD_LIBRARY_PATH:+:$LD_LIBRARY_PATH}
exec "$@"
