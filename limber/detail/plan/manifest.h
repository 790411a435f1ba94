// manifest.json of a work folder: what each stage was given, made and said.
#pragma once

#include "core/file.h"
#include "core/json.h"

namespace limber::detail {

// Empty where the file is missing, and, with a warning, where it is no JSON: a damaged one holds nothing that
// the other files do not. Throws InputError where a text stands for a number and the like.
Json read_manifest(const fs::path& folder);

// Whether the folder may be written into.
bool can_update_manifest(const fs::path& folder);

// Replaces the entry of one stage ("plan", "render").
void update_manifest(const fs::path& folder, const std::string& stage, const Json& entry);

}  // namespace limber::detail
