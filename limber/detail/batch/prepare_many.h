// Many models, each in a process of its own. docs/batch.md.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "limber/detail/batch/batch.h"
#include "limber/detail/body/prepare.h"

namespace limber::detail {

struct BatchOptions {
  std::vector<std::string> models;  // files, folders, @lists
  PrepareOptions each;              // its `model` is not read
  int jobs = 0;                     // at once; 0: as many as there are threads
  double time_limit_s = 600;        // of a model, CPU time; five times that by the clock
  double memory_mb = 0;             // of a model; 0: three quarters of the machine's, shared by the jobs
  bool retry_failed = false;        // those, too, that would only fail again
};

struct PreparedMany {
  int models = 0, made = 0, in_store = 0, up_to_date = 0;
  int failed = 0, failed_before = 0;     // now, and in an earlier run, so not tried again
  std::map<std::string, int> reasons;    // of both
  std::vector<BatchModel> not_prepared;  // in the order of the models
  fs::path manifest, table, page;
};
// Throws InputError, DiskError, and Interrupted with what is prepared kept.
PreparedMany prepare_many(const BatchOptions&);

}  // namespace limber::detail
