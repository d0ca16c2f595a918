#!/usr/bin/env bash
# Makes DejaVuSans.subset.ttf: bash make.sh [path of DejaVuSans.ttf]
set -euo pipefail
cd "$(dirname "$0")"
pyftsubset "${1:-/usr/share/fonts/truetype/dejavu/DejaVuSans.ttf}" \
    --output-file=DejaVuSans.subset.ttf \
    --unicodes='U+0020-007E,U+00A0-017F,U+0391-03A1,U+03A3-03A9,U+03B1-03C9,U+2013,U+2014,U+2018,U+2019,U+201C,U+201D,U+2022,U+2026,U+2030,U+2032,U+2033,U+2070,U+2074-2079,U+207B,U+2080-2089,U+2190-2193,U+2206,U+2211,U+2212,U+221A,U+221E,U+222B,U+2248,U+2260,U+2264,U+2265,U+22C5' \
    --layout-features='' \
    --no-hinting \
    --name-IDs=0,1,2,3,4,5,6,13,14 --drop-tables+=MATH,GDEF
