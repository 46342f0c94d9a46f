#!/usr/bin/env bash
# Runs a command with the software driver of the Mesa in Debian 13's backports (26.1.6 in November 2026), which has ray queries, and
# with Debian 13's loader and validation layers. These need a newer C library than Debian 12's: all are unpacked into .cache, and
# the command sees them over the system's /usr, in a mount namespace of its own. Nothing of the system changes. Needs root, or a
# kernel that lets users mount overlays.
# Usage: mesa-new.sh COMMAND...
set -euo pipefail
root=$(cd "$(dirname "$0")/.." && pwd)/.cache/mesa-new

if [ ! -f "$root/done" ]; then
  if ! grep -q '^VERSION_CODENAME=bookworm' /etc/os-release || ! command -v apt-get >/dev/null; then
    echo "mesa-new: the packages are fetched by Debian 12 (bookworm), and this is another system" >&2
    exit 2
  fi
  . "$(dirname "$0")/beside.sh"
  unpack_beside "$root" "trixie trixie-backports" --download-only install mesa-vulkan-drivers/trixie-backports \
    vulkan-validationlayers libvulkan1 libstdc++6 spirv-tools
  touch "$root/done"
fi

export VK_DRIVER_FILES=/usr/share/vulkan/icd.d/lvp_icd.json
as_user=()
if [ "$(id -u)" -ne 0 ]; then as_user=(--map-root-user); fi
exec unshare --mount "${as_user[@]}" bash -c \
  'mount -t overlay overlay -o "lowerdir=$1/tree/usr:/usr" /usr && shift && exec "$@"' mesa-new "$root" "$@"
