// Names by content, for what is kept under them among many: 128 bits (XXH3), 32 lower-case digits. To tell
// files apart, not to resist an attacker.
#pragma once

#include <string>
#include <string_view>

namespace limber {

std::string content_hash(std::string_view bytes);

// Of the file of the program that runs: another build may make other bytes. "unknown" where it cannot be
// read.
const std::string& program_hash();

}  // namespace limber
