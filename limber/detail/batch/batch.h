// What a batch of models came to: its records on the disk, tables, page. docs/batch.md.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "core/json.h"
#include "limber/detail/batch/model_list.h"

namespace limber::detail {

// A model of a batch. `reason` is empty where it was prepared; else one of
// "refused" (it is no model, or none for these options), "time", "memory", "crash", "defect".
struct BatchModel {
  ListedModel model;
  std::string key;  // of all that its result depends on; empty where the file cannot be read
  std::string reason, message;
};

fs::path folder_of(const fs::path& batch, const BatchModel&);           // bodies/NAME
fs::path quarantine_file_of(const fs::path& batch, const BatchModel&);  // failed/NAME.txt

// journal.jsonl: how each attempt ended and what it cost; lines are added as that happens. The last of each
// name counts; a line cut short does not. Whoever makes a part of a batch, beside others, adds to a file of
// his own, journal/PART.jsonl; who has the folder alone puts them together.
class Journal {
 public:
  // Reads all there is, and drops lines that do not count any more; of a part what was put together before,
  // and its own.
  explicit Journal(const fs::path& batch, const std::string& part = "");
  const Json* find(const std::string& name) const;
  void add(const Json& line);

 private:
  void append(const std::string& text);
  fs::path file_;
  std::map<std::string, Json> lines_;
};

// A row of the manifest: the model's figures, nothing of this run.
Json row_of(const fs::path& batch, const BatchModel&);

// manifest.jsonl, manifest.csv; seconds.csv, which tells what the journal does.
void write_tables(const fs::path& batch, const std::vector<BatchModel>&, const Journal&);

// index.html, and index-2.html … of more than a thousand; each with a picture of every model in it.
void write_pages(const fs::path& batch, const std::vector<BatchModel>&);

}  // namespace limber::detail
