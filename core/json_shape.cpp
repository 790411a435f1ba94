#include "core/json_shape.h"

#include <limits>

#include "core/error.h"
#include "core/json_fields.h"

namespace limber {

namespace {

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
  const auto check = [](const Json& v, const Json& e, Keys keys, const JsonPlace& place,
                        auto&& self) -> void {
    if (!fits(v, e))
      place.refuse(v, v.is_number() && e.is_number_integer() ? "a whole number of common size" : kind_of(e));
    if (e.is_array() && !e.empty())
      for (std::size_t i = 0; i < v.size(); ++i) self(v[i], e[0], keys, place.under(i), self);
    if (!e.is_object()) return;
    for (const auto& [key, of_key] : e.items())
      if (v.contains(key))
        self(v.at(key), of_key, keys, place.under(key), self);
      else if (keys == Keys::all)
        place.under(key).refuse_missing();
  };
  check(value, example, keys, {what, "", remedy}, check);
}

}  // namespace limber
