// What a batch of models came to: its records on the disk, tables, page. docs/batch.md.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/json_fields.h"
#include "core/json_lines.h"
#include "limber/batch.h"
#include "limber/detail/body/body_report.h"

namespace limber::detail {

fs::path folder_of(const fs::path& batch, const BatchModel&);           // bodies/NAME
fs::path quarantine_file_of(const fs::path& batch, const BatchModel&);  // failed/NAME.txt

// How an attempt ended and what it cost; `reason` as of BatchModel.
struct Attempt {
  std::string name, key, reason, message;
  double clock_s = 0, cpu_s = 0, peak_mb = 0;
  double time_limit_s = 0, memory_mb = 0;      // the limits that it had
  std::vector<std::string> also_written;       // files beside the body's
  std::optional<InOrder<double>> cpu_seconds;  // by stage, where it was prepared
  template <class Fields>
  void fields(Fields& f) {
    f("name", name), f("key", key), f("reason", reason), f("message", message), f("clock_s", clock_s);
    f("cpu_s", cpu_s), f.if_there("peak_mb", peak_mb), f("time_limit_s", time_limit_s);
    f("memory_mb", memory_mb), f("also_written", also_written), f.if_there("cpu_seconds", cpu_seconds);
  }
};

// journal.jsonl: how each attempt ended and what it cost; lines are added as that happens. The last of each
// name counts; a line cut short does not. Whoever makes a part of a batch, beside others, adds to a file of
// his own, journal/PART.jsonl; who has the folder alone puts them together.
class Journal {
 public:
  // Reads all there is, and drops lines that do not count any more; of a part what was put together before,
  // and its own.
  explicit Journal(const fs::path& batch, const std::string& part = "");
  const Attempt* find(const std::string& name) const;
  void add(const Attempt&);

 private:
  JsonLines file_;
  std::map<std::string, Attempt> attempts_;
};

// A row of the manifest: the model's figures, nothing of this run. Shells, cage and certificate where they
// were made.
struct BatchRow {
  std::string name, source, key, status;
  std::optional<std::string> reason, message;
  std::optional<int> vertices, triangles;
  std::optional<double> volume_m3;
  std::optional<int> shells;
  std::optional<double> mean_overshoot, max_overshoot;
  std::optional<int> triangles_uncovered, tets, nodes;
  std::optional<double> cage_volume_m3, volume_ratio;
  std::optional<bool> certificate_holds;
  std::optional<std::int64_t> vertices_outside, triangles_crossing;
  std::optional<int> nonmanifold_edges, nonmanifold_vertices;
  std::optional<double> min_dihedral_deg, max_dihedral_deg;
  std::optional<int> warnings;
  std::string folder;
  std::optional<std::string> picture;
  template <class Fields>
  void fields(Fields& f) {
    f("name", name), f("source", source), f("key", key), f("status", status);
    f.if_there("reason", reason), f.if_there("message", message);
    f.if_there("vertices", vertices), f.if_there("triangles", triangles);
    f.if_there("volume_m3", volume_m3), f.if_there("shells", shells);
    f.if_there("mean_overshoot", mean_overshoot), f.if_there("max_overshoot", max_overshoot);
    f.if_there("triangles_uncovered", triangles_uncovered), f.if_there("tets", tets);
    f.if_there("nodes", nodes), f.if_there("cage_volume_m3", cage_volume_m3);
    f.if_there("volume_ratio", volume_ratio), f.if_there("certificate_holds", certificate_holds);
    f.if_there("vertices_outside", vertices_outside);
    f.if_there("triangles_crossing", triangles_crossing);
    f.if_there("nonmanifold_edges", nonmanifold_edges);
    f.if_there("nonmanifold_vertices", nonmanifold_vertices);
    f.if_there("min_dihedral_deg", min_dihedral_deg), f.if_there("max_dihedral_deg", max_dihedral_deg);
    f.if_there("warnings", warnings), f("folder", folder), f.if_there("picture", picture);
  }
};
BatchRow row_of(const fs::path& batch, const BatchModel&);

// manifest.csv of these rows.
std::string manifest_csv(const std::vector<Json>& rows);

// manifest.jsonl, manifest.csv; seconds.csv, which tells what the journal does.
void write_tables(const fs::path& batch, const std::vector<BatchModel>&, const Journal&);

// index.html, and index-2.html … of more than a thousand; each with a picture of every model in it.
void write_pages(const fs::path& batch, const std::vector<BatchModel>&);

}  // namespace limber::detail
