// Files that somebody edits, looked at a few times a second. Editors write a file in place or put another in
// its place, by which inotify, which knows files and not names, would lose it.
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "limber/scene.h"

namespace limber {

struct Stamp {
  std::int64_t bytes = -1, written_ns = 0;  // −1: there is no such file
  bool operator==(const Stamp&) const = default;
};
LIMBER_API std::vector<Stamp> stamps_of(const std::vector<std::filesystem::path>&);

// Those that a still of the scene shows: the scene first, its models and what these name; of a scene that
// cannot be read the scene alone.
LIMBER_API std::vector<std::filesystem::path> files_shown(const SceneSource&, const Context& = {});

class LIMBER_API Edits {
 public:
  // `read`: taken before the files were read.
  explicit Edits(std::vector<Stamp> read) : read_(read), last_(std::move(read)) {}
  // Of one look: whether the files should be read again. Once after every change, when two looks on end found
  // the same, so that nobody is writing, and all files there.
  bool are_done(const std::vector<Stamp>& now);

 private:
  std::vector<Stamp> read_, last_;
};

}  // namespace limber
