// What options of the interface may be, before anything is read or made. The ranges are the command's.
#pragma once

#include <fmt/format.h>

#include <string>
#include <type_traits>
#include <vector>

#include "core/error.h"
#include "limber/detail/body/body_report.h"

namespace limber::detail {

// Throws InputError, also of nan.
template <class Number>
void require_in(const char* name, Number value, std::type_identity_t<Number> least,
                std::type_identity_t<Number> most) {
  if (!(value >= least && value <= most))
    throw InputError(fmt::format("{} is {}; it must be in [{}, {}]", name, value, least, most));
}

// The same of words.
void require_one_of(const char* name, const std::string& value, const std::vector<std::string>& known);

void require_in_range(const PrepareSettings&);
// How surfaces of a label map's labels are made: of ModelOptions and NewSceneOptions.
template <class Options>
void require_label_surfaces_in_range(const Options& options) {
  require_in("label_gap", options.label_gap, 0, 0.6);
  require_in("label_rounds", options.label_rounds, 0, 1000);
  require_in("min_island", options.min_island, 0, 1e9);
}

}  // namespace limber::detail
