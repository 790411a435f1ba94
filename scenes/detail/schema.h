// The one table of all keys of a scene file: their type, unit, range, default and meaning. The reader checks
// by it and docs/scene.md is generated from it.
#pragma once

#include <limits>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/words.h"
#include "scenes/detail/complaints.h"
#include "scenes/detail/document.h"

namespace limber::scenes {

enum class Type {
  text,
  name,
  choice,
  number,
  integer,
  boolean,
  vector,
  integers,
  range,
  box,
  region,  // a box that may be flat
  boxes,
  points,  // two at least
  color,
  fixed,
  names,   // a list of texts
  bodies,  // a text, or a list of texts
  labels,  // true or false, a list of texts, or a table of texts
  table,
  tables
};

struct Interval {
  double lower = -std::numeric_limits<double>::infinity();
  double upper = std::numeric_limits<double>::infinity();
  bool above_lower = false, below_upper = false;  // the end itself is out

  bool holds(double x) const;
  std::string text() const;  // "> 0", "0.25 ≤ x < 0.5"; empty when all is allowed
};

inline constexpr std::string_view required = "required";
inline constexpr std::string_view may_lack = "";

struct Key {
  std::string_view path;  // "bodies[].material.friction"; [] stands for each element of a list
  Type type;
  Interval interval;          // of each number in it
  int count;                  // vector, integers: how many numbers
  std::string_view fallback;  // TOML; or required, or may_lack
  std::string_view meaning;   // unit first
  std::string_view choices;   // choice: "a, b, c"
  std::string_view fast;      // fallback with planner.preset = "fast"; empty: the same

  std::string_view parent() const;  // "bodies[].material"; "" at the top
  std::string_view name() const;    // "friction"
  std::string expected() const;     // "a number > 0"
  std::string example() const;      // "friction = 0.2"
};

std::span<const Key> keys();
const Key* find_key(std::string_view path);

// The keys of the table at `path`, in the order of the table.
std::vector<const Key*> keys_in(std::string_view path);

// What to try instead of an unknown key: the table it belongs into, the key meant, or a list of those that
// may stand there.
std::string suggestion(std::string_view parent_path, std::string_view unknown);

// Complains of what is not as the table of keys says: unknown key, wrong type, out of range, required key
// that lacks. Puts in the defaults. After this, where there was no complaint, every typed read by a path of
// the table succeeds.
void check_and_complete(Node& root, const Complaints& = Complaints());

}  // namespace limber::scenes
