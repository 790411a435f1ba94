#include "limber/detail/interface/ranges.h"

#include <fmt/ranges.h>

#include <algorithm>

namespace limber::detail {

void require_one_of(const char* name, const std::string& value, const std::vector<std::string>& known) {
  if (std::find(known.begin(), known.end(), value) == known.end())
    throw InputError(
        fmt::format("{} is \"{}\"; it must be one of \"{}\"", name, value, fmt::join(known, "\", \"")));
}

void require_in_range(const PrepareSettings& s) {
  require_in("the count of hulls", s.shells, 1, 1000);
  require_in("concavity", s.concavity, 0, 1);
  require_in("threshold", s.threshold, 0, 1);
  require_in("inflate", s.inflate, 0, 1);
  require_in("max_hull_vertices", s.corners, 8, 10'000);
  require_in("tets", s.tets, 24, 200'000);
  require_one_of("mode", s.mode, {"lattice", "fast", "paper", "conform"});
}

}  // namespace limber::detail
