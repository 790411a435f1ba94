// JSON as it is printed and written.
#pragma once

#include "core/json.h"

namespace limber {

// Bytes that are no UTF-8, as names of files may have, become U+FFFD.
std::string text_of(const Json&, int indent = -1);

}  // namespace limber
