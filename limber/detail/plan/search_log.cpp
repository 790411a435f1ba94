#include "limber/detail/plan/search_log.h"

#include <sstream>

#include "core/error.h"
#include "core/json_fields.h"

namespace limber::detail {

namespace {

constexpr std::int64_t iterations_a_line = 10;
constexpr double seconds_between_writes = 0.5;

std::string line_of(const plan::SearchProgress& m) {
  Json json{{"iteration", m.statistics.iterations},
            {"leg", m.leg},
            {"nodes", m.nodes},
            {"best_distance_m", m.best_distance_m}};
  json.update(plan::json_of(m.statistics));
  json.erase("iterations");
  return json.dump() + "\n";
}

struct LineTold {
  double iteration = 0;
  template <class Fields>
  void fields(Fields& f) {
    f("iteration", iteration);
  }
};

}  // namespace

SearchLog::SearchLog(fs::path path, std::int64_t keep_up_to) : path_(std::move(path)) {
  std::istringstream earlier(keep_up_to > 0 && fs::exists(path_) ? read_file(path_) : std::string());
  for (std::string line; std::getline(earlier, line);) {
    const auto told = fields_or_nothing<LineTold>(parse_json(line, path_.string()));
    if (!told) throw InputError(fmt::format("{}: is not a file of --stats; name another", path_.string()));
    if (told->iteration <= double(keep_up_to)) lines_ += line + "\n";
  }
  write_file(path_, lines_);  // a place that cannot be written is told before the search
}

void SearchLog::add(const plan::SearchProgress& progress) {
  last_ = progress;
  last_is_written_ = progress.statistics.iterations % iterations_a_line == 0;
  if (!last_is_written_) return;
  lines_ += line_of(progress);
  if (progress.statistics.wall_s - written_at_wall_s_ < seconds_between_writes) return;
  written_at_wall_s_ = progress.statistics.wall_s;
  write_file(path_, lines_);
}

void SearchLog::finish() {
  if (!last_is_written_) lines_ += line_of(last_);
  last_is_written_ = true;
  write_file(path_, lines_);
}

}  // namespace limber::detail
