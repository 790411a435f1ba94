// What `limber robust` has done, so that one that is stopped goes on where it was.
#pragma once

#include <mutex>
#include <vector>

#include "core/json_lines.h"
#include "limber/detail/plan/plan_folder.h"
#include "limber/robust.h"

namespace limber::detail {

enum class By { open_loop, following, replanning };
const char* words_for(By);

// All that is to be replayed in one world in one way: perturbations [first, last).
struct Replays {
  By by;
  int world, first, last;
  std::vector<Fate> fates = {};
  bool is_done() const { return int(fates.size()) == last - first; }
};

// In the plan's folder, of one plan under one set of errors: robust/KEY.jsonl, a line a world and way.
// Nothing depends on it; what is of another plan or another limber goes, and where it cannot be written that
// is said.
class KeptReplays {
 public:
  KeptReplays(const PlanFolder&, const RobustOptions&);
  // Fills in those that are there.
  void look_up(std::vector<Replays>&) const;
  void add(const Replays&);  // by any thread
  // Who has them all: in the order of these, so that two runs leave the same bytes.
  void put_in_order(const std::vector<Replays>&);
  bool keeps() const { return keeps_; }

 private:
  Json line_of(const Replays&) const;
  void tell_not_kept(const std::exception&);
  double look_s_;
  fs::path file_;
  JsonLines lines_;
  std::mutex mutex_;
  bool keeps_ = true;
};

}  // namespace limber::detail
