#include "limber/detail/body/body_store.h"

#include <sys/stat.h>
#include <unistd.h>

#include "core/content_hash.h"
#include "core/error.h"
#include "core/json_text.h"
#include "core/log.h"
#include "core/temporary_files.h"
#include "core/version.h"
#include "limber/detail/body/preview.h"

namespace limber::detail {

namespace {

// By a hard link, or a copy where there are none: on another disk, or when a file has as many as it can.
void place_file(const fs::path& from, const fs::path& to) {
  const fs::path linked = temporary_name(to);
  if (::link(from.c_str(), linked.c_str()) != 0) {
    write_file(to, read_file(from));
    return;
  }
  if (::rename(linked.c_str(), to.c_str()) != 0)
    throw DiskError(fmt::format("{}: renaming the finished file to it failed", to.string()));
  ::unlink(linked.c_str());  // rename(2) leaves it where both were one file before
}

void place_picture(const fs::path& from, const fs::path& to) {
  if (has_picture(from)) place_file(from / picture_file, to / picture_file);
}

}  // namespace

BodyStore::BodyStore(fs::path folder) : folder_(std::move(folder)) { make_folder(folder_); }

std::string BodyStore::key_of(const BodySource& source, const Json& input) {
  return content_hash(text_of(Json{{"version", version},
                                   {"program", program_hash()},
                                   {"content", source.content},
                                   {"ending", source.ending},
                                   {"input", input}}));
}

bool BodyStore::has(const std::string& key) const { return fs::exists(entry(key) / "report.json"); }

bool BodyStore::has_picture(const std::string& key) const { return detail::has_picture(entry(key)); }

std::optional<BodyReport> BodyStore::fetch(const std::string& key, const Json& input,
                                           const std::string& model, const fs::path& folder) const {
  const fs::path from = entry(key);
  if (!has(key)) return std::nullopt;
  std::optional<BodyReport> report = up_to_date_report(from, input);
  if (!report) {
    log::warn("{}: is damaged, and made anew", from.string());
    std::error_code ignored;
    fs::remove(from / "report.json", ignored);
    return std::nullopt;
  }
  clear_body(folder);
  for (const auto& [name, hash] : report->files) place_file(from / name, folder / name);
  place_picture(from, folder);
  report->model = model, report->json["model"] = model;
  write_json(folder / "report.json", report->json);
  return report;
}

void BodyStore::keep(const std::string& key, const fs::path& folder) const {
  keep(key, folder, read_body_report(folder));
}

void BodyStore::keep(const std::string& key, const fs::path& folder, const BodyReport& report) const try {
  const fs::path to = entry(key);
  const bool there = has(key);
  if (!there) {
    make_folder(to);
    remove_abandoned(to);
    for (const auto& [name, hash] : report.files) {
      place_file(folder / name, to / name);
      ::chmod((to / name).c_str(), 0444);
    }
  }
  if (!has_picture(key)) place_picture(folder, to);
  if (there) return;
  Json kept = report.json;
  kept["model"] = "";
  take_costs_out(kept);
  write_json(to / "report.json", kept);
} catch (const DiskError& error) {
  log::warn("the store keeps nothing of {}: {}", folder.string(), error.what());
}

}  // namespace limber::detail
