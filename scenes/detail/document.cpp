#include "scenes/detail/document.h"

#include <toml++/toml.h>

#include <algorithm>

namespace limber::scenes {

namespace {

Where where_of(const toml::source_position& at, const std::string& source) {
  return {source, int(at.line), int(at.column)};
}

bool stands_before(const Where& a, const Where& b) {
  return std::pair(a.line, a.column) < std::pair(b.line, b.column);
}

// What walks through tables within tables calls itself, toml++ on the way out of them, too: so a key like
// a.b.c may have few parts. (toml++ itself bounds how deep lists and inline tables are.)
constexpr int max_parts = 16, max_depth = 64;

void require_short_keys(std::string_view text, const std::string& source) {
  int dots = 0, line = 1;
  std::string_view quotes;  // in a string: what ends it
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    line += c == '\n';
    const std::string_view rest = text.substr(i);
    if (!quotes.empty()) {
      if (c == '\\' && quotes[0] == '"') {
        if (++i < text.size()) line += text[i] == '\n';
      } else if (rest.starts_with(quotes) || (quotes.size() == 1 && c == '\n')) {
        i += quotes.size() - 1;
        quotes = {};
      }
    } else if (c == '"' || c == '\'') {
      const bool long_one = rest.size() > 2 && rest[1] == c && rest[2] == c;
      quotes = rest.substr(0, long_one ? 3 : 1);
      i += quotes.size() - 1;
    } else if (c == '#') {
      i += std::min(rest.find('\n'), rest.size()) - 1;
    } else if (std::string_view("\n=,[]{}").find(c) != std::string_view::npos) {
      dots = 0;
    } else if (c == '.' && ++dots >= max_parts) {
      throw InputError(
          fmt::format("{}: a key has more than {} parts, and none of a scene has more than five; see "
                      "docs/scene.md",
                      Where{source, line, 1}.text(), max_parts));
    }
  }
}

Node converted(const toml::node& node, const std::string& source, int depth = 0) {
  Node made{where_of(node.source().begin, source), {}};
  if (depth > max_depth)
    throw InputError(
        fmt::format("{}: tables and lists are more than {} deep here, and none of a scene is; see "
                    "docs/scene.md",
                    made.where.text(), max_depth));
  if (const auto* table = node.as_table()) {
    Table entries;
    for (const auto& [key, value] : *table)
      entries.push_back({std::string(key.str()), where_of(key.source().begin, source),
                         converted(value, source, depth + 1)});
    std::stable_sort(entries.begin(), entries.end(),
                     [](const Entry& a, const Entry& b) { return stands_before(a.where, b.where); });
    made.value = std::move(entries);
  } else if (const auto* array = node.as_array()) {
    Array elements;
    for (const auto& element : *array) elements.push_back(converted(element, source, depth + 1));
    made.value = std::move(elements);
  } else if (const auto* text = node.as_string()) {
    made.value = text->get();
  } else if (const auto* integer = node.as_integer()) {
    made.value = integer->get();
  } else if (const auto* number = node.as_floating_point()) {
    made.value = number->get();
  } else if (const auto* flag = node.as_boolean()) {
    made.value = flag->get();
  } else {
    throw InputError(
        fmt::format("{}: dates and times have no meaning in a scene; put quotes round it to make it a text",
                    made.where.text()));
  }
  return made;
}

// "Error while parsing key-value pair: cannot redefine …" → "cannot redefine …"
std::string sentence(std::string_view description) {
  const auto colon = description.find(": ");
  if (description.starts_with("Error while") && colon != description.npos)
    return fmt::format("{} ({})", description.substr(colon + 2), description.substr(6, colon - 6));
  return std::string(description);
}

}  // namespace

std::string Where::text() const { return line == 0 ? source : fmt::format("{}:{}:{}", source, line, column); }

const char* Node::type_name() const {
  static constexpr const char* names[] = {"a whole number", "a number", "true or false",
                                          "a text",         "a list",   "a table"};
  return names[value.index()];
}

const Node* Node::find(std::string_view key) const {
  if (const auto* entries = table())
    for (const Entry& entry : *entries)
      if (entry.key == key) return &entry.value;
  return nullptr;
}
Node* Node::find(std::string_view key) { return const_cast<Node*>(std::as_const(*this).find(key)); }

Node parse_document(const std::string& text, const std::string& source) {
  require_short_keys(text, source);
  try {
    return converted(toml::parse(std::string_view(text), std::string_view(source)), source);
  } catch (const toml::parse_error& error) {
    if (error.description().find("utf-8") != std::string_view::npos)
      throw InputError(fmt::format("{}: this is not UTF-8, in which TOML is written; save the file as that",
                                   where_of(error.source().begin, source).text()));
    throw InputError(fmt::format("{}: this is not TOML: {}; see docs/scene.md for how a scene is written",
                                 where_of(error.source().begin, source).text(),
                                 sentence(error.description())));
  }
}

Node parse_set_value(const std::string& value, const std::string& source) {
  const auto without_line = [](Node& node, auto&& self) -> void {
    node.where.line = 0;
    if (auto* elements = std::get_if<Array>(&node.value))
      for (Node& element : *elements) self(element, self);
    if (auto* entries = std::get_if<Table>(&node.value))
      for (Entry& entry : *entries) entry.where.line = 0, self(entry.value, self);
  };
  Node node{{source, 0, 0}, value};
  require_short_keys(value, source);
  try {
    const toml::table parsed = toml::parse(std::string_view("v = " + value));
    if (parsed.size() == 1) node = converted(*parsed.get("v"), source);
  } catch (const toml::parse_error&) {
    // A bare word such as fast: the text that node already holds.
  }
  without_line(node, without_line);
  return node;
}

}  // namespace limber::scenes
