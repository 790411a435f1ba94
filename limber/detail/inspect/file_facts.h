// What is in a file or folder.
#pragma once

#include "limber/info.h"

namespace limber::detail {

// Throws InputError where nothing is there, or nothing that limber reads.
FileFacts facts_of_file(const std::filesystem::path&);

}  // namespace limber::detail
