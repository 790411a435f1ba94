#include "limber/detail/body/model_content.h"

#include <algorithm>
#include <set>

#include "core/content_hash.h"
#include "core/error.h"
#include "core/hash.h"

namespace limber::detail {

namespace {

constexpr std::size_t longest_path = 300, longest_ending = 8;
constexpr std::uintmax_t max_named_bytes = std::uintmax_t(2) << 30;
constexpr std::uintmax_t max_mtl_bytes = 16 << 20;
constexpr std::size_t max_names = 100'000;  // no model names so many

bool is_letter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); }
bool is_digit(char c) { return c >= '0' && c <= '9'; }
bool ends_a_path(char c) {
  return static_cast<unsigned char>(c) < ' ' ||
         std::string_view("\"'<>|*?\x7f").find(c) != std::string_view::npos;
}

std::string without_percents(const std::string& text) {
  const auto digit = [](char c) { return is_digit(c) ? c - '0' : (c | 32) - 'a' + 10; };
  std::string plain;
  for (std::size_t i = 0; i < text.size(); ++i)
    if (text[i] == '%' && i + 2 < text.size() && std::isxdigit(static_cast<unsigned char>(text[i + 1])) &&
        std::isxdigit(static_cast<unsigned char>(text[i + 2])))
      plain += char(16 * digit(text[i + 1]) + digit(text[i + 2])), i += 2;
    else
      plain += text[i] == '\\' ? '/' : text[i];
  return plain;
}

// Words like "name.ending", with all that may be a path before them.
std::set<std::string> paths_in(std::string_view bytes) {
  std::set<std::string> paths;
  for (std::size_t dot = bytes.find('.'); dot != bytes.npos && paths.size() < max_names;
       dot = bytes.find('.', dot + 1)) {
    std::size_t end = dot + 1, begin = dot;
    if (end == bytes.size() || !is_letter(bytes[end])) continue;  // a number
    while (end < bytes.size() && end - dot <= longest_ending &&
           (is_letter(bytes[end]) || is_digit(bytes[end])))
      ++end;
    while (begin > 0 && dot - begin < longest_path && !ends_a_path(bytes[begin - 1])) --begin;
    paths.insert(without_percents(std::string(bytes.substr(begin, end - begin))));
  }
  return paths;
}

std::string ending_of(const fs::path& file) {
  std::string ending = file.extension().string();
  for (char& c : ending)
    if (c >= 'A' && c <= 'Z') c = char(c - 'A' + 'a');
  return ending;
}

// Those that count for the model: named in its bytes, or in those of its materials.
std::vector<fs::path> companions_of(std::string_view bytes, const fs::path& model) {
  std::vector<fs::path> files = files_named_in(bytes, model);
  for (const fs::path& materials : std::vector<fs::path>(files))
    if (ending_of(materials) == ".mtl") try {
        for (const fs::path& image : files_named_in(read_file(materials, max_mtl_bytes), model))
          if (std::find(files.begin(), files.end(), image) == files.end()) files.push_back(image);
      } catch (const InputError&) {  // importing reads none either
      }
  std::sort(files.begin(), files.end());
  return files;
}

}  // namespace

std::vector<fs::path> files_named_in(std::string_view bytes, const fs::path& model) {
  std::set<std::string> tried;
  std::vector<fs::path> files;
  std::error_code none;
  for (const std::string& path : paths_in(bytes))
    for (std::size_t begin = 0; begin < path.size();
         begin = std::min(path.find_first_of(" /:=,", begin), path.size() - 1) + 1) {
      const std::string name = path.substr(begin);
      if (name.empty() || tried.size() >= max_names || !tried.insert(name).second) continue;
      const fs::path file = model.parent_path() / name;
      if (fs::is_regular_file(file, none) && !fs::equivalent(file, model, none)) files.push_back(file);
    }
  std::sort(files.begin(), files.end());
  return files;
}

ModelContent content_of_model(const fs::path& model) {
  const std::string bytes = read_file(model);
  std::string all;
  for (const fs::path& file : companions_of(bytes, model)) {
    std::error_code none;
    if (fs::file_size(file, none) > max_named_bytes) continue;  // no model's
    try {
      all += fs::relative(file, model.parent_path(), none).string() + '\0' + content_hash(read_file(file)) +
             '\n';
    } catch (const InputError&) {  // what cannot be read here, importing cannot read either
    }
  }
  const std::string alone = content_hash(bytes);
  const std::string ending = ending_of(model);
  if (all.empty()) return {hex(hash_of(std::string_view(bytes))), alone, ending};
  return {hex(hash_of(std::string_view(alone + all))), content_hash(alone + all), ending};
}

}  // namespace limber::detail
