// manifest.json of a work folder: what each stage was given, made and said.
#pragma once

#include "core/file.h"
#include "core/json.h"

namespace limber::app {

// Empty where the file is missing or not readable: a damaged one holds nothing that the other files do not.
Json read_manifest(const fs::path& folder);

// Replaces the entry of one stage ("plan", "render").
void update_manifest(const fs::path& folder, const std::string& stage, const Json& entry);

}  // namespace limber::app
