#include "meshing/detail/companions.h"

#include <algorithm>

#include "core/error.h"
#include "core/words.h"

namespace limber::meshing::detail {

namespace {

// "%20" and the like, as a glTF has them.
std::string without_percents(const std::string& path) {
  std::string plain;
  for (std::size_t i = 0; i < path.size(); ++i) {
    const auto is_hex = [&](std::size_t at) {
      return at < path.size() && std::isxdigit(int(path[at] & 0x7f));
    };
    if (path[i] == '%' && is_hex(i + 1) && is_hex(i + 2))
      plain += char(std::stoi(path.substr(i + 1, 2), nullptr, 16)), i += 2;
    else
      plain += path[i];
  }
  return plain;
}

bool leads_out(const fs::path& relative) {
  const fs::path plain = relative.lexically_normal();
  return plain.is_absolute() || plain.empty() || *plain.begin() == "..";
}

}  // namespace

std::string tamed(const std::string& name) {
  std::string plain = name.substr(0, max_letters_of_names);
  std::replace_if(
      plain.begin(), plain.end(), [](char c) { return std::uint8_t(c) < 32 || c == 127; }, '?');
  if (!is_utf8(plain))
    std::replace_if(
        plain.begin(), plain.end(), [](char c) { return std::uint8_t(c) > 127; }, '?');
  return plain;
}

std::optional<fs::path> path_beside(const fs::path& model, std::string named) {
  if (named.find('\0') != named.npos || named.size() > 1000) return std::nullopt;
  std::replace(named.begin(), named.end(), '\\', '/');
  if (named.starts_with("/") || (named.size() > 2 && named[1] == ':' && named[2] == '/'))
    named = named.substr(named.find_last_of('/') + 1);
  const fs::path folder = model.has_parent_path() ? model.parent_path() : fs::path(".");
  std::error_code error;
  fs::path relative = named;
  if (!fs::exists(folder / relative, error)) {
    const fs::path plain = without_percents(named);
    if (plain.native().find('\0') == std::string::npos && fs::exists(folder / plain, error)) relative = plain;
  }
  if (leads_out(relative)) return std::nullopt;
  // Links count as the files that they lead to.
  const fs::path from = fs::weakly_canonical(folder, error),
                 to = fs::weakly_canonical(folder / relative, error);
  if (error || leads_out(to.lexically_relative(from))) return std::nullopt;
  return relative.lexically_normal();
}

Companion read_companion(const fs::path& model, const std::string& named, std::uintmax_t max_bytes) {
  const std::string said = tamed(named);
  const std::optional<fs::path> relative = path_beside(model, named);
  if (!relative)
    return {{},
            fmt::format("\"{}\" leads out of the model's folder, and is not read; put it beside the model",
                        said)};
  const fs::path path = model.parent_path() / *relative;
  std::error_code error;
  if (!fs::exists(path, error))
    return {{}, fmt::format("\"{}\" is not there; put it beside the model", said)};
  try {
    return {read_file(path, max_bytes), ""};
  } catch (const InputError& complaint) {
    return {{}, complaint.what()};
  }
}

}  // namespace limber::meshing::detail
