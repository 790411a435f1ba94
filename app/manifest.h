// manifest.json of a work folder: what each stage was given, made and said.
#pragma once

#include "core/file.h"
#include "core/json.h"

namespace limber::app {

// Replaces the entry of one stage ("plan", "render"); starts anew when the file is missing or not readable.
void update_manifest(const fs::path& folder, const std::string& stage, const Json& entry);

}  // namespace limber::app
