#include "limber/detail/authoring/part_models.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <functional>
#include <map>
#include <set>

#include "core/error.h"
#include "core/json.h"
#include "core/log.h"
#include "core/mesh_files.h"
#include "core/progress.h"
#include "imaging/surface_nets.h"
#include "meshing/import.h"
#include "meshing/unite.h"
#include "scenes/anatomy.h"

namespace limber::detail {

namespace {

constexpr double units_a_metre = 1000;
constexpr const char* table_names[] = {"isa_element_parts.txt", "partof_element_parts.txt"};
constexpr std::uintmax_t max_table_bytes = 64 << 20;

// Letters, digits, - and _ as they are, all else as _: what files and bodies can be called by.
std::string file_name_of(const std::string& name) {
  std::string text = name;
  for (char& letter : text)
    if (!std::isalnum((unsigned char)letter) && letter != '-' && letter != '_') letter = '_';
  return text;
}

std::string lower(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return char(std::tolower(c)); });
  return text;
}

struct Part {
  std::string name;
  SurfaceMesh surface;  // millimetres, our frame of models: x to the left, y to the back
};

// Bones that stand at their places are one body.
void join(std::vector<Part>& parts, const char* name, const std::function<bool(const std::string&)>& is_one,
          const char* what, std::vector<std::string>& notes) {
  const auto first =
      std::stable_partition(parts.begin(), parts.end(), [&](const Part& part) { return !is_one(part.name); });
  if (parts.end() - first < 2) return;
  Part joined{name, {Points(0, 3), Triangles(0, 3)}};
  std::vector<std::string> names;
  for (auto part = first; part != parts.end(); ++part)
    meshing::append(joined.surface, part->surface), names.push_back(part->name);
  parts.erase(first, parts.end());
  parts.push_back(std::move(joined));
  notes.push_back(fmt::format("{} is {} {} in one: {}", name, names.size(), what, fmt::join(names, ", ")));
}

void join_bones(std::vector<Part>& parts, const char* what, std::vector<std::string>& notes) {
  join(parts, "ribcage", scenes::is_of_ribcage, what, notes);
  join(
      parts, "skeleton",
      [](const std::string& name) { return scenes::anatomy_of(name).kind == scenes::PartKind::bone; }, what,
      notes);
}

// ---- scans ----

// {"5": "liver"}, {"liver": 5}, or either under "labels", as the usual segmentations come with.
std::map<std::int64_t, std::string> names_in(const fs::path& file) {
  const Json document = read_json(file);
  const auto wrong = [&](const std::string& what) {
    return InputError(fmt::format(
        "{}: {}; write an object as {{\"5\": \"liver\"}} or {{\"liver\": 5}}, if you like under \"labels\"",
        file.string(), what));
  };
  if (!document.is_object()) throw wrong("is no object");
  const auto under = document.find("labels");
  const Json& labels = under == document.end() ? document : *under;
  if (!labels.is_object()) throw wrong("\"labels\" is no object");
  std::map<std::int64_t, std::string> names;
  for (const auto& [key, value] : labels.items()) {
    std::int64_t number = 0;
    std::string name;
    const auto [end, error] = std::from_chars(key.data(), key.data() + key.size(), number);
    if (error == std::errc() && end == key.data() + key.size() && value.is_string())
      name = value.get<std::string>();
    else if (value.is_number_integer())
      number = value.get<std::int64_t>(), name = key;
    else
      throw wrong(
          fmt::format("\"{}\" is neither a label's number with a name nor a name with a number", key));
    if (name.empty()) throw wrong(fmt::format("label {} has an empty name", number));
    if (!names.emplace(number, name).second)
      throw InputError(fmt::format("{}: label {} has two names, {} and {}; leave one out", file.string(),
                                   number, names.at(number), name));
  }
  return names;
}

void name_labels(imaging::LabelMap& map, const fs::path& file, std::vector<std::string>& notes) {
  const auto names = names_in(file);
  std::vector<std::string> nowhere;
  for (const auto& [number, name] : names) {
    const auto found = std::find(map.labels.begin() + 1, map.labels.end(), number);
    if (found != map.labels.end())
      map.names[std::size_t(found - map.labels.begin())] = name;
    else if (number != 0)
      nowhere.push_back(name);
  }
  if (std::all_of(map.names.begin(), map.names.end(), [](const std::string& name) { return name.empty(); }))
    throw InputError(fmt::format("{}: names none of the scan's labels", file.string()));
  if (!nowhere.empty())
    notes.push_back(fmt::format("{} names of {} are not in the scan", nowhere.size(), file.string()));
}

std::string name_of(const imaging::LabelMap& map, int row) {
  const std::string& name = map.names[std::size_t(row)];
  return name.empty() ? fmt::format("label_{}", map.labels[std::size_t(row)]) : name;
}

std::vector<Part> parts_of_scan(const PartSource& source, std::vector<std::string>& notes) {
  imaging::LabelMap map = imaging::read_label_map(source.from);
  notes = map.notes;
  if (!source.names.empty()) name_labels(map, source.names, notes);
  std::vector<int> rows;
  for (const std::string& word : source.only)
    rows.push_back(imaging::row_of_label(map, word, source.from.string()));
  if (rows.empty())
    for (int row = 1; row < int(map.labels.size()); ++row) rows.push_back(row);
  log::info("{}: making surfaces of {} labels", source.from.string(), rows.size());
  std::vector<imaging::LabelSurface> labels = imaging::surfaces_of(map, rows, source.surfaces);
  std::vector<Part> parts;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const std::string name = name_of(map, rows[i]);
    if (labels[i].islands_dropped > 0)
      notes.push_back(fmt::format("{}: left out {} small pieces, {} voxels in all", name,
                                  labels[i].islands_dropped, labels[i].voxels_dropped));
    labels[i].surface.positions *= units_a_metre;
    if (labels[i].voxels > 0) parts.push_back({name, std::move(labels[i].surface)});
  }
  if (parts.empty()) throw InputError(fmt::format("{}: no label is more than crumbs", source.from.string()));
  if (source.only.empty()) join_bones(parts, "labels", notes);
  return parts;
}

// ---- atlases ----

struct Concept {
  std::string id, name;
  std::set<std::string> elements;
};

// Lines of a concept's id, its name, and an element file's id, between tabs, under a line of titles.
void read_elements(const fs::path& file, std::map<std::string, Concept>& concepts) {
  if (!fs::exists(file)) return;
  const std::string text = read_file(file, max_table_bytes);
  int line = 0;
  for (std::size_t from = 0; from < text.size();) {
    std::size_t to = std::min(text.find('\n', from), text.size());
    std::string_view row(text.data() + from, to - from);
    from = to + 1, ++line;
    if (row.ends_with('\r')) row.remove_suffix(1);
    if (row.empty() || line == 1) continue;
    std::vector<std::string> cells;
    for (std::size_t at = 0; at <= row.size();) {
      const std::size_t end = std::min(row.find('\t', at), row.size());
      cells.emplace_back(row.substr(at, end - at));
      at = end + 1;
    }
    if (cells.size() < 3 || cells[0].empty() || cells[2].empty())
      throw InputError(fmt::format(
          "{}: line {}: is not a concept's id, its name and an element's id, with tabs between them",
          file.string(), line));
    // As a name of a file it may lead nowhere else.
    if (file_name_of(cells[2]) != cells[2])
      throw InputError(
          fmt::format("{}: line {}: {} is no element's id, such as FJ1252", file.string(), line, cells[2]));
    Concept& one = concepts[lower(cells[0])];
    one.id = cells[0], one.name = cells[1];
    one.elements.insert(cells[2]);
  }
}

// Element files of the folder and of the folders in it.
std::map<std::string, fs::path> element_files(const fs::path& folder) {
  std::map<std::string, fs::path> files;
  const auto take = [&](const fs::path& in) {
    for (const auto& entry : fs::directory_iterator(in))
      if (lower(entry.path().extension().string()) == ".obj")
        files.emplace(entry.path().stem().string(), entry.path());
  };
  take(folder);
  std::vector<fs::path> inner;
  for (const auto& entry : fs::directory_iterator(folder))
    if (entry.is_directory()) inner.push_back(entry.path());
  std::sort(inner.begin(), inner.end());
  for (const fs::path& in : inner) take(in);
  return files;
}

const Concept& concept_of(const std::map<std::string, Concept>& concepts, const std::string& word,
                          const fs::path& folder) {
  if (const auto found = concepts.find(lower(word)); found != concepts.end()) return found->second;
  const auto plain = [](const std::string& name) { return file_name_of(lower(name)); };
  std::vector<std::string> near;
  const Concept* found = nullptr;
  for (const auto& [id, one] : concepts) {
    if (plain(one.name) == plain(word)) {
      if (found)
        throw InputError(fmt::format("{}: {} and {} are both called {}; name one of them by its id",
                                     folder.string(), found->id, one.id, one.name));
      found = &one;
    }
    if (near.size() < 8 && plain(one.name).find(plain(word)) != std::string::npos)
      near.push_back(fmt::format("{} ({})", one.name, one.id));
  }
  if (found) return *found;
  throw InputError(fmt::format("{}: has no part {} among its {}{}", folder.string(), word, concepts.size(),
                               near.empty() ? "" : fmt::format("; did you mean {}?", fmt::join(near, ", "))));
}

std::string listed(const std::vector<std::string>& names) {
  constexpr std::size_t most = 12;
  if (names.size() <= most) return fmt::format("{}", fmt::join(names, ", "));
  return fmt::format("{} and {} more", fmt::join(names.begin(), names.begin() + most, ", "),
                     names.size() - most);
}

SurfaceMesh united(const std::string& part, const std::vector<std::string>& names,
                   const std::vector<SurfaceMesh>& elements, std::vector<std::string>& notes) {
  if (elements.size() == 1) return elements[0];
  log::info("{}: uniting {} elements where they meet", part, elements.size());
  meshing::United united = meshing::unite(elements);
  const auto named = [&](const std::vector<int>& rows) {
    std::vector<std::string> of_rows;
    for (const int row : rows) of_rows.push_back(names[std::size_t(row)]);
    return listed(of_rows);
  };
  std::string note = fmt::format("{} is {} elements in one", part, elements.size());
  for (const std::vector<int>& together : united.together)
    note += fmt::format("; {} meet and are united", named(together));
  notes.push_back(note);
  for (const meshing::United::Beside& beside : united.beside)
    notes.push_back(fmt::format("{}: {} {} not united with what {}, and walls may be left within: {}", part,
                                named(beside.elements), beside.elements.size() == 1 ? "is" : "are",
                                beside.elements.size() == 1 ? "it meets" : "they meet", beside.why));
  return std::move(united.surface);
}

std::vector<Part> parts_of_atlas(const PartSource& source, std::vector<std::string>& notes) {
  std::map<std::string, Concept> concepts;
  for (const char* table : table_names) read_elements(source.from / table, concepts);
  if (concepts.empty()) throw InputError(fmt::format("{}: its tables are empty", source.from.string()));
  if (source.only.empty())
    throw InputError(fmt::format(
        "{}: is an atlas of {} parts; choose some with --only, by their names or ids, such as heart,FMA7197",
        source.from.string(), concepts.size()));
  const auto files = element_files(source.from);
  std::vector<Part> parts;
  std::map<std::string, std::string> whose;
  for (const std::string& word : source.only) {
    const Concept& one = concept_of(concepts, word, source.from);
    std::vector<std::string> names, missing;
    std::vector<SurfaceMesh> elements;
    for (const std::string& element : one.elements) {
      throw_if_stopped();
      const auto file = files.find(element);
      if (file == files.end()) {
        missing.push_back(element);
        continue;
      }
      if (const auto [other, is_new] = whose.emplace(element, one.name); !is_new && other->second != one.name)
        throw InputError(fmt::format("{}: {} is a part of {} and of {}; leave one out of --only",
                                     source.from.string(), element, other->second, one.name));
      log::info("reading {}", file->second.string());
      names.push_back(element);
      elements.push_back(meshing::import_model(file->second, {.count_self_intersections = false}).surface);
    }
    if (!missing.empty())
      throw InputError(fmt::format("{}: {} ({}) is made of {} elements, and {} of them are not here: {}",
                                   source.from.string(), one.name, one.id, one.elements.size(),
                                   missing.size(), fmt::join(missing, ", ")));
    parts.push_back({one.name, united(one.name, names, elements, notes)});
  }
  join_bones(parts, "parts", notes);
  return parts;
}

}  // namespace

bool is_atlas(const fs::path& folder) {
  std::error_code none;
  return std::any_of(std::begin(table_names), std::end(table_names),
                     [&](const char* table) { return fs::is_regular_file(folder / table, none); });
}

PartModels make_part_models(const PartSource& source, const fs::path& folder) {
  if (fs::exists(folder))
    throw InputError(
        fmt::format("{}: is there already, and models would be written there; remove it, or call "
                    "the scene otherwise",
                    folder.string()));
  PartModels made;
  std::vector<Part> parts =
      fs::is_directory(source.from) ? parts_of_atlas(source, made.notes) : parts_of_scan(source, made.notes);
  std::map<std::string, std::string> whose;
  for (Part& part : parts) {
    const std::string name = file_name_of(part.name);
    if (const auto [other, is_new] = whose.emplace(lower(name), part.name); !is_new)
      throw InputError(fmt::format("{}: {} and {} would both be called {}; give them other names",
                                   source.from.string(), other->second, part.name, name));
    if (name != part.name) made.notes.push_back(fmt::format("{} is called {}", part.name, name));
    made.names.push_back(name);
  }
  try {
    make_folder(folder);
    for (std::size_t i = 0; i < parts.size(); ++i) {
      throw_if_stopped();
      write_ply(folder / (made.names[i] + ".ply"), parts[i].surface);
    }
  } catch (...) {
    std::error_code none;
    fs::remove_all(folder, none);
    throw;
  }
  return made;
}

}  // namespace limber::detail
