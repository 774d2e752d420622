# SPDX-License-Identifier: Apache-2.0
# Prints sources as one, so that what several of them include is read once.
#   awk -v root=../.. [-v apart=1] -f scripts/bundle_text.awk SOURCE...
# SOURCE: its path from the root; root: the root's path from where the result is. A source is included.
# apart: a test is copied, and what it has in its unnamed namespace goes into one more namespace within that: so two tests may have the
# same names. Its lines keep their numbers. Relies on the format of .clang-format: each of the lines that are changed stands alone.
FNR == 1 {
    ++count
    is_copied = apart && FILENAME ~ /_test\.cpp$/
    print is_copied ? "#line 1 \"" FILENAME "\"" : "#include \"" root "/" FILENAME "\""
}
!is_copied { nextfile }
$0 == "namespace {" { $0 = "namespace { namespace source_" count " {" }
$0 == "} // namespace" { $0 = "} } // namespace" }
{ print }
