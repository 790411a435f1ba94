#include "core/json_shape.h"

#include <limits>

#include "core/error.h"

namespace limber {

namespace {

const char* kind_of(const Json& value) {
  if (value.is_number()) return value.is_number_integer() ? "a whole number" : "a number";
  return value.is_string()    ? "a text"
         : value.is_object()  ? "a table"
         : value.is_array()   ? "a list"
         : value.is_boolean() ? "true or false"
                              : "nothing";
}

bool fits(const Json& value, const Json& example) {
  if (example.is_number_float()) return value.is_number();
  if (!example.is_number_integer()) return value.type() == example.type();
  if (!value.is_number_integer()) return false;
  const auto number = value.get<double>();
  if (example.get<double>() < 0)
    return number >= std::numeric_limits<std::int32_t>::min() &&
           number <= std::numeric_limits<std::int32_t>::max();
  return number >= -0x1p62 && number <= 0x1p62;
}

}  // namespace

void require_like(const Json& value, const Json& example, Keys keys, const std::string& what,
                  const std::string& remedy) {
  const auto check = [&](const Json& v, const Json& e, const std::string& path, auto&& self) -> void {
    if (!fits(v, e))
      throw InputError(fmt::format(
          "{}: {} is {}, where {} belongs; {}", what, path.empty() ? "it" : path, kind_of(v),
          v.is_number() && e.is_number_integer() ? "a whole number of common size" : kind_of(e), remedy));
    if (e.is_array() && !e.empty())
      for (std::size_t i = 0; i < v.size(); ++i) self(v[i], e[0], fmt::format("{}[{}]", path, i), self);
    if (!e.is_object()) return;
    for (const auto& [key, of_key] : e.items()) {
      const std::string full = path.empty() ? key : path + "." + key;
      if (v.contains(key))
        self(v.at(key), of_key, full, self);
      else if (keys == Keys::all)
        throw InputError(fmt::format("{}: {} is missing; {}", what, full, remedy));
    }
  };
  check(value, example, "", check);
}

}  // namespace limber
