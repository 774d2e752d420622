#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Checks that a kind of effect is known in one place: of all of engine/, only engine/scene/effects/ names kinds, and
# docs/effects.md says what each does.
#   scripts/check_rooms.sh [ROOT]      ROOT: a checkout, by default this one
# Prints FILE:LINE: what is wrong, for each; exit status 1 when there is one, 2 when ROOT is not a checkout.
# A kind is named by its settings (effects::Guide), by its header, or where the name in scenes is compared.
set -euo pipefail

root=${1:-$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")/..}
cd "$root"
rooms=engine/scene/effects
if [ ! -d "$rooms" ]; then
    echo "check_rooms.sh: $root: no checkout: it has no $rooms/" >&2
    exit 2
fi

status=0
mapfile -t outside < <(find engine -path "$rooms" -prune -o -type f \( -name '*.h' -o -name '*.cpp' \) -print | sort)
if [ ${#outside[@]} -gt 0 ]; then
    awk '
    function complain(what) { printf "%s:%d: %s\n", FILENAME, FNR, what; bad = 1 }
    { code = $0; sub(/\/\/.*/, "", code) }
    code ~ /effects::[A-Z]/ { complain("names a kind of effect; ask engine/scene/internal/effect_questions.h") }
    code ~ /#include <palpate\/engine\/scene\/effects\// && code !~ /\/list\.h>/ {
        complain("includes a kind of effect; <palpate/engine/scene/effects/list.h> has all of them")
    }
    code ~ /name\([a-z_.>-]*effect[^)]*\) *[!=]= *"/ {
        complain("asks for a kind of effect by its name; ask engine/scene/internal/effect_questions.h")
    }
    END { exit bad }
    ' "${outside[@]}" || status=1
fi

# The name of each kind in scenes, with its place; in the reference it is in the first column of the table of types.
table=$(awk '/^\| `type` /{ inside = 1 } /^$/{ inside = 0 } inside' docs/effects.md | cut -d'|' -f2)
while IFS=: read -r file line name; do
    grep -qF "\`$name\`" <<<"$table" && continue
    echo "$file:$line: docs/effects.md does not say what \`$name\` does"
    status=1
done < <(grep -HnoE '\.name = "[a-z_]+"' "$rooms"/*.cpp | sed -E 's/\.name = "([a-z_]+)"/\1/')
exit $status
