#!/bin/sh
# Records a sensor and checks the values: check.sh [BUS] [NODE]
# Exit code: 0 if all values are within the limits, 1 if not, 3 if there are no values.
set -eu
export CANGAUGE_BUS="${1:-sim}"
node=${2:-1}

cangauge log "$node" pressure --sync 100ms --count 20 --expect 'pressure in 0.5..2 bar' \
    --output "node-$node.csv" --force
cangauge check "$node" 'temperature < 60 degC' --junit "node-$node.xml"
