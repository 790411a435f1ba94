// A worker: takes units of a farm's folder until none is left for it. docs/farm.md.
#pragma once

#include <string>
#include <vector>

#include "limber/detail/farm/farm_folder.h"

namespace limber::detail {

struct WorkOptions {
  fs::path folder;
  Stage until = last_stage;  // this one and those before it
  int threads = 0;           // 0: as was submitted
  bool wait = false;         // for units that others do, too, and for those after them
  bool again = false;        // frames that others were to paint and did not are sent to them once more
};

struct WorkDone {
  int units = 0;  // by this one
  enum Ending { all_done, others_at_work, some_failed, sent_again } ending = all_done;
  std::vector<std::string> failed;  // "NAME: REASON: MESSAGE"
  int exit_code = 0;                // of the first that failed
};
// Throws InputError where nothing was submitted, or by another build of limber, or the scene was edited
// since; DiskError; Interrupted, also where the farm is cancelled.
WorkDone work(const WorkOptions&);

}  // namespace limber::detail
