#!/usr/bin/env bash
set -euo pipefail
here=$(dirname "$(realpath "$0")")

usage() {
  cat << END
usage: draw_sphere_charts.sh MEDULLA DIR [BODY [SPHERES...]]

Identifies models of the cylinder, the gallbladder, the liver and the stomach, or of the BODY named, with so many filling spheres
each (3 5 7 11 15 25 50 100 200, the last in minutes), and draws them against gap, error and cost: DIR/BODY/spheres.svg. Models
stay in DIR.
END
}

case ${1-} in
  -h | --help) usage && exit ;;
esac
(($# >= 2)) || { usage >&2 && exit 2; }
medulla=$1 out=$2
bodies=(cylinder gallbladder liver stomach) spheres=(3 5 7 11 15 25 50 100 200)
(($# >= 3)) && bodies=("$3")
(($# >= 4)) && spheres=("${@:4}")

# What is held is what the scenes hold; on the gallbladder with the material behind, as its reference has it.
assets=$here/../../assets
declare -A mesh=([cylinder]=$here/cylinder.obj [gallbladder]=$assets/gallbladder/gallbladder.obj
  [liver]=$assets/liver/liver.obj [stomach]=$assets/stomach/stomach.obj)
declare -A held=([cylinder]=vertices=$here/results/cylinder_root.fix.csv [gallbladder]=plane=-0.4887,-0.6834,0.5423,0.024
  [liver]=vertices=$here/results/liver_root.fix.csv [stomach]=vertices=$here/results/stomach_root.fix.csv)
declare -A scene=([cylinder]=cylinder_tip_large [gallbladder]=gallbladder_tip_large [liver]=liver_tip [stomach]=stomach_pull)
mkdir -p "$out"
for body in "${bodies[@]}"; do
  models=()
  for n in "${spheres[@]}"; do
    model=$out/$body.$n.model.xml
    if [[ ! -e $model ]]; then
      "$medulla" build "${mesh[$body]}" --spheres "$n" --overshoot 0 --render-levels 0 --identify --fix "${held[$body]}" \
        --report "$out/$body.$n.csv" -o "$model" > /dev/null
    fi
    models+=(--models "$model")
  done
  "$medulla" chart "$here/${scene[$body]}.xml" --methods identified --steps auto "${models[@]}" -o "$out/$body"
done
