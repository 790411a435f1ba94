#include "core/json_fields.h"

#include <limits>

#include "core/json_text.h"

namespace limber {

const char* kind_of(const Json& value) {
  if (value.is_number()) return value.is_number_integer() ? "a whole number" : "a number";
  return value.is_string()    ? "a text"
         : value.is_object()  ? "a table"
         : value.is_array()   ? "a list"
         : value.is_boolean() ? "true or false"
                              : "nothing";
}

namespace {

void require_whole(const Json& json, double least, double most, const JsonPlace& place) {
  const bool is_whole = json.is_number_integer();
  if (!is_whole || json.get<double>() < least || json.get<double>() > most)
    place.refuse(json, json.is_number() ? "a whole number of common size" : "a whole number");
}

}  // namespace

JsonPlace JsonPlace::under(const std::string& key) const {
  return {what, path.empty() ? key : path + "." + key, remedy};
}
JsonPlace JsonPlace::under(std::size_t index) const {
  return {what, fmt::format("{}[{}]", path, index), remedy};
}

void JsonPlace::refuse(const Json& value, const char* belongs) const {
  throw InputError(fmt::format("{}: {} is {}, where {} belongs; {}", what, path.empty() ? "it" : path,
                               kind_of(value), belongs, remedy));
}
void JsonPlace::refuse_missing() const {
  throw InputError(fmt::format("{}: {} is missing; {}", what, path, remedy));
}
void JsonPlace::refuse_range(const Json& value, const Json& least, const Json& most) const {
  throw InputError(fmt::format("{}: {} is {}; it must be in [{}, {}]; {}", what, path, text_of(value),
                               text_of(least), text_of(most), remedy));
}

void read_value(const Json& json, bool& value, const JsonPlace& place) {
  if (!json.is_boolean()) place.refuse(json, "true or false");
  value = json.get<bool>();
}
void read_value(const Json& json, std::int32_t& value, const JsonPlace& place) {
  using Limits = std::numeric_limits<std::int32_t>;
  require_whole(json, Limits::min(), Limits::max(), place);
  value = json.get<std::int32_t>();
}
void read_value(const Json& json, std::int64_t& value, const JsonPlace& place) {
  require_whole(json, -0x1p62, 0x1p62, place);
  value = json.get<std::int64_t>();
}
void read_value(const Json& json, std::uint64_t& value, const JsonPlace& place) {
  require_whole(json, 0, std::numeric_limits<double>::infinity(), place);
  value = json.get<std::uint64_t>();
}
void read_value(const Json& json, double& value, const JsonPlace& place) {
  if (!json.is_number()) place.refuse(json, "a number");
  value = json.get<double>();
}
void read_value(const Json& json, std::string& value, const JsonPlace& place) {
  if (!json.is_string()) place.refuse(json, "a text");
  value = json.get<std::string>();
}
void read_value(const Json& json, fs::path& value, const JsonPlace& place) {
  std::string text;
  read_value(json, text, place);
  value = text;
}
void read_value(const Json& json, Json& value, const JsonPlace&) { value = json; }

}  // namespace limber
