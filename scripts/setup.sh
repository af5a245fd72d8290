# shellcheck shell=bash
# Sourced by demo.sh and test.sh: installs missing packages and builds. It reports on standard error, because standard
# output belongs to results.

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)

say() { echo "$*" >&2; }

# showProgress LABEL: reads the status lines of ninja ("[3/40] ...") and of apt ("pmstatus:...:7.5:...") and shows how
# far the work is: a bar on a terminal, a line every ten seconds otherwise. Other lines pass (warnings, errors).
showProgress() {
  local label=$1 line bar left elapsed count=0 total=0 start=$SECONDS last=$SECONDS shown=''
  while IFS= read -r line; do
    case $line in "ninja: no work to do." | *"Re-checking globbed directories"*) continue ;; esac
    if [[ $line =~ ^\[([0-9]+)/([0-9]+)\] ]]; then
      count=${BASH_REMATCH[1]} total=${BASH_REMATCH[2]}
    elif [[ $line =~ ^(dl|pm)status:.*:([0-9]+)\.[0-9]+: ]]; then # downloading is the first half, unpacking the second
      count=${BASH_REMATCH[2]} total=200
      [[ ${BASH_REMATCH[1]} == dl ]] || count=$((count + 100))
    else
      [[ -z $shown ]] || printf '\r\033[K' >&2
      shown=''
      say "$line"
      continue
    fi
    left='' elapsed=$((SECONDS - start))
    if ((elapsed > 5 && count > 0)); then left=", about $((elapsed * (total - count) / count)) s left"; fi
    if [[ -t 2 ]]; then
      printf -v bar '%*s' $((30 * count / total)) ''
      printf '\r%s [%-30s] %3d %%%s\033[K' "$label" "${bar// /#}" $((100 * count / total)) "$left" >&2
      shown=yes
    elif ((SECONDS - last >= 10)); then
      say "$label: $((100 * count / total)) %$left"
      last=$SECONDS
    fi
  done
  if [[ -n $shown ]]; then echo >&2; fi
}

# installPackages GROUP...: installs those packages of packages.txt in these groups that are missing. Neither root nor
# able to use sudo: prints the line to run and fails.
installPackages() {
  local name group installed missing=() as=()
  if ! command -v dpkg-query > /dev/null; then
    say "not a Debian system: building with what is here; packages.txt names what is needed"
    return
  fi
  installed=" $(dpkg-query -W -f '${db:Status-Status}:${Package} ' 2> /dev/null)"
  while read -r name group _; do
    if [[ " $* " == *" $group "* && $installed != *" installed:$name "* ]]; then missing+=("$name"); fi
  done < <(grep -v '^#' "$root/packages.txt")
  ((${#missing[@]})) || return 0

  if ((EUID != 0)); then
    if command -v sudo > /dev/null && { sudo -n true 2> /dev/null || { [[ -t 0 ]] && sudo -v; }; }; then
      as=(sudo)
    else
      say "packages are missing and there is no right to install them; as root, run:"
      say "apt-get update && apt-get install -y --no-install-recommends ${missing[*]}"
      return 1
    fi
  fi
  say "installing ${missing[*]}"
  # Lists that exist are tried first; they may be too old for the archive, so that a failure fetches them and tries again.
  if compgen -G '/var/lib/apt/lists/*_Packages*' > /dev/null && aptInstall; then return; fi
  say "fetching the package lists"
  "${as[@]}" apt-get update -qq >&2
  if aptInstall; then return; fi
  say "installing failed; apt-get said:"
  tail -n 20 "$aptLog" >&2
  return 1
}

# aptInstall: the call itself; reads `as` and `missing` of its caller. What apt and dpkg say goes to $aptLog, and their
# progress to a descriptor of its own, opened behind sudo, which closes those it is given: on the standard output of
# packages' scripts it makes their writing fail where /dev/pts is not mounted and apt cannot give them a terminal.
aptInstall() {
  aptLog=${aptLog:-$(mktemp -t medulla_apt.XXXXXX)}
  # shellcheck disable=SC2064
  trap "rm -f '$aptLog'" EXIT
  # shellcheck disable=SC2016
  "${as[@]}" env DEBIAN_FRONTEND=noninteractive sh -c 'exec apt-get install -y -qq --no-install-recommends \
    -o DPkg::Lock::Timeout=300 -o APT::Status-Fd=3 "$@" 3>&1 >&2' apt-get "${missing[@]}" 2> "$aptLog" < /dev/null |
    grep --line-buffered -E '^(dl|pm)status:' | showProgress "installing"
}

# build PRESET TARGET [NINJA OPTION...]: configures when that was not done or the presets changed, and builds. ninja sees
# by itself whether a CMakeLists.txt or a source changed.
build() {
  local preset=$1 target=$2 folder=$root/build log
  [[ $preset == default ]] || folder=$root/build-$preset
  shift 2
  if [[ ! $folder/build.ninja -nt $root/CMakePresets.json ]]; then
    say "configuring ${folder##*/}/"
    mkdir -p "$folder"
    log=$folder/configure.log
    (cd "$root" && cmake --preset "$preset" > "$log" 2>&1) || { cat "$log" >&2 && return 1; }
  fi
  NINJA_STATUS='[%f/%t] ' cmake --build "$folder" -j "$(nproc)" --target "$target" -- "$@" 2>&1 |
    showProgress "building ${folder##*/}/"
}
