#include <algorithm>

#include <fmt/ranges.h>

#include "core/error.h"
#include "core/json_text.h"
#include "limber/detail/batch/batch.h"
#include "limber/detail/body/preview.h"

namespace limber::detail {

namespace {

constexpr const char* stages[] = {"import", "decompose", "cage", "certify", "bind", "contact", "write"};

// RFC 4180.
std::string csv_field(const Json& value) {
  if (value.is_null()) return "";
  std::string text = value.is_string() ? value.get<std::string>() : text_of(value);
  if (text.find_first_of(",\"\r\n") == text.npos) return text;
  for (std::size_t at = 0; (at = text.find('"', at)) != text.npos; at += 2) text.insert(at, 1, '"');
  return '"' + text + '"';
}

std::string csv_line(const std::vector<std::string>& columns, const Json& row) {
  std::vector<std::string> fields;
  for (const std::string& column : columns)
    fields.push_back(csv_field(row.contains(column) ? row.at(column) : Json()));
  return fmt::format("{}\r\n", fmt::join(fields, ","));
}

struct Columns {
  std::vector<std::string> keys;
  void operator()(const char* key, const std::string&) { keys.push_back(key); }
  template <class T>
  void if_there(const char* key, const std::optional<T>&) {
    keys.push_back(key);
  }
};

// Those of a row that has them all.
std::vector<std::string> manifest_columns() {
  Columns columns;
  BatchRow row;
  row.fields(columns);
  return columns.keys;
}

}  // namespace

fs::path folder_of(const fs::path& batch, const BatchModel& model) {
  return batch / "bodies" / model.model.name;
}
fs::path quarantine_file_of(const fs::path& batch, const BatchModel& model) {
  return batch / "failed" / (model.model.name + ".txt");
}

Journal::Journal(const fs::path& batch, const std::string& part)
    : file_(part.empty() ? batch / "journal.jsonl" : batch / "journal" / (part + ".jsonl")) {
  const fs::path whole = batch / "journal.jsonl", parts = batch / "journal";
  const fs::path own = parts / (part + ".jsonl");
  std::vector<fs::path> files;
  std::error_code none;
  for (const auto& entry : fs::directory_iterator(parts, none))
    if (part.empty() || entry.path() == own) files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  files.insert(files.begin(), whole);
  std::size_t count = 0;
  for (const fs::path& file : files)
    for (const Json& json : JsonLines(file).read()) {
      ++count;
      if (auto line = fields_or_nothing<Attempt>(json)) attempts_[line->name] = *std::move(line);
    }
  if (!part.empty()) {
    make_folder(parts);
    return;
  }
  if (count > attempts_.size() || fs::is_directory(parts, none)) {
    FileWriter writer(whole);
    for (const auto& [name, line] : attempts_) writer.append(text_of(json_of_fields(line)) + "\n");
    writer.commit();
  }
  fs::remove_all(parts, none);
}

const Attempt* Journal::find(const std::string& name) const {
  const auto found = attempts_.find(name);
  return found == attempts_.end() ? nullptr : &found->second;
}

void Journal::add(const Attempt& attempt) {
  file_.append(json_of_fields(attempt));
  attempts_[attempt.name] = attempt;
}

BatchRow row_of(const fs::path& batch, const BatchModel& model) {
  const bool done = model.reason.empty();
  BatchRow row;
  row.name = model.model.name, row.source = model.model.file.string();
  row.key = model.key, row.status = done ? "done" : "failed";
  if (!done) {
    row.reason = model.reason, row.message = model.message;
    row.folder = quarantine_file_of("", model).string();
    return row;
  }
  const BodyReport report = read_body_report(folder_of(batch, model));
  row.vertices = report.surface.vertices, row.triangles = report.surface.triangles;
  row.volume_m3 = report.surface.volume_m3;
  if (const auto& shells = report.shells) {
    row.shells = shells->count, row.triangles_uncovered = shells->triangles_uncovered;
    row.mean_overshoot = shells->mean_overshoot, row.max_overshoot = shells->max_overshoot;
  }
  if (const auto& cage = report.cage) {
    row.tets = cage->tets, row.nodes = cage->nodes;
    row.cage_volume_m3 = cage->volume_m3, row.volume_ratio = cage->volume_ratio;
  }
  if (const auto& c = report.certificate) {
    row.certificate_holds = c->holds;
    row.vertices_outside = c->vertices_outside, row.triangles_crossing = c->triangles_crossing;
    row.nonmanifold_edges = c->nonmanifold_edges, row.nonmanifold_vertices = c->nonmanifold_vertices;
    row.min_dihedral_deg = c->min_dihedral_deg, row.max_dihedral_deg = c->max_dihedral_deg;
  }
  row.warnings = int(report.warnings.size());
  row.folder = folder_of("", model).string();
  row.picture = (folder_of("", model) / picture_file).string();
  return row;
}

std::string manifest_csv(const std::vector<Json>& rows) {
  const std::vector<std::string> columns = manifest_columns();
  std::string table = fmt::format("{}\r\n", fmt::join(columns, ","));
  for (const Json& row : rows) table += csv_line(columns, row);
  return table;
}

void write_tables(const fs::path& batch, const std::vector<BatchModel>& models, const Journal& journal) {
  FileWriter lines(batch / "manifest.jsonl"), table(batch / "manifest.csv"), seconds(batch / "seconds.csv");
  std::vector<Json> rows;
  std::vector<std::string> costs{"name", "clock_s", "cpu_s", "peak_mb"};
  costs.insert(costs.end(), std::begin(stages), std::end(stages));
  seconds.append(fmt::format("{}\r\n", fmt::join(costs, ",")));
  for (const BatchModel& model : models) {
    rows.push_back(json_of_fields(row_of(batch, model)));
    lines.append(text_of(rows.back()) + "\n");
    const Attempt* said = journal.find(model.model.name);
    if (!said || said->key != model.key) continue;
    Json cost = json_of_fields(*said);
    for (const auto& [stage, cpu_s] : said->cpu_seconds.value_or(InOrder<double>{})) cost[stage] = cpu_s;
    seconds.append(csv_line(costs, cost));
  }
  table.append(manifest_csv(rows));
  lines.commit(), table.commit(), seconds.commit();
}

}  // namespace limber::detail
