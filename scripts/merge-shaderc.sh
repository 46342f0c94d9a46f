#!/usr/bin/env bash
# Builds a static libshaderc_combined.a that links, from the packages of Debian and Ubuntu. The library in the package, like its
# libshaderc.so, has undefined symbols of glslang and SPIRV-Tools. If the result does not link, the script fails and
# writes nothing.
# Usage: merge-shaderc.sh OUTPUT_DIR
set -euo pipefail
out=$1
lib=/usr/lib/$(dpkg-architecture -qDEB_HOST_MULTIARCH 2>/dev/null || gcc -print-multiarch)
trial=$(mktemp -d)
trap 'rm -rf "$trial"' EXIT

# The set of existing libraries depends on the version; from glslang 14 on some are empty.
parts=(shaderc_combined glslang glslang-default-resource-limits MachineIndependent GenericCodeGen
  OSDependent OGLCompiler HLSL SPIRV SPVRemapper SPIRV-Tools-opt SPIRV-Tools)
{
  echo "create $trial/libshaderc_combined.a"
  for part in "${parts[@]}"; do
    if [ -f "$lib/lib$part.a" ]; then echo "addlib $lib/lib$part.a"; fi
  done
  echo save
  echo end
} | ar -M

# The test compiles one shader with the front end, the code generator and the optimiser.
cat >"$trial/probe.c" <<'END'
#include <shaderc/shaderc.h>
#include <string.h>
int main(void) {
    const char *source = "#version 460\nlayout(local_size_x = 1) in;\nvoid main() {}\n";
    shaderc_compiler_t compiler = shaderc_compiler_initialize();
    shaderc_compile_options_t options = shaderc_compile_options_initialize();
    shaderc_compile_options_set_optimization_level(options, shaderc_optimization_level_performance);
    shaderc_compilation_result_t result = shaderc_compile_into_spv(
        compiler, source, strlen(source), shaderc_compute_shader, "probe", "main", options);
    return shaderc_result_get_compilation_status(result) != shaderc_compilation_status_success;
}
END
if ! { gcc -c -o "$trial/probe.o" "$trial/probe.c" && g++ -o "$trial/probe" "$trial/probe.o" -L"$trial" -lshaderc_combined; } \
  2>"$trial/log" || ! "$trial/probe"; then
  echo "merge-shaderc: the merged libraries do not link:" >&2
  tail -n 3 "$trial/log" >&2
  exit 1
fi
mkdir -p "$out"
mv "$trial/libshaderc_combined.a" "$out/libshaderc_combined.a"
