#!/usr/bin/env bash
set -euo pipefail
here=$(dirname "$(realpath "$0")")

usage() {
  cat << END
usage: make_references.sh [BODY[_CASE]...]

Makes the FEM references of tests/accuracy/results/ with CalculiX, on one processor: all of them, or those of the bodies
(cylinder, gallbladder, gallbladder_halved, gallbladder_doubled, liver, liver_stretched, stomach, kidney,
cube) or cases
(gallbladder_axial, liver_modes, ...) named. A file is replaced when its case is solved. Prints a row per case for the README's table.
END
}

case ${1-} in
  -h | --help) usage && exit ;;
  -*) usage >&2 && exit 2 ;;
esac

python=/usr/bin/python3 # Debian's: numpy comes as a package of it
missing=()
command -v ccx > /dev/null || missing+=(calculix-ccx)
command -v tetgen > /dev/null || missing+=(tetgen)
"$python" -c 'import numpy' 2> /dev/null || missing+=(python3-numpy)
if ((${#missing[@]})); then
  echo "missing; as root, run: apt-get install -y --no-install-recommends ${missing[*]}" >&2
  exit 1
fi

work=$(mktemp -d -t medulla_references.XXXXXX)
trap 'rm -rf "$work"' EXIT
mkdir -p "$here/results"
export PYTHONDONTWRITEBYTECODE=1
"$python" "$here/scripts/references.py" "$(realpath "$here/../..")" "$here/results" "$work" "$@"
