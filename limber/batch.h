// Many models, each prepared in a process of its own, with an end to its time and memory. docs/batch.md.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "limber/body_folder.h"

namespace limber {

struct ListedModel {
  std::filesystem::path file;
  std::string name;  // of a folder: without / and what other systems do not take; no two alike but for case
};

// Whether it stands for models that are to be found: a folder, or @LIST (a file, or @- for stdin).
LIMBER_API bool is_of_many(const std::string& word);

struct BatchOptions {
  std::vector<std::string> models = {};  // files, folders, @lists
  std::vector<ListedModel> listed = {};  // instead, where there are any: those that they stand for
  ModelOptions each = {};                // its `model` is not read
  int jobs = 0;                          // at once; 0: as many as there are threads
  double time_limit_s = 600;             // of a model, CPU time; five times that by the clock
  double memory_mb = 0;                  // of a model; 0: three quarters of the machine's, shared by the jobs
  bool retry_failed = false;             // those, too, that would only fail again
};

// A model of a batch. `reason` is empty where it was prepared; else one of
// "refused" (it is no model, or none for these options), "time", "memory", "crash", "defect".
struct BatchModel {
  ListedModel model;
  std::string key;  // of all that its result depends on; empty where the file cannot be read
  std::string reason, message;
};

struct PreparedMany {
  int models = 0, made = 0, in_store = 0, up_to_date = 0;
  int failed = 0, failed_before = 0;     // now, and in an earlier run, so not tried again
  std::map<std::string, int> reasons;    // of both
  std::vector<BatchModel> not_prepared;  // in the order of the models
  std::filesystem::path manifest, table, page;
};
// Bodies are made by the program `limber`, which starts itself for each: other programs run `limber prepare`,
// and here get an InputError. Throws also DiskError, and Interrupted with what is prepared kept.
LIMBER_API PreparedMany prepare_models(const BatchOptions&, const Context& = {});

}  // namespace limber
