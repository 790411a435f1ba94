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
  std::vector<ListedModel> listed;  // instead, where there are any: those that they stand for
  PrepareOptions each;              // its `model` is not read
  int jobs = 0;                     // at once; 0: as many as there are threads
  double time_limit_s = 600;        // of a model, CPU time; five times that by the clock
  double memory_mb = 0;             // of a model; 0: memory_share_mb(jobs)
  bool retry_failed = false;        // those, too, that would only fail again
};

double memory_share_mb(int jobs);  // three quarters of the machine's, shared by them

struct PreparedMany {
  int models = 0, made = 0, in_store = 0, up_to_date = 0;
  int failed = 0, failed_before = 0;     // now, and in an earlier run, so not tried again
  std::map<std::string, int> reasons;    // of both
  std::vector<BatchModel> not_prepared;  // in the order of the models
  fs::path manifest, table, page;
};
// Throws InputError, DiskError, and Interrupted with what is prepared kept.
PreparedMany prepare_many(const BatchOptions&);

// A part of it, beside others who make other parts in the same folder: some of options.listed, by their
// places. Tables and page are left to prepare_many(), which finds them done. `part` names a file of its
// journal.
PreparedMany prepare_part(const BatchOptions&, const std::string& part,
                          const std::vector<std::size_t>& which);

}  // namespace limber::detail
