// A work folder whose files say what they should not, and whose hashes, reports and seals fit all the same.
#pragma once

#include <string_view>

namespace limber::fuzz {

// The bytes say what is changed, and which command then meets it. Throws as that command does.
void meet_changed_folder(std::string_view bytes);

}  // namespace limber::fuzz
