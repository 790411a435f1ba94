// JSON files (nlohmann), with our way to complain.
#pragma once

#include <nlohmann/json.hpp>

#include "core/file.h"

namespace limber {

using Json = nlohmann::ordered_json;

Json parse_json(const std::string& text, const std::string& what);  // throws InputError with the line
Json read_json(const fs::path&);
void write_json(const fs::path&, const Json&);

}  // namespace limber
