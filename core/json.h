// JSON files (nlohmann), with our way to complain.
#pragma once

#include <nlohmann/json.hpp>

#include "core/file.h"

namespace limber {

using Json = nlohmann::ordered_json;

// Both throw InputError with the line: what is not JSON, lists within lists deeper than this (what walks
// through them calls itself), and, of a file, more bytes than this.
inline constexpr int max_json_depth = 100;
inline constexpr std::uintmax_t max_json_bytes = 64 << 20;
Json parse_json(const std::string& text, const std::string& what);
Json read_json(const fs::path&);
void write_json(const fs::path&, const Json&);

// What the library says is wrong, without its own numbers of exceptions and places.
std::string words_of(const Json::exception&);

}  // namespace limber
