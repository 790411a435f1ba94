// A TOML text as a small tree of values that know where they stand. Hides toml++ (slow to compile, and its
// copies of a node forget where it stood).
#pragma once

#include <string>
#include <variant>
#include <vector>

#include "core/error.h"

namespace limber::scenes {

struct Where {
  std::string source;        // "scene.toml" or "--set a.b=1"
  int line = 0, column = 0;  // from 1; 0: the source has no lines
  std::string text() const;  // "scene.toml:3:7" or "--set a.b=1"
};

struct Node;
struct Entry;
using Array = std::vector<Node>;
using Table = std::vector<Entry>;  // in the order of the text

struct Node {
  Where where;
  std::variant<std::int64_t, double, bool, std::string, Array, Table> value;

  const char* type_name() const;  // "a number", "a text" … for messages
  const Table* table() const { return std::get_if<Table>(&value); }
  const Array* array() const { return std::get_if<Array>(&value); }
  const Node* find(std::string_view key) const;  // in a table
  Node* find(std::string_view key);
};
struct Entry {
  std::string key;
  Where where;  // of the key
  Node value;
};

// Throws InputError "source:line:column: …" at what is not TOML.
Node parse_document(const std::string& text, const std::string& source);

// The value that follows the = of "--set a.b=value"; what is not a TOML value is a text.
Node parse_set_value(const std::string& value, const std::string& source);

}  // namespace limber::scenes
