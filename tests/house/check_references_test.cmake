# SPDX-License-Identifier: Apache-2.0
# cmake -DSCRIPT=scripts/check_references.sh -DWORK=... -P check_references_test.cmake
# The negative control of check_references.sh: what cites a section or links to a page that is not there is found, with
# its place; what is there is let through.
cmake_minimum_required(VERSION 3.25)

# One page with two sections, a list and a table; and a source whose line 2 begins with `citation`.
function(make_tree citation)
  file(REMOVE_RECURSE ${WORK})
  file(WRITE ${WORK}/docs/numerics.md
    "# Numerics\n\n## 1. Balance\n\n### 1.2 Primitives\n\n1. One.\n2. Two.\n\n## 5. Cases\n\n| case | what |\n|---|---|\n| 9 | jump |\n")
  file(WRITE ${WORK}/docs/plain.md "# Plain\n\n```\n[no link](nowhere.md)\n```\n")
  file(WRITE ${WORK}/README.md "# Readme\n")
  file(WRITE ${WORK}/engine/loop.cpp "// A comment.\n${citation}\nint i;\n")
endfunction()

function(check status_variable output_variable)
  execute_process(COMMAND ${SCRIPT} ${WORK} RESULT_VARIABLE status OUTPUT_VARIABLE output ERROR_VARIABLE errors)
  set(${status_variable} ${status} PARENT_SCOPE)
  set(${output_variable} "${output}${errors}" PARENT_SCOPE)
endfunction()

# No message for the tree as it is; `what` is in it.
function(expect_nothing what)
  check(status output)
  if(NOT status EQUAL 0 OR NOT output STREQUAL "")
    message(SEND_ERROR "'${what}': status ${status}, got:\n${output}")
  endif()
endfunction()

function(expect_clean citation)
  make_tree("${citation}")
  expect_nothing("${citation}")
endfunction()

# Exactly one message, "PLACE: ...what...", for the tree as it is.
function(expect_message place what)
  check(status output)
  string(REGEX MATCHALL "\n" messages "${output}")
  list(LENGTH messages message_count)
  string(FIND "${output}" "${place}: " at)
  string(FIND "${output}" "${what}" text)
  if(NOT status EQUAL 1 OR NOT message_count EQUAL 1 OR NOT at EQUAL 0 OR text EQUAL -1)
    message(SEND_ERROR "wanted one message at ${place} with '${what}', status ${status}, got:\n${output}")
  endif()
endfunction()

function(expect_violation citation what)
  make_tree("${citation}")
  expect_message(engine/loop.cpp:2 "${what}")
endfunction()

expect_clean("// Nothing is cited.")
expect_clean("// The numerics of it; see docs/plain.md and README.md.")
expect_clean("// numerics 1.2, and (numerics.md 5).")
expect_clean("// (docs/numerics.md 1.2, step 2)")
expect_clean("// (numerics 5, case 9)")
expect_clean("// broken across two lines (numerics\n// 1.2, step 2)")
expect_clean("# Numerics.md 1.2 begins a sentence")

expect_violation("// numerics 1.3" "has no section 1.3")
expect_violation("// (docs/numerics.md 2)" "has no section 2")
expect_violation("// broken across two lines (numerics\n// 1.4)" "has no section 1.4")
expect_violation("// (numerics 1.2 and 1.4)" "has no section 1.4")
expect_violation("// numerics 1.2, step 3" "has no step 3")
expect_violation("// (numerics 5, case 8)" "has no case 8")
expect_violation("// docs/nowhere.md" "is no page")

# Links of pages.
foreach(link "[a](numerics.md)" "[a](numerics.md#12-primitives)" "[a](../README.md)" "[a](../engine/)"
        "[a](https://example.org/nowhere.md)" "`[a](nowhere.txt)`" "[a](#title)" "[numerics.md](numerics.md) 1.2")
  make_tree("//")
  file(WRITE ${WORK}/docs/links.md "# Title\n\n${link}\n")
  expect_nothing("${link}")
endforeach()
foreach(link "[a](nowhere.txt)" "[a](numerics.md#13-primitives)" "[a](../nowhere/)" "[a](#nowhere)"
        "[numerics.md](numerics.md) 1.3")
  make_tree("//")
  file(WRITE ${WORK}/docs/links.md "# Title\n\n${link}\n")
  expect_message(docs/links.md:3 "no")
endforeach()

# Long lines: neither in a table nor in a block of code are they one too many.
string(REPEAT "long " 20 words)
make_tree("//")
file(WRITE ${WORK}/docs/long.md "${words}\n| ${words} |\n\n```\n${words}${words}\n```\n")
expect_nothing("lines that may be long")
file(APPEND ${WORK}/docs/long.md "${words}.\n")
expect_message(docs/long.md:7 "101 characters")

# A folder that is no checkout is no success.
file(REMOVE_RECURSE ${WORK})
file(MAKE_DIRECTORY ${WORK})
check(status output)
if(NOT status EQUAL 2)
  message(SEND_ERROR "an empty folder: status ${status}, got:\n${output}")
endif()
