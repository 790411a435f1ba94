#include "scenes/detail/schema.h"
#include "scenes/scene.h"

namespace limber::scenes {

namespace {

std::string title(std::string_view table) {
  if (table.empty()) return "### At the top";
  return table.ends_with("[]") ? fmt::format("### `[[{}]]`", table.substr(0, table.size() - 2))
                               : fmt::format("### `{}`", table);
}

std::string default_text(const Key& key) {
  if (key.fallback == required) return "**required**";
  if (key.fallback == may_lack) return "–";
  const auto code = [](std::string_view toml) { return fmt::format("`{}`", toml); };
  return key.fast.empty() ? code(key.fallback)
                          : fmt::format("paper {}, fast {}", code(key.fallback), code(key.fast));
}

}  // namespace

std::string scene_reference() {
  std::string text;
  std::vector<std::string_view> tables;
  for (const Key& key : keys())
    if (std::find(tables.begin(), tables.end(), key.parent()) == tables.end()) tables.push_back(key.parent());
  for (const std::string_view table : tables) {
    text += fmt::format("{}\n\n| key | value | default | meaning |\n|---|---|---|---|\n", title(table));
    for (const Key* key : keys_in(table))
      text += fmt::format("| `{}` | {} | {} | {} |\n", key->name(), key->expected(), default_text(*key),
                          key->meaning);
    text += "\n";
  }
  return text;
}

}  // namespace limber::scenes
