#!/usr/bin/env bash
set -euo pipefail
source "$(dirname "$(realpath "$0")")/scripts/setup.sh"

usage() {
  cat << END
usage: demo.sh [SCENE]

Renders SCENE (default: the gallbladder, scenes/gallbladder.xml of this project) to out/NAME.mp4 in this project.
Before that it installs the Debian packages that are missing and builds what has changed.
All options of the program itself: build/medulla --help
END
}

scene=$root/scenes/gallbladder.xml
case ${1-} in
  -h | --help) usage && exit ;;
  -*) usage >&2 && exit 2 ;;
  ?*) scene=$1 ;;
esac
if (($# > 1)); then usage >&2 && exit 2; fi

installPackages build
build default medulla
name=${scene##*/}
mkdir -p "$root/out"
results=$("$root/build/medulla" render "$scene" -o "$root/out/${name%.xml}.mp4")
while read -r name value; do
  case $name in file | pictures_per_second | realtime | hash) printf '%-20s %s\n' "$name" "$value" ;; esac
done <<< "$results"
