// Edits of a scene by --set, and the file of --control.
//
// A path is walked through the tree and through the table of keys side by side: the tree says which element
// of a list is meant (by its name or its number), the table of keys which tables between may be left out.
// Tables that the text does not have are made. An unknown key is put in like any other: check_and_complete()
// complains of it as of one in the text.
#include "scenes/detail/edit_scene.h"

#include <fmt/ranges.h>

#include <algorithm>

#include "core/words.h"
#include "scenes/detail/schema.h"

namespace limber::scenes {

namespace {

std::vector<std::string> split_path(std::string_view path) {
  std::vector<std::string> parts;
  while (true) {
    const auto dot = path.find('.');
    parts.emplace_back(path.substr(0, dot));
    if (dot == path.npos) return parts;
    path.remove_prefix(dot + 1);
  }
}

// The tables between `table` (at `path`) and the one known key of that name further down, as material between
// a body and friction; empty when there is no such key, or more than one. Where several tables have such a
// key, but only one of them stands in the scene, that one is meant.
std::vector<std::string> tables_between(const Node& table, const std::string& path, const std::string& name) {
  const auto present = [&](const std::vector<std::string>& between) {
    const Node* node = &table;
    for (const std::string& part : between) node = node ? node->find(part) : nullptr;
    return node != nullptr;
  };
  std::vector<std::vector<std::string>> all, there;
  for (const Key& key : keys()) {
    const std::string_view parent = key.parent();
    if (key.name() != name || !parent.starts_with(path + ".")) continue;
    const std::string_view rest = parent.substr(path.size() + 1);
    if (rest.find("[]") != rest.npos) continue;
    all.push_back(split_path(rest));
    if (present(all.back())) there.push_back(all.back());
  }
  if (there.size() == 1) return there.front();
  return all.size() == 1 ? all.front() : std::vector<std::string>{};
}

// The element of a list by its own name, or by its number from 0.
Node& element_of(Node& array, const std::string& name, const std::string& source, const std::string& path) {
  auto& elements = std::get<Array>(array.value);
  std::vector<std::string> names;
  for (std::size_t i = 0; i < elements.size(); ++i) {
    const Node* own = elements[i].find("name");
    const auto* own_name = own ? std::get_if<std::string>(&own->value) : nullptr;
    names.push_back(own_name ? *own_name : std::to_string(i));
    if (name == names.back() || name == std::to_string(i)) return elements[i];
  }
  const std::string meant = nearest(name, names);
  throw InputError(fmt::format("{}: {} has no \"{}\"; {}", source, path, name,
                               meant.empty() ? fmt::format("there are: {}", fmt::join(names, ", "))
                                             : fmt::format("did you mean \"{}\"?", meant)));
}

}  // namespace

void edit(Node& root, const std::string& set) {
  constexpr std::size_t longest_shown = 200;
  const std::string source =
      "--set " + (set.size() > longest_shown ? set.substr(0, longest_shown) + "..." : set);
  const auto equals = set.find('=');
  if (equals == set.npos || equals == 0)
    throw InputError(
        fmt::format("{}: there is no key=value; write for example --set planner.seed=7", source));
  if (!is_utf8(set)) throw InputError(fmt::format("{}: is no UTF-8; write it so, as the scene is", source));
  std::vector<std::string> parts = split_path(std::string_view(set).substr(0, equals));
  if (constexpr std::size_t max_parts = 16; parts.size() > max_parts)
    throw InputError(
        fmt::format("{}: its key has {} parts, and none of a scene has more than five; see docs/scene.md",
                    source, parts.size()));
  Node* node = &root;
  std::string path;  // of the schema
  for (std::size_t i = 0; i < parts.size(); ++i) {
    if (std::holds_alternative<Array>(node->value)) {
      node = &element_of(*node, parts[i], source, path);
      path += "[]";
      continue;
    }
    auto* entries = std::get_if<Table>(&node->value);
    if (!entries)
      throw InputError(fmt::format("{}: {} is {}, so nothing in it can be set; set {} itself", source, path,
                                   node->type_name(), path));
    if (!find_key(path.empty() ? parts[i] : path + "." + parts[i])) {
      const auto between = tables_between(*node, path, parts[i]);
      if (!between.empty()) {
        parts.insert(parts.begin() + std::ptrdiff_t(i), between.begin(), between.end());
        --i;
        continue;
      }
    }
    path += (path.empty() ? "" : ".") + parts[i];
    if (!node->find(parts[i])) entries->push_back({parts[i], {source}, {{source}, Table{}}});
    node = node->find(parts[i]);
  }
  *node = parse_set_value(set.substr(equals + 1), source);
}

// What the other file holds, behind the scene's own.
void append(const ScriptText& script, Node& root) {
  if (script.text.empty()) return;
  Node more = parse_document(script.text, script.name_for_messages);
  for (Entry& entry : std::get<Table>(more.value)) {
    if (entry.key != "forces" && entry.key != "pressures" && entry.key != "motions")
      throw InputError(
          fmt::format("{}: \"{}\" is not for this file; it holds [[forces]], [[pressures]] and [[motions]], "
                      "all else stands in the scene",
                      entry.where.text(), entry.key));
    Node* const own = root.find(entry.key);
    if (!own) {
      std::get<Table>(root.value).push_back(std::move(entry));
      continue;
    }
    auto *to = std::get_if<Array>(&own->value), *from = std::get_if<Array>(&entry.value.value);
    if (!from)
      throw InputError(fmt::format("{}: {} must be a list of tables; write [[{}]]", entry.where.text(),
                                   entry.key, entry.key));
    if (to) std::move(from->begin(), from->end(), std::back_inserter(*to));
  }
}

}  // namespace limber::scenes
