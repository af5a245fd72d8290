#!/usr/bin/env bash
set -euo pipefail
source "$(dirname "$(realpath "$0")")/scripts/setup.sh"

usage() {
  cat << END
usage: test.sh [--sanitize | --lint]

Installs the Debian packages that are missing, builds what has changed into build/ and runs every test.
  --sanitize  the same, but for the figures of accuracy, with address and undefined-behaviour sanitizers, in
              build-sanitize/
  --lint      no tests: warnings of g++ and clang++ as errors, clang-format, clang-tidy
One test after a build: build/medulla_tests --gtest_filter='Proxy.*'
END
}

# runTests PRESET. The benchmark is not built: --lint compiles it, and who wants timings asks for it.
runTests() {
  build "$1" medulla_tests
  (cd "$root" && ctest --preset "$1" -j "$(nproc)")
}

# Every check runs, so that one call shows all there is to mend. clang-tidy runs as part of the clang++ builds: in parallel,
# and only over what changed. Its static analyser takes three times as long as all its other checks: what users run is
# analysed, the tests are not.
lint() {
  local sources preset failed=()
  build lint-gcc all -k 0 || failed+=("g++")
  for preset in lint-clang lint-analyse; do
    if [[ $root/.clang-tidy -nt $root/build-$preset/build.ninja ]]; then rm -rf "$root/build-$preset"; fi
  done
  build lint-clang all -k 0 || failed+=("clang++ or clang-tidy")
  build lint-analyse medulla -k 0 || failed+=("clang's static analyser")
  cd "$root"
  mapfile -t sources < <(find . -path './build*' -prune -o -name '*.cpp' -print -o -name '*.h' -print)
  clang-format --dry-run -Werror "${sources[@]}" || failed+=("clang-format")
  if ((${#failed[@]})); then
    printf 'lint failed: %s\n' "${failed[@]}"
    return 1
  fi
  echo "lint: g++, clang++, clang-tidy and clang-format find nothing in ${#sources[@]} files"
}

case ${1-} in
  -h | --help) usage && exit ;;
  --lint | --sanitize | '') ;;
  *) usage >&2 && exit 2 ;;
esac
if (($# > 1)); then usage >&2 && exit 2; fi

case ${1-} in
  --lint)
    installPackages build lint
    lint
    ;;
  --sanitize)
    installPackages build chart
    runTests sanitize
    ;;
  *)
    installPackages build chart
    runTests default
    ;;
esac
