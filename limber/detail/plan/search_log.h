// How a search goes, as JSON lines: docs/planning.md, "Statistics".
#pragma once

#include "core/file.h"
#include "plan/search.h"

namespace limber::detail {

// The file is written anew now and then and by finish(), each time whole.
class SearchLog {
 public:
  // Of an earlier file keeps the lines up to `keep_up_to` iterations: those of the plan that is resumed.
  SearchLog(fs::path, std::int64_t keep_up_to);
  void add(const plan::SearchProgress&);  // every tenth iteration makes a line
  void finish();                          // and the last one

 private:
  fs::path path_;
  std::string lines_;
  plan::SearchProgress last_;
  bool last_is_written_ = true;
  double written_at_wall_s_ = 0;
};

}  // namespace limber::detail
