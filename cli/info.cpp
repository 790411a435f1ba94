#include <fmt/format.h>

#include "cli/body_report.h"
#include "cli/commands.h"
#include "cli/scene_text.h"
#include "core/json_text.h"
#include "limber/info.h"

namespace limber::cli {

namespace {

// A line for each value, tables within tables as "table.key".
std::string text_of_any(const Json& json, const std::string& within = "") {
  std::string text;
  for (const auto& [key, value] : json.items())
    text += value.is_object() && !value.empty()
                ? text_of_any(value, within + key + ".")
                : fmt::format("{:28} {}\n", within + key,
                              value.is_string() ? value.get<std::string>() : text_of(value));
  return text;
}

std::string text_of_label_map(const Json& map) {
  const Json &size = map.at("size"), &voxel = map.at("voxel_m");
  std::string text = fmt::format("{} x {} x {} voxels of {:.4g} x {:.4g} x {:.4g} mm\n", size[0].get<int>(),
                                 size[1].get<int>(), size[2].get<int>(), 1e3 * voxel[0].get<double>(),
                                 1e3 * voxel[1].get<double>(), 1e3 * voxel[2].get<double>());
  for (const Json& note : map.at("notes")) text += note.get<std::string>() + "\n";
  text += fmt::format("{:>10}  {:24} {:>12} {:>12}\n", "label", "name", "voxels", "volume, ml");
  for (const Json& label : map.at("labels"))
    text += fmt::format("{:10}  {:24} {:12} {:12.2f}\n", label.at("label").get<std::int64_t>(),
                        label.at("name").get<std::string>(), label.at("voxels").get<std::int64_t>(),
                        1e6 * label.at("volume_m3").get<double>());
  return text;
}

std::string text_of_body(const Json& body) {
  const auto place = [](const Json& v) {
    return fmt::format("({:8.4g} {:8.4g} {:8.4g})", v[0].get<double>(), v[1].get<double>(),
                       v[2].get<double>());
  };
  std::string text = text_of_report(body);
  const std::string only = body.at("input").at("settings").value("only", "");
  if (!only.empty()) text += fmt::format("  part         made with --only {}: no body to plan with\n", only);
  if (!body.contains("shell_list"))
    return !only.empty() ? text : text + "  shells       none, for its scene asks for none\n";
  text +=
      "  shell        middle, m                     size, m                       tets  in "
      "preview-shells.png\n";
  for (const Json& s : body.at("shell_list"))
    text += fmt::format("  {:5}        {}  {}  {:5}  {}\n", s.at("shell").get<int>(), place(s.at("middle_m")),
                        place(s.at("size_m")), s.at("tets").get<int>(), s.at("color").get<std::string>());
  return text;
}

std::string text_of_facts(FileFacts::Kind kind, const Json& facts) {
  switch (kind) {
    case FileFacts::scene:
      return text_of_scene(facts);
    case FileFacts::body:
      return text_of_body(facts);
    case FileFacts::label_map:
      return text_of_label_map(facts);
    case FileFacts::other:
      break;
  }
  return text_of_any(facts);
}

}  // namespace

Outcome info(const fs::path& path) {
  const FileFacts file = facts_of_file(path, at_terminal());
  const Json facts = parse_json(file.json, path.string());
  return {exit_done, facts, text_of_facts(file.kind, facts)};
}

Outcome list_scenes() {
  Json json = Json::array();
  std::string text;
  for (const KnownScene& known : known_scenes()) {
    json.push_back({{"name", known.name}, {"file", known.file.string()}, {"description", known.description}});
    text += fmt::format("{:20} {}\n", known.name, known.description);
  }
  return {exit_done, json, text};
}

}  // namespace limber::cli
