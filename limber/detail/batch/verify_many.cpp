#include "limber/detail/batch/verify_many.h"

#include <atomic>
#include <set>

#include "core/error.h"
#include "core/json_text.h"
#include "core/progress.h"
#include "core/threads.h"
#include "limber/detail/batch/batch.h"
#include "limber/detail/verify/verify_body.h"

namespace limber::detail {

namespace {

// What is broken of the folder, by name; empty: nothing.
std::string broken_in(const fs::path& folder, const std::string& name, bool remake, std::size_t& promises) {
  Promises of_body;
  try {
    check_body(name, read_made(folder), folder, std::nullopt, remake, of_body);
  } catch (const InputError& error) {
    return error.what();
  }
  promises = of_body.rows().size();
  std::string broken;
  for (const Promise& row : of_body.rows())
    if (!row.kept)
      broken += (broken.empty() ? "" : "; ") + row.name.substr(name.size() + 2) +
                (row.value.empty() ? "" : " (" + row.value + ")");
  return broken;
}

struct Checked {
  std::string name, failed;      // why it was not prepared; empty: it was
  std::string broken, manifest;  // what is wrong; empty: nothing
  std::size_t promises = 0;
  Json row = {};  // as the folder has it; null where it has none
};

Checked check(const fs::path& batch, const Json& written, bool remake) {
  Checked checked;
  const auto row = fields_or_nothing<BatchRow>(written);
  const fs::path name = row ? row->name : "";
  if (name.empty() || name.has_parent_path() || name == "." || name == "..") {
    checked.manifest = fmt::format("{} is no row of a model", text_of(written));
    return checked;
  }
  const BatchModel model{
      {row->source, row->name}, row->key, row->reason.value_or(""), row->message.value_or("")};
  const fs::path quarantine = quarantine_file_of(batch, model);
  checked.name = row->name;
  try {
    if (model.reason.empty()) {
      checked.broken = broken_in(folder_of(batch, model), row->name, remake, checked.promises);
    } else {
      checked.failed = model.reason + ": " + model.message;
      if (!fs::exists(quarantine) || !read_file(quarantine).starts_with(checked.failed + "\n"))
        checked.manifest =
            fmt::format("{} is told to have failed, and {} does not say so", row->name, quarantine.string());
      else if (fs::exists(folder_of(batch, model) / "report.json"))
        checked.manifest = fmt::format("{} is told to have failed, and there is a body", row->name);
    }
    checked.row = json_of_fields(row_of(batch, model));
    for (const auto& [key, value] : checked.row.items())
      if (checked.manifest.empty() && (!written.contains(key) || written.at(key) != value))
        checked.manifest = fmt::format("{} of {} is another's", key, row->name);
    if (checked.manifest.empty() && written.size() != checked.row.size())
      checked.manifest = fmt::format("of {} it tells what limber does not", row->name);
  } catch (const InputError& error) {
    checked.manifest = error.what();
  }
  return checked;
}

}  // namespace

bool holds_many(const fs::path& folder) {
  return !fs::exists(folder / "plan.npz") && !fs::exists(folder / "report.json") &&
         fs::exists(folder / "manifest.jsonl") && fs::is_directory(folder / "bodies");
}

Verified verify_many(const VerifyOptions& options) {
  const fs::path& batch = options.folder;
  if (options.model || options.observables || options.film || !options.scene.scene.empty() ||
      !options.scene.sets.empty() || !options.scene.data.empty())
    throw InputError(
        fmt::format("{0}: holds many models; --model is of one of them, {0}/bodies/NAME, and --observables, "
                    "--film, --scene, --set and --data are of a plan",
                    batch.string()));
  const std::vector<Json> lines = JsonLines(batch / "manifest.jsonl").read();
  std::vector<Checked> checked(lines.size());
  Progress progress("verify", std::int64_t(lines.size()));
  std::atomic<std::int64_t> done{0};
  side_by_side(int(lines.size()), [&](int i) {
    throw_if_stopped();
    checked[std::size_t(i)] = check(batch, lines[std::size_t(i)], options.remake);
    progress.update(++done);
  });

  Verified verified;
  Promises& table = verified.promises;
  std::set<std::string> told;
  std::vector<Json> rows;
  std::string wrong, text;
  for (const Checked& c : checked) {
    if (wrong.empty()) wrong = c.manifest;
    rows.push_back(c.row), text += text_of(c.row) + "\n";
    if (c.name.empty()) continue;
    if (!told.insert(c.name).second && wrong.empty()) wrong = c.name + " is told of twice";
    if (!c.failed.empty())
      table.measured(c.name + ": failed", c.failed);
    else
      table.row(c.name + ": all that is promised of a body", c.broken.empty(),
                c.broken.empty() ? fmt::format("{} promises", c.promises) : c.broken);
  }
  if (lines.empty()) wrong = "it tells of no model";
  if (wrong.empty() && read_file(batch / "manifest.jsonl") != text)
    wrong = "it has other bytes than limber writes for these";
  table.row("manifest.jsonl tells of these models", wrong.empty(), wrong);
  const fs::path csv = batch / "manifest.csv";
  const bool same = wrong.empty() && fs::exists(csv) && read_file(csv) == manifest_csv(rows);
  table.row("manifest.csv says the same", same, "");
  std::set<std::string> left;
  for (const auto& entry : fs::directory_iterator(batch / "bodies"))
    if (const std::string name = entry.path().filename().string(); !told.contains(name)) left.insert(name);
  for (const std::string& name : left)
    table.measured("bodies/" + name, "the manifest does not tell of it, so it is not looked at");
  return verified;
}

}  // namespace limber::detail
