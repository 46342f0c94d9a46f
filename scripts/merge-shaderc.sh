#!/usr/bin/env bash
# Debian's libshaderc_combined.a and libshaderc.so both leave glslang and SPIRV-Tools symbols undefined
# (Debian 12). This merges the static archives into one that the shaderc crate can link.
# Usage: merge-shaderc.sh OUTPUT_DIR
set -euo pipefail
out=$1
lib=/usr/lib/$(dpkg-architecture -qDEB_HOST_MULTIARCH 2>/dev/null || gcc -print-multiarch)
mkdir -p "$out"
{
  echo "create $out/libshaderc_combined.a"
  for name in shaderc_combined glslang glslang-default-resource-limits MachineIndependent GenericCodeGen \
              OSDependent OGLCompiler HLSL SPIRV SPVRemapper SPIRV-Tools-opt SPIRV-Tools; do
    if [ -f "$lib/lib$name.a" ]; then echo "addlib $lib/lib$name.a"; fi
  done
  echo save
  echo end
} | ar -M
