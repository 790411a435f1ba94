#include "core/json.h"

#include <functional>
#include <set>

#include "core/error.h"
#include "core/json_text.h"

namespace limber {

namespace {

// Before it is parsed, for what is parsed must be destroyed again. Of what is not JSON any answer will do.
void require_shallow(const std::string& text, const std::string& what) {
  int depth = 0, line = 1;
  bool in_string = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    line += c == '\n';
    if (in_string && c == '\\') {
      ++i;
    } else if (c == '"') {
      in_string = !in_string;
    } else if (!in_string && (c == '[' || c == '{')) {
      if (++depth > max_json_depth)
        throw InputError(
            fmt::format("{}:{}: has lists within lists more than {} deep, which nothing of limber's has; is "
                        "it the right file?",
                        what, line, max_json_depth));
    } else if (!in_string && (c == ']' || c == '}')) {
      --depth;
    }
  }
}

// Whoever has a key twice says two things, and readers differ in which they hear.
class KeysOnce {
 public:
  explicit KeysOnce(const std::string& what) : what_(what) {}
  bool operator()(int, Json::parse_event_t event, const Json& parsed) {
    if (event == Json::parse_event_t::object_start) keys_.emplace_back();
    if (event == Json::parse_event_t::object_end) keys_.pop_back();
    if (event == Json::parse_event_t::key && !keys_.back().insert(parsed.get<std::string>()).second)
      throw InputError(fmt::format("{}: has the key {} twice in one table", what_, text_of(parsed)));
    return true;
  }

 private:
  const std::string& what_;
  std::vector<std::set<std::string>> keys_;  // of each table that is open
};

}  // namespace

Json parse_json(const std::string& text, const std::string& what) {
  require_shallow(text, what);
  try {
    KeysOnce once(what);
    return Json::parse(text, std::ref(once));
  } catch (const Json::parse_error& error) {
    const auto at = std::min(std::size_t(error.byte), text.size());
    const auto line = 1 + std::count(text.begin(), text.begin() + std::ptrdiff_t(at), '\n');
    throw InputError(fmt::format("{}:{}: is not valid JSON: {}", what, line, words_of(error)));
  } catch (const Json::out_of_range& error) {
    throw InputError(fmt::format("{}: holds a number that no computer can: {}", what, words_of(error)));
  }
}

Json read_json(const fs::path& path) { return parse_json(read_file(path, max_json_bytes), path.string()); }
std::string text_of(const Json& json, int indent) {
  return json.dump(indent, ' ', false, Json::error_handler_t::replace);
}
void write_json(const fs::path& path, const Json& json) { write_file(path, text_of(json, 2) + "\n"); }

// It writes "[json.exception.parse_error.101] parse error at line 1, column 10: syntax error …".
std::string words_of(const Json::exception& trouble) {
  const std::string_view all = trouble.what();
  const auto end = all.starts_with('[') ? all.find("] ") : all.npos;
  std::string_view words = end == all.npos ? all : all.substr(end + 2);
  if (words.starts_with("parse error")) words = words.substr(words.find(": ") + 2);
  return std::string(words);
}

}  // namespace limber
