#!/usr/bin/env bash
# Plants one-line faults and tells which of them no test notices. Builds what is tested first.
#   bash tests/mutants.sh --change                    in the lines that differ from the last commit
#   bash tests/mutants.sh --change main~3             in those that differ from a revision
#   bash tests/mutants.sh --random 300 --seed 7       anywhere in product code
# More options: python3 tests/mutants/mutants.py --help
set -euo pipefail
cd "$(dirname "$0")/.."
bash deploy/install_deps.sh python3
cmake --preset ci >/dev/null
cmake --build --preset ci
exec python3 -B tests/mutants/mutants.py "$@"
