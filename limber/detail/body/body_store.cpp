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

std::optional<Json> BodyStore::fetch(const std::string& key, const Json& input, const std::string& model,
                                     const fs::path& folder) const {
  const fs::path from = entry(key);
  if (!has(key)) return std::nullopt;
  if (!body_is_up_to_date(from, input)) {
    log::warn("{}: is damaged, and made anew", from.string());
    std::error_code ignored;
    fs::remove(from / "report.json", ignored);
    return std::nullopt;
  }
  Json report = read_json(from / "report.json");
  clear_body(folder);
  for (const auto& [name, hash] : report.at("files").items()) place_file(from / name, folder / name);
  place_picture(from, folder);
  report["model"] = model;
  write_json(folder / "report.json", report);
  return report;
}

void BodyStore::keep(const std::string& key, const fs::path& folder) const {
  const fs::path to = entry(key);
  Json report = read_json(folder / "report.json");
  const bool there = has(key);
  if (!there) {
    make_folder(to);
    remove_abandoned(to);
    for (const auto& [name, hash] : report.at("files").items()) {
      place_file(folder / name, to / name);
      ::chmod((to / name).c_str(), 0444);
    }
  }
  if (!has_picture(key)) place_picture(folder, to);
  if (there) return;
  report["model"] = "";
  take_costs_out(report);
  write_json(to / "report.json", report);
}

}  // namespace limber::detail
