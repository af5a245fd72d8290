#!/usr/bin/env bash
# Placeholder until the tests exist: builds everything and runs them.
set -euo pipefail
cd "$(dirname "$0")"
cmake -S . -B build -G Ninja > /dev/null
cmake --build build
ctest --test-dir build --output-on-failure
