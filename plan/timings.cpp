#include "plan/timings.h"

#include <algorithm>
#include <array>

namespace limber::plan {

bool is_timing(const std::string& key) {
  constexpr std::array others{"dynamics", "rollouts", "rollouts_wrong"};
  return key.ends_with("cpu_s") || key.ends_with("wall_s") ||
         std::find(others.begin(), others.end(), key) != others.end();
}

Json without_timings(const Json& told) {
  if (!told.is_structured()) return told;
  Json rest = told.is_array() ? Json::array() : Json::object();
  for (const auto& [key, value] : told.items()) {
    if (told.is_array())
      rest.push_back(without_timings(value));
    else if (!is_timing(key))
      rest[key] = without_timings(value);
  }
  return rest;
}

Json timings_of(const Json& told) {
  Json timings;
  if (told.is_array()) {
    for (const Json& row : told) timings.push_back(timings_of(row));
    const bool none =
        std::all_of(timings.begin(), timings.end(), [](const Json& row) { return row.is_null(); });
    return none ? Json() : timings;
  }
  if (!told.is_object()) return timings;
  for (const auto& [key, value] : told.items())
    if (is_timing(key))
      timings[key] = value;
    else if (Json within = timings_of(value); !within.is_null())
      timings[key] = std::move(within);
  return timings;
}

Json with_timings(Json told, const Json& timings) {
  if (told.is_array() && timings.is_array() && told.size() == timings.size())
    for (std::size_t i = 0; i < told.size(); ++i) told[i] = with_timings(std::move(told[i]), timings[i]);
  if (!told.is_object() || !timings.is_object()) return told;
  for (const auto& [key, value] : timings.items())
    if (is_timing(key))
      told[key] = value;
    else if (told.contains(key))
      told[key] = with_timings(std::move(told[key]), value);
  return told;
}

}  // namespace limber::plan
