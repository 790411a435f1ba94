#include "limber/detail/batch/model_list.h"

#include <algorithm>
#include <cerrno>
#include <iostream>
#include <iterator>
#include <map>
#include <set>

#include <fmt/ranges.h>

#include "core/content_hash.h"
#include "core/error.h"
#include "core/progress.h"
#include "core/words.h"
#include "meshing/import.h"

namespace limber::detail {

namespace {

constexpr std::size_t longest_name = 150;
constexpr std::uintmax_t max_list_bytes = 1 << 30;

std::string lower_ascii(std::string text) {
  for (char& c : text)
    if (c >= 'A' && c <= 'Z') c = char(c - 'A' + 'a');
  return text;
}

// What a disk of any system takes as a folder's name.
std::string name_for(const fs::path& path) {
  std::string name = path.generic_string();
  if (!is_utf8(name))
    for (char& c : name)
      if (c & 0x80) c = '_';
  for (char& c : name)
    if (static_cast<unsigned char>(c) < ' ' ||
        std::string_view("/\\:*?\"<>|\x7f").find(c) != std::string_view::npos)
      c = '_';
  if (name.empty() || name.front() == '.' || name.front() == '-') name = fmt::format("_{}", name);
  if (name.back() == '.' || name.back() == ' ') name += "_";
  return name;
}

std::string cut(std::string name) {
  if (name.size() <= longest_name) return name;
  name.resize(longest_name);
  while (!is_utf8(name)) name.pop_back();
  return name;
}

// Two that differ in capitals alone are one folder on some disks. All of them get a part of their path's
// hash, so that none depends on the order.
void tell_apart(std::vector<ListedModel>& models) {
  std::map<std::string, int> of_name;
  for (ListedModel& model : models) ++of_name[lower_ascii(cut(model.name))];
  for (ListedModel& model : models) {
    const bool alone = of_name[lower_ascii(cut(model.name))] == 1 && model.name.size() <= longest_name;
    model.name = cut(model.name);
    if (!alone) model.name += fmt::format("~{:.12}", content_hash(model.file.lexically_normal().string()));
  }
}

bool is_same(const fs::path& a, const fs::path& b) {
  std::error_code none;
  return fs::equivalent(a, b, none);
}

std::vector<ListedModel> models_in(const fs::path& folder, const std::vector<fs::path>& but_not) {
  const auto is_left_out = [&](const fs::path& path) {
    return std::any_of(but_not.begin(), but_not.end(),
                       [&](const fs::path& other) { return is_same(path, other); });
  };
  if (is_left_out(folder))
    throw InputError(
        fmt::format("{}: is where the results go, and those are no models; name another folder with -o "
                    "or --store",
                    folder.string()));
  const std::vector<std::string>& endings = meshing::model_endings();
  std::vector<ListedModel> models;
  fs::recursive_directory_iterator it(folder, fs::directory_options::skip_permission_denied);
  for (; it != fs::recursive_directory_iterator(); ++it) {
    std::error_code none;
    const fs::path& path = it->path();
    const bool hidden = path.filename().string().front() == '.';
    if (it->is_directory(none)) {
      if (hidden || is_left_out(path)) it.disable_recursion_pending();
    } else if (!hidden && it->is_regular_file(none) &&
               std::binary_search(endings.begin(), endings.end(), lower_ascii(path.extension().string()))) {
      models.push_back({path, name_for(path.lexically_relative(folder))});
    }
  }
  std::sort(models.begin(), models.end(), [](const auto& a, const auto& b) { return a.file < b.file; });
  if (models.empty())
    throw InputError(fmt::format("{}: holds no model; files are taken by their endings: {}", folder.string(),
                                 fmt::join(endings, " ")));
  return models;
}

std::vector<ListedModel> models_of_list(const std::string& list) {
  std::string text;
  if (list == "-")
    text.assign(std::istreambuf_iterator<char>(std::cin), {}), throw_if_stopped();
  else
    text = read_file(list, max_list_bytes);
  const std::string what = list == "-" ? "the list on stdin" : list;
  const char end = text.find('\0') == text.npos ? '\n' : '\0';
  std::vector<ListedModel> models;
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t stop = std::min(text.find(end, begin), text.size());
    std::string line = text.substr(begin, stop - begin);
    begin = stop + 1;
    if (end == '\n' && line.ends_with('\r')) line.pop_back();
    if (line.empty()) continue;
    models.push_back({line, name_for(fs::path(line).filename())});
  }
  if (models.empty()) throw InputError(fmt::format("{}: names no model; write a path a line", what));
  return models;
}

}  // namespace

std::vector<ListedModel> list_models(const std::vector<std::string>& words,
                                     const std::vector<fs::path>& but_not) {
  std::vector<ListedModel> all;
  std::set<fs::path> files;
  for (const std::string& word : words) {
    std::vector<ListedModel> models;
    if (word == "-") throw InputError("-: is one model, on stdin, and goes with no other; for a list say @-");
    if (word.starts_with('@'))
      models = models_of_list(word.substr(1));
    else if (is_of_many(word))
      models = models_in(word, but_not);
    else if (!fs::exists(word))
      throw InputError(fmt::format("{}: there is no such file or folder", word));
    else
      models = {{word, name_for(fs::path(word).filename())}};
    for (ListedModel& model : models)
      if (files.insert(fs::absolute(model.file).lexically_normal()).second) all.push_back(std::move(model));
  }
  tell_apart(all);
  return all;
}

}  // namespace limber::detail
