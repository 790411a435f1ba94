// Typed reads of a table of the scene: number(table, "radius_m"), vector(table, "axis"), text(table, "name")
// … Types, ranges and lengths are not checked here: check_and_complete() (scenes/detail/schema.h) came
// before, so they are as the table of keys says, and a key that has a default is there. What may lack is
// asked for by maybe_number(), text_or() or Node::find().
#pragma once

#include <cmath>
#include <initializer_list>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "core/mesh.h"
#include "scenes/detail/document.h"

namespace limber::scenes {

// Every complaint of the reader: "scene.toml:12:24: what; what to try".
[[noreturn]] inline void complain(const Node& node, const std::string& what) {
  throw InputError(fmt::format("{}: {}", node.where.text(), what));
}

inline const Node& child(const Node& table, std::string_view key) {
  const Node* node = table.find(key);
  LIMBER_CHECK(node, key);
  return *node;
}
inline double as_number(const Node& node) {
  const auto* integer = std::get_if<std::int64_t>(&node.value);
  return integer ? double(*integer) : std::get<double>(node.value);
}
inline double number(const Node& table, std::string_view key) { return as_number(child(table, key)); }
inline int integer(const Node& table, std::string_view key) { return int(number(table, key)); }
inline std::optional<double> maybe_number(const Node& table, std::string_view key) {
  const Node* node = table.find(key);
  return node ? std::optional(as_number(*node)) : std::nullopt;
}
inline bool flag(const Node& table, std::string_view key) { return std::get<bool>(child(table, key).value); }
inline const std::string& as_text(const Node& node) { return std::get<std::string>(node.value); }
inline const std::string& text(const Node& table, std::string_view key) { return as_text(child(table, key)); }
inline std::string text_or(const Node& table, std::string_view key, const char* otherwise) {
  const Node* node = table.find(key);
  return node ? as_text(*node) : otherwise;
}
inline const Array& list(const Node& table, std::string_view key) { return *child(table, key).array(); }
inline Vec3 as_vector(const Node& node) {
  const Array& a = *node.array();
  return {as_number(a[0]), as_number(a[1]), as_number(a[2])};
}
inline Vec3 vector(const Node& table, std::string_view key) { return as_vector(child(table, key)); }
inline Eigen::Vector2d vector2(const Node& table, std::string_view key) {
  const Array& a = list(table, key);
  return {as_number(a[0]), as_number(a[1])};
}
inline Box as_box(const Node& node) { return {as_vector((*node.array())[0]), as_vector((*node.array())[1])}; }
inline Box box(const Node& table, std::string_view key) { return as_box(child(table, key)); }
// "#rrggbb"; each channel 0 … 1.
inline Vec3 as_color(const std::string& rrggbb) {
  const auto channel = [&](std::size_t at) { return std::stoi(rrggbb.substr(at, 2), nullptr, 16) / 255.0; };
  return {channel(1), channel(3), channel(5)};
}
// As a unit vector.
inline Vec3 direction(const Node& table, std::string_view key, const char* what) {
  const Vec3 v = vector(table, key);
  if (v.norm() < 1e-9)
    complain(child(table, key),
             fmt::format("{} is [0, 0, 0], which points nowhere; write a direction", what));
  return v.normalized();
}

// The value that a word of a choice stands for.
template <class Look>
Look named(const std::string& word, std::initializer_list<std::pair<const char*, Look>> looks) {
  for (const auto& [name, look] : looks)
    if (word == name) return look;
  LIMBER_CHECK(false, word);
}

}  // namespace limber::scenes
