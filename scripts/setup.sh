#!/usr/bin/env bash
# Installs missing packages that twobounce needs, and prints each with its purpose. Root is needed only if one is missing.
# Usage: setup.sh demo|test|web|cluster|audit|deb
# (test adds Vulkan's validation layers, web a browser, cluster GNU parallel and Slurm, audit cargo-audit and cargo-deny,
# deb cargo-deb)
set -euo pipefail
cd "$(dirname "$0")/.."
purpose=${1:-demo}

export PATH="$PATH:${CARGO_HOME:-${HOME:-}/.cargo}/bin"
have() { command -v "$1" >/dev/null 2>&1; }

# package name: purpose
wanted=(
  "gcc: links the program"
  "libc6-dev: links the program"
  "libvulkan1: the Vulkan loader"
  "mesa-vulkan-drivers: Vulkan drivers for GPUs, and for the CPU"
)
if [ "$purpose" = test ]; then
  wanted+=(
    "vulkan-validationlayers: checks every Vulkan call of the tests"
    "spirv-tools: checks the shaders as pipelines take them"
    "python3-numpy: arrays, for the tests of the Python package"
    "python3-pytest: runs the tests of the Python package"
    "xvfb: a display in memory for the tests of the window"
    "jwm: a window manager, for the test that minimises the window"
    "libx11-xcb1: opens windows"
    "libxcursor1: opens windows"
    "libxi6: hears keys and mouse"
    "libxkbcommon-x11-0: knows keys"
  )
fi
if [ "$purpose" = web ]; then
  wanted+=(
    "chromium: opens the chart's page"
    "chromium-driver: drives the browser"
    "python3: runs the page's tests"
  )
fi
if [ "$purpose" = cluster ]; then
  wanted+=(
    "parallel: shares work among processes and hosts"
    "slurmctld: Slurm's controller"
    "slurmd: Slurm's node"
    "slurm-client: gives Slurm work"
    "munge: signs Slurm's messages"
    "procps: finds the worker to kill"
    "python3: compares rows"
    "python3-venv: holds HyperQueue from PyPI"
  )
fi
if [ "$purpose" = deb ]; then
  wanted+=(
    "dpkg-dev: finds the packages of the libraries that the program links"
  )
fi
# Debian and Ubuntu 24.04 and later have shaderc packages; elsewhere the shaderc crate builds shaderc.
packaged_shaderc=(
  "libshaderc-dev: compiles the shaders while building"
  "glslang-dev: a part of shaderc"
  "spirv-tools: a part of shaderc"
  "g++: shaderc is written in C++"
  "binutils: merges the libraries"
)
bundled_shaderc=(
  "g++: builds shaderc, which compiles the shaders while building"
  "cmake: builds shaderc"
  "git: builds shaderc"
  "ninja-build: builds shaderc, faster than make"
  "python3: builds shaderc"
)

list_for_other_systems() {
  cat <<'END'
This is neither Debian nor Ubuntu, so this script installs nothing. twobounce needs:
  - Rust 1.95 or newer: https://rustup.rs
  - a C compiler, for linking
  - the Vulkan loader (libvulkan.so.1) and a driver; without a GPU, Mesa's lavapipe
  - for the tests: the Vulkan validation layers, spirv-val of the SPIR-V tools, Xvfb, jwm, Python 3 with numpy and pytest
  - for the window on X11: libX11, libX11-xcb, libXcursor, libXi, libxkbcommon-x11
  - for make test-web: chromium, chromedriver, python3
  - for make deb: Debian or Ubuntu, for dpkg-shlibdeps
  - for building shaderc once (about 8 minutes): cmake, git, python3, a C++ compiler; ninja helps
END
}

# Installs the missing ones of the packages, given as "name: purpose".
install_missing() {
  local entry name missing=()
  for entry in "$@"; do
    name=${entry%%:*}
    if ! dpkg-query -W -f '${Status}' "$name" 2>/dev/null | grep -q 'ok installed'; then
      echo "setup: $entry"
      missing+=("$name")
    fi
  done
  if [ ${#missing[@]} -eq 0 ]; then return; fi
  if [ "$(id -u)" -ne 0 ] && ! have sudo; then
    echo "setup: these packages are missing and there is no sudo; as root, run: apt-get install ${missing[*]}" >&2
    exit 2
  fi
  echo "setup: installing ${missing[*]}"
  local install=(apt-get install -y -q --no-install-recommends "${missing[@]}")
  # Outdated package lists name files that no longer exist: on failure, update the lists and try once more.
  as_root "${install[@]}" >/dev/null 2>&1 || { as_root apt-get update -q >/dev/null && as_root "${install[@]}" >/dev/null; }
}

as_root() {
  if [ "$(id -u)" -eq 0 ]; then
    DEBIAN_FRONTEND=noninteractive "$@"
  else
    sudo DEBIAN_FRONTEND=noninteractive "$@"
  fi
}

if have apt-get && have dpkg-query; then
  if ! apt-cache show mesa-vulkan-drivers >/dev/null 2>&1; then
    echo "setup: fetching the package lists"
    as_root apt-get update -q >/dev/null
  fi
  install_missing "${wanted[@]}"
  if [ ! -s .cache/shaderc/libshaderc_combined.a ]; then
    if apt-cache show libshaderc-dev >/dev/null 2>&1; then
      install_missing "${packaged_shaderc[@]}"
      scripts/merge-shaderc.sh .cache/shaderc || true
    fi
    if [ ! -s .cache/shaderc/libshaderc_combined.a ]; then
      echo "setup: the packaged libshaderc does not link here; the build compiles shaderc once, in about 8 minutes"
      install_missing "${bundled_shaderc[@]}"
    fi
  fi
else
  list_for_other_systems
fi

if ! have cargo; then
  echo "setup: Rust is missing; install it with: curl --proto '=https' --tlsv1.2 -sSf https://sh.rustup.rs | sh" >&2
  exit 2
fi
if [ "$purpose" = test ]; then
  for tool in rustfmt clippy; do
    if cargo "${tool/rust/}" --version >/dev/null 2>&1; then continue; fi
    if ! have rustup; then
      echo "setup: this Rust lacks $tool, which make test runs; install it, or Rust from https://rustup.rs" >&2
      exit 2
    fi
    echo "setup: adding $tool to Rust"
    rustup component add "$tool"
  done
fi
# Builds a tool of crates.io, given with what it does, where it is missing.
build_tool() {
  if have "$1"; then return; fi
  echo "setup: building $1, which $2; that takes minutes"
  cargo install --locked --quiet "$1"
}

if [ "$purpose" = audit ]; then
  for tool in cargo-audit cargo-deny; do
    if ! build_tool "$tool" "looks through the dependencies"; then
      echo "setup: $tool cannot be installed from crates.io here; make audit goes on without it" >&2
    fi
  done
fi
if [ "$purpose" = deb ] && ! build_tool cargo-deb "writes the package"; then
  echo "setup: cargo-deb cannot be installed from crates.io here, and make deb needs it" >&2
  exit 2
fi
