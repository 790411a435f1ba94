#include "core/json.h"

#include "core/error.h"

namespace limber {

Json parse_json(const std::string& text, const std::string& what) {
  try {
    return Json::parse(text);
  } catch (const Json::parse_error& error) {
    const auto at = std::min(std::size_t(error.byte), text.size());
    const auto line = 1 + std::count(text.begin(), text.begin() + std::ptrdiff_t(at), '\n');
    throw InputError(fmt::format("{}:{}: is not valid JSON: {}", what, line, error.what()));
  } catch (const Json::out_of_range& error) {
    throw InputError(fmt::format("{}: holds a number that no computer can: {}", what, error.what()));
  }
}

Json read_json(const fs::path& path) { return parse_json(read_file(path), path.string()); }
void write_json(const fs::path& path, const Json& json) { write_file(path, json.dump(2) + "\n"); }

}  // namespace limber
