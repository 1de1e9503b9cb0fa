#!/usr/bin/env bash
# Measures the figures of the README and the guide again, as far as that is affordable (about ten minutes on two idle cores), and writes
# src/guide/figures.toml and the pages. With --no-bench without the benchmarks. Commit first: the figures carry the commit's name.
# The expensive ones (bake-off, sealed cases, power, the paper's items) name their commands in src/guide/figures.toml.
set -euo pipefail
cd "$(dirname "$0")/.."

data=$(cd .. && pwd)/shared/data
if [ -z "${KINCAL_DATA_DIR:-}" ] && [ -d "$data" ]; then export KINCAL_DATA_DIR=$data; fi
if [ "${1:-}" != --no-bench ]; then
  export KINCAL_BENCH_OUTPUT=$PWD/target/bench.txt
  cargo bench | tee "$KINCAL_BENCH_OUTPUT"
fi
cargo test --release --test tests -- --ignored --exact --nocapture measure::figures
UPDATE_GUIDE=1 cargo test --release --test tests -- guide:: figures::
cargo test --release --test tests -- guide:: figures::
git diff --stat
