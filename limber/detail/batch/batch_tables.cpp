#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <sstream>

#include <fmt/ranges.h>

#include "core/error.h"
#include "core/json_text.h"
#include "limber/detail/batch/batch.h"
#include "limber/detail/body/preview.h"

namespace limber::detail {

namespace {

// Of a report: where a figure stands, and its column.
struct Figure {
  const char *table, *key, *column;
};
constexpr Figure figures[] = {{"surface", "vertices", "vertices"},
                              {"surface", "triangles", "triangles"},
                              {"surface", "volume_m3", "volume_m3"},
                              {"shells", "count", "shells"},
                              {"shells", "mean_overshoot", "mean_overshoot"},
                              {"shells", "max_overshoot", "max_overshoot"},
                              {"shells", "triangles_uncovered", "triangles_uncovered"},
                              {"cage", "tets", "tets"},
                              {"cage", "nodes", "nodes"},
                              {"cage", "volume_m3", "cage_volume_m3"},
                              {"cage", "volume_ratio", "volume_ratio"},
                              {"certificate", "holds", "certificate_holds"},
                              {"certificate", "vertices_outside", "vertices_outside"},
                              {"certificate", "triangles_crossing", "triangles_crossing"},
                              {"certificate", "nonmanifold_edges", "nonmanifold_edges"},
                              {"certificate", "nonmanifold_vertices", "nonmanifold_vertices"},
                              {"certificate", "min_dihedral_deg", "min_dihedral_deg"},
                              {"certificate", "max_dihedral_deg", "max_dihedral_deg"}};
constexpr const char *columns_before[] = {"name", "source", "key", "status", "reason", "message"},
                     *columns_after[] = {"warnings", "folder", "picture"};
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

std::vector<std::string> manifest_columns() {
  std::vector<std::string> columns(std::begin(columns_before), std::end(columns_before));
  for (const Figure& figure : figures) columns.push_back(figure.column);
  columns.insert(columns.end(), std::begin(columns_after), std::end(columns_after));
  return columns;
}

bool is_record(const Json& line) {
  if (!line.is_object()) return false;
  for (const char* key : {"name", "key", "reason", "message"})
    if (!line.contains(key) || !line.at(key).is_string()) return false;
  for (const char* key : {"clock_s", "cpu_s", "time_limit_s", "memory_mb"})
    if (!line.contains(key) || !line.at(key).is_number()) return false;
  return line.contains("also_written") && line.at("also_written").is_array();
}

}  // namespace

fs::path folder_of(const fs::path& batch, const BatchModel& model) {
  return batch / "bodies" / model.model.name;
}
fs::path quarantine_file_of(const fs::path& batch, const BatchModel& model) {
  return batch / "failed" / (model.model.name + ".txt");
}

Journal::Journal(const fs::path& batch, const std::string& part) : file_(batch / "journal.jsonl") {
  const fs::path parts = batch / "journal";
  const fs::path own = parts / (part + ".jsonl");
  std::vector<fs::path> files;
  std::error_code none;
  for (const auto& entry : fs::directory_iterator(parts, none))
    if (part.empty() || entry.path() == own) files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  if (fs::exists(file_)) files.insert(files.begin(), file_);
  std::size_t count = 0;
  for (const fs::path& file : files) {
    std::istringstream lines(read_file(file));
    for (std::string text; std::getline(lines, text); ++count) {
      const Json line = Json::parse(text, nullptr, false);
      if (is_record(line)) lines_[line.at("name").get<std::string>()] = line;
    }
  }
  if (!part.empty()) {
    make_folder(parts);
    file_ = own;
    // What a killed process left half written is a line of its own from now on.
    if (fs::exists(file_) && !read_file(file_).ends_with('\n')) append("\n");
    return;
  }
  if (count > lines_.size() || fs::is_directory(parts, none)) {
    FileWriter writer(file_);
    for (const auto& [name, line] : lines_) writer.append(text_of(line) + "\n");
    writer.commit();
  }
  fs::remove_all(parts, none);
}

const Json* Journal::find(const std::string& name) const {
  const auto found = lines_.find(name);
  return found == lines_.end() ? nullptr : &found->second;
}

void Journal::append(const std::string& text) {
  const int fd = ::open(file_.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0644);
  const bool written = fd >= 0 && ::write(fd, text.data(), text.size()) == ssize_t(text.size());
  const int error = errno;
  if (fd >= 0) ::close(fd);
  if (!written)
    throw DiskError(fmt::format("{}: writing it failed: {}", file_.string(), std::strerror(error)));
}

void Journal::add(const Json& line) {
  append(text_of(line) + "\n");
  lines_[line.at("name").get<std::string>()] = line;
}

Json row_of(const fs::path& batch, const BatchModel& model) {
  const bool done = model.reason.empty();
  Json row{{"name", model.model.name},
           {"source", model.model.file.string()},
           {"key", model.key},
           {"status", done ? "done" : "failed"}};
  if (!done) {
    row.update({{"reason", model.reason},
                {"message", model.message},
                {"folder", quarantine_file_of("", model).string()}});
    return row;
  }
  const Json report = read_json(folder_of(batch, model) / "report.json");
  for (const auto& [table, key, column] : figures)
    if (report.contains(table)) row[column] = report.at(table).at(key);
  row["warnings"] = report.at("warnings").size();
  row["folder"] = folder_of("", model).string();
  row["picture"] = (folder_of("", model) / picture_file).string();
  return row;
}

void write_tables(const fs::path& batch, const std::vector<BatchModel>& models, const Journal& journal) {
  FileWriter lines(batch / "manifest.jsonl"), table(batch / "manifest.csv"), seconds(batch / "seconds.csv");
  const std::vector<std::string> columns = manifest_columns();
  std::vector<std::string> costs{"name", "clock_s", "cpu_s", "peak_mb"};
  costs.insert(costs.end(), std::begin(stages), std::end(stages));
  table.append(fmt::format("{}\r\n", fmt::join(columns, ",")));
  seconds.append(fmt::format("{}\r\n", fmt::join(costs, ",")));
  for (const BatchModel& model : models) {
    const Json row = row_of(batch, model);
    lines.append(text_of(row) + "\n"), table.append(csv_line(columns, row));
    const Json* said = journal.find(model.model.name);
    if (!said || said->at("key") != model.key) continue;
    Json cost = *said;
    if (said->contains("cpu_seconds")) cost.update(said->at("cpu_seconds"));
    seconds.append(csv_line(costs, cost));
  }
  lines.commit(), table.commit(), seconds.commit();
}

}  // namespace limber::detail
