# Fetches Debian packages without installing them: the system's own do not change. To be sourced.

# unpack_beside FOLDER "SUITE..." APT-ARGUMENT...
# Runs apt-get with these arguments over the suites, with lists, state and cache of its own, and unpacks what it fetches into
# FOLDER/tree.
unpack_beside() {
  local folder=$1 suites=$2 mirror suite package
  shift 2
  # From the mirror that this system uses.
  mirror=$(apt-get indextargets --format '$(REPO_URI)' 'Created-By: Packages' 'Codename: bookworm' | head -n 1)
  if [ -z "$mirror" ]; then
    echo "${0##*/}: apt has no mirror of bookworm; run apt-get update first" >&2
    exit 2
  fi
  echo "${0##*/}: fetching packages of $suites into $folder" >&2
  rm -rf "$folder"
  mkdir -p "$folder/apt/lists/partial" "$folder/apt/cache/archives/partial" "$folder/tree"
  : >"$folder/apt/status"
  for suite in $suites; do
    echo "deb [signed-by=/usr/share/keyrings/debian-archive-keyring.gpg] $mirror $suite main"
  done >"$folder/apt/sources.list"
  local own=(-q -y -o "Dir::Etc::sourcelist=$folder/apt/sources.list" -o Dir::Etc::sourceparts=/dev/null
    -o "Dir::State::lists=$folder/apt/lists" -o "Dir::State::status=$folder/apt/status" -o "Dir::Cache=$folder/apt/cache"
    -o APT::Sandbox::User= -o APT::Install-Recommends=false)
  apt-get "${own[@]}" update >/dev/null
  (cd "$folder/apt/cache/archives" && apt-get "${own[@]}" "$@" >/dev/null)
  for package in "$folder"/apt/cache/archives/*.deb; do dpkg -x "$package" "$folder/tree"; done
  rm -rf "$folder/apt"
}
