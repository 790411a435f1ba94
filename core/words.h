// What somebody meant who mistyped, and whether it is text at all.
#pragma once

#include <span>
#include <string>
#include <string_view>

namespace limber {

// The one of `known` that is nearest to `word` by edit distance, when it is near enough to be meant; else
// empty.
std::string nearest(std::string_view word, std::span<const std::string> known);

// Whether they differ in nothing but capitals (of ASCII): on some disks two such names are one file.
bool same_but_for_case(std::string_view a, std::string_view b);

// As RFC 3629 has it: no overlong forms, no surrogates, nothing beyond U+10FFFF.
bool is_utf8(std::string_view text);

}  // namespace limber
