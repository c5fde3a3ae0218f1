#!/bin/sh
# Bias, quoted against true error and refusals of the zeropoint fit over 3000 simulated nights of the paper's geometry,
# with the estimators in use elsewhere for comparison where Python with numpy ($PYTHON or python3) is there.
# SATPHOT_NIGHTS and SATPHOT_SEED change the nights. Some minutes.
set -eu
cd "$(dirname "$0")/.."

echo "== satphot =="
cargo test --release --test stars -- --ignored --nocapture --test-threads 1 table_of_estimators |
  grep -v -e "^running" -e "^$"

echo
echo "== satphot: repeated stars, few pointings, errors of colours, clouds (1000 nights a design) =="
cargo test --release --test stars -- --ignored --nocapture --test-threads 1 table_of_designs |
  grep -v -e "^running" -e "^$"

echo
echo "== numpy: the same geometry, the estimators of other packages (300 nights a case) =="
peers=../shared/peers/zeropoint_sim.py
python=${PYTHON:-python3}
if [ ! -f "$peers" ]; then
  echo "skipped: $peers not present"
elif ! "$python" -c 'import numpy' 2>/dev/null; then
  echo "skipped: $python has no numpy; set PYTHON"
else
  OPENBLAS_NUM_THREADS=1 "$python" "$peers"
fi
