# SPDX-License-Identifier: Apache-2.0
# What the scripts share that install and build. Sourced from the repository's root.

say() { printf '%s: %s\n' "${0##*/}" "$*"; }
die() {
  printf '%s: %s\n' "${0##*/}" "$*" >&2
  exit 2
}

# One line per installed package: name version, name:architecture version for a foreign one.
installed_packages() {
  local native
  native=$(dpkg --print-architecture)
  dpkg-query -W -f='${db:Status-Status} ${Package} ${Architecture} ${Version}\n' |
    awk -v native="$native" '$1 == "installed" { print ($3 == native || $3 == "all") ? $2 : $2 ":" $3, $4 }'
}

# ensure_packages PACKAGE...: installs with apt what is missing, and only then calls apt at all.
ensure_packages() {
  command -v dpkg-query >/dev/null && command -v apt-get >/dev/null ||
    die "this needs Debian 12 (or a relative with apt); elsewhere, install these by hand and build with CMake: $*"
  local missing=() package root=() installed
  installed=$(installed_packages)
  for package in "$@"; do
    grep -q "^$package " <<<"$installed" || missing+=("$package")
  done
  ((${#missing[@]})) || return 0
  if [[ $EUID -ne 0 ]]; then
    command -v sudo >/dev/null || die "not root and no sudo; as root: apt-get install --no-install-recommends ${missing[*]}"
    root=(sudo)
  fi
  say "installing with ${root[*]:+sudo }apt: ${missing[*]}"
  mkdir -p build/logs
  local log=build/logs/apt.log
  : >"$log"
  for package in "${missing[@]}"; do
    [[ $package == *:* ]] || continue
    grep -qx "${package#*:}" < <(dpkg --print-foreign-architectures) && continue
    say "adding the architecture ${package#*:} to dpkg, for the cross build's libraries"
    "${root[@]}" dpkg --add-architecture "${package#*:}" || die "dpkg --add-architecture ${package#*:} failed"
  done
  "${root[@]}" apt-get update >>"$log" 2>&1 || say "apt-get update complained (see $log); trying all the same"
  "${root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y --no-install-recommends "${missing[@]}" \
    >>"$log" 2>&1 || {
    tail -n 15 "$log" >&2
    die "apt could not install them all; the whole story is in $log"
  }
}

# CMake's options for this machine's processor. Exported, for the gates' own shells.
export kProcessorOptions=
if [[ $(uname -m) == x86_64 ]] && ! grep -qw avx2 /proc/cpuinfo; then
  kProcessorOptions=-DPOLYGMAP_AVX2=OFF
  say "this processor has no AVX2, so everything is built without: the same results, and perception takes longer"
fi

# configure PRESET: once, and again when the presets or the toolchain file changed. CMake itself sees the rest.
configure() {
  local stamp=build/$1/.configured key
  key=$(sha256sum CMakePresets.json toolchain/aarch64-orin.cmake; echo "$kProcessorOptions")
  [[ -e build/$1/build.ninja && -e $stamp && $(<"$stamp") == "$key" ]] && return 0
  # shellcheck disable=SC2086 # none or one
  cmake --preset "$1" -DCMAKE_CXX_COMPILER_LAUNCHER= $kProcessorOptions || return 1  # ccache loses the call graphs
  printf '%s\n' "$key" >"$stamp"
}

# alone_in FOLDER COMMAND...: while no other such command runs on that folder, since two builds at once break it. What the
# command starts holds the lock, too, so that a compiler that outlives a killed script still keeps others out.
alone_in() {
  local folder=$1
  shift
  mkdir -p "${folder%/*}"
  (
    flock -n 9 || {
      # check keeps its own output as 3, since a gate's goes to a log.
      { say "waiting for another build in $folder" >&3; } 2>/dev/null || say "waiting for another build in $folder" >&2
      flock 9
    }
    "$@"
  ) 9>"$folder.lock"
}

# build PRESET [TARGET...]
build() { alone_in "build/$1" configure_and_build "$@"; }
configure_and_build() { configure "$1" && cmake --build "build/$1" ${2+--target "${@:2}"}; }

# build_quietly PRESET TARGET...: into a log; says so when it takes longer than a moment, and dies of a failure.
build_quietly() {
  local log=$PWD/build/logs/$1.log
  mkdir -p build/logs
  alone_in "build/$1" log_build "$log" "$@" && return
  grep -a -E -A 12 'error|FAILED|Error' "$log" | head -n 40 >&2
  die "${*:2} of the preset $1 does not build; the whole log is $log"
}
log_build() {
  local log=$1 ticker code=0
  shift
  # The sleep has no output of its own, or a pipe that waits for the script's would wait for it.
  (sleep 3 >/dev/null 2>&1 9>&- && say "building ${*:2}, which may take some minutes (log: $log)") >&2 9>&- &
  ticker=$!
  configure_and_build "$@" >"$log" 2>&1 || code=$?
  kill "$ticker" 2>/dev/null
  return "$code"
}
