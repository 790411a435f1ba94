// Structs that are kept as tables of JSON. Each tells its fields once, to whoever reads or writes them:
//
//   struct Lease {
//     std::string owner;
//     std::optional<double> limit_s;  // null in the file: none
//     int tries = 1;                  // not in the file where it is 1
//     template <class Fields>
//     void fields(Fields& f) {
//       f("owner", owner), f("limit_s", limit_s), f.unless_usual("tries", tries, 1);
//     }
//   };
//   const auto lease = read_fields<Lease>(read_json(file), file.string(), "remove the file");
//   write_json(file, json_of_fields(lease));
//
// A field is a truth value, a number, a text, a path, Json (anything), such a struct, or a list, an array, a
// map from texts (InOrder: in the file's order) or an optional of these. A number may be whole or not where
// the field is a double; a whole one must fit the field. Other keys in the table are left alone.
#pragma once

#include <array>
#include <concepts>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "core/error.h"
#include "core/json.h"

namespace limber {

// "a whole number", "a text" and so on.
const char* kind_of(const Json&);

// Where a value stands: the file, the keys down to it; and what to do where it is wrong.
struct JsonPlace {
  std::string what, path, remedy;
  JsonPlace under(const std::string& key) const;
  JsonPlace under(std::size_t index) const;
  // They throw InputError "WHAT: PATH is a text, where a number belongs; REMEDY" and the like.
  [[noreturn]] void refuse(const Json& value, const char* belongs) const;
  [[noreturn]] void refuse_missing() const;
  [[noreturn]] void refuse_range(const Json& value, const Json& least, const Json& most) const;
};

void read_value(const Json&, bool&, const JsonPlace&);
void read_value(const Json&, std::int32_t&, const JsonPlace&);
void read_value(const Json&, std::int64_t&, const JsonPlace&);   // within ±2^62
void read_value(const Json&, std::uint64_t&, const JsonPlace&);  // from 0
void read_value(const Json&, double&, const JsonPlace&);
void read_value(const Json&, std::string&, const JsonPlace&);
void read_value(const Json&, fs::path&, const JsonPlace&);
void read_value(const Json&, Json&, const JsonPlace&);

template <class T>
constexpr bool is_plain_json = std::is_arithmetic_v<T> || std::same_as<T, std::string> ||
                               std::same_as<T, fs::path> || std::same_as<T, Json>;
template <class T>
constexpr bool is_vector = false;
template <class T>
constexpr bool is_vector<std::vector<T>> = true;
// A map in the order of its file.
template <class T>
using InOrder = std::vector<std::pair<std::string, T>>;
template <class T>
constexpr bool is_in_order = false;
template <class T>
constexpr bool is_in_order<InOrder<T>> = true;
template <class T>
constexpr bool is_array = false;
template <class T, std::size_t N>
constexpr bool is_array<std::array<T, N>> = true;
template <class T>
constexpr bool is_map = false;
template <class T>
constexpr bool is_map<std::map<std::string, T>> = true;
template <class T>
constexpr bool is_optional = false;
template <class T>
constexpr bool is_optional<std::optional<T>> = true;

class FieldReader {
 public:
  FieldReader(const Json& table, const JsonPlace& place) : table_(table), place_(place) {
    if (!table.is_object()) place.refuse(table, "a table");
  }

  // Must be there, unless it is an optional.
  template <class T>
  void operator()(const char* key, T& value) {
    if (table_.contains(key))
      read(table_[key], value, place_.under(key));
    else if (!is_optional<T>)
      place_.under(key).refuse_missing();
  }
  template <class T>
  void if_there(const char* key, T& value) {
    if (table_.contains(key)) read(table_[key], value, place_.under(key));
  }
  template <class T>
  void unless_usual(const char* key, T& value, const T&) {
    if_there(key, value);
  }
  template <class T>
  void within(const char* key, T& value, std::type_identity_t<T> least, std::type_identity_t<T> most) {
    (*this)(key, value);
    if (!(value >= least && value <= most)) place_.under(key).refuse_range(value, least, most);
  }

  template <class T>
  static void read(const Json& json, T& value, const JsonPlace& place) {
    if constexpr (is_plain_json<T>) {
      read_value(json, value, place);
    } else if constexpr (is_optional<T>) {
      value.reset();
      if (!json.is_null()) read(json, value.emplace(), place);
    } else if constexpr (is_in_order<T>) {
      if (!json.is_object()) place.refuse(json, "a table");
      value.clear();
      for (const auto& [key, entry] : json.items())
        read(entry, value.emplace_back(key, typename T::value_type::second_type{}).second, place.under(key));
    } else if constexpr (is_vector<T> || is_array<T>) {
      if (!json.is_array()) place.refuse(json, "a list");
      if constexpr (is_vector<T>)
        value.resize(json.size());
      else if (json.size() != value.size())
        place.refuse(json, "a list of another length");
      for (std::size_t i = 0; i < value.size(); ++i) read(json[i], value[i], place.under(i));
    } else if constexpr (is_map<T>) {
      if (!json.is_object()) place.refuse(json, "a table");
      for (const auto& [key, entry] : json.items()) read(entry, value[key], place.under(key));
    } else {
      FieldReader fields(json, place);
      value.fields(fields);
    }
  }

 private:
  const Json& table_;
  const JsonPlace& place_;
};

class FieldWriter {
 public:
  template <class T>
  void operator()(const char* key, const T& value) {
    table[key] = json_of(value);
  }
  // Not written where it is an optional without a value.
  template <class T>
  void if_there(const char* key, const T& value) {
    if constexpr (is_optional<T>)
      if (!value) return;
    table[key] = json_of(value);
  }
  template <class T>
  void unless_usual(const char* key, const T& value, const T& usual) {
    if (value != usual) table[key] = json_of(value);
  }
  template <class T>
  void within(const char* key, const T& value, std::type_identity_t<T>, std::type_identity_t<T>) {
    table[key] = json_of(value);
  }

  template <class T>
  static Json json_of(T value) {
    if constexpr (std::same_as<T, fs::path>) {
      return value.string();
    } else if constexpr (is_plain_json<T>) {
      return value;
    } else if constexpr (is_optional<T>) {
      return value ? json_of(*value) : Json();
    } else if constexpr (is_in_order<T> || is_map<T>) {
      Json map = Json::object();
      for (const auto& [key, one] : value) map[key] = json_of(one);
      return map;
    } else if constexpr (is_vector<T> || is_array<T>) {
      Json list = Json::array();
      for (const auto& one : value) list.push_back(json_of(one));
      return list;
    } else {
      FieldWriter fields;
      value.fields(fields);
      return fields.table;
    }
  }

  Json table = Json::object();
};

// Throws InputError naming the first key that is missing, of another kind, or out of its range.
template <class T>
T read_fields(const Json& table, const std::string& what, const std::string& remedy) {
  T value{};
  FieldReader::read(table, value, JsonPlace{what, "", remedy});
  return value;
}

// Of files that count for nothing where they are damaged: nothing where read_fields would throw.
template <class T>
std::optional<T> fields_or_nothing(const Json& table) try {
  return read_fields<T>(table, "", "");
} catch (const InputError&) {
  return std::nullopt;
}

template <class T>
Json json_of_fields(const T& value) {
  return FieldWriter::json_of(value);
}

}  // namespace limber
