#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Checks what shared libraries export: namespace palpate, nothing of palpate::internal, nothing of a library that we use.
#   scripts/check_exports.sh LIBRARY...
# Prints LIBRARY: SYMBOL: is exported ..., for each that should not be; exit status 1 when there is one, 2 when a file is no
# library. The last line says how many symbols are exported.
set -euo pipefail
status=0
for library in "$@"; do
    symbols=$(nm --dynamic --demangle --defined-only "$library") || exit 2
    [ -n "$symbols" ] || { echo "$library: exports nothing"; status=1; }
    awk -v library="$library" '
    {
        name = $0
        sub(/^[0-9a-f]* *[A-Za-z] /, "", name)
        ++count
        ours = name ~ /^((typeinfo( name)?|vtable|VTT) for )?palpate::/
        is_internal = name ~ /^((typeinfo( name)?|vtable|VTT) for )?palpate::internal/
        if (ours && !is_internal) next
        if (is_internal) ++internals
        else ++foreign
        if (internals + foreign <= 20) printf "%s: %s is exported\n", library, name
    }
    END {
        printf "%s: %d symbols, %d internal, %d not ours\n", library, count, internals, foreign
        exit internals + foreign > 0
    }
    ' <<<"$symbols" || status=1
done
exit $status
