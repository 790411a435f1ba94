// Files to which a line of JSON is added whenever something is done.
#pragma once

#include <vector>

#include "core/file.h"
#include "core/json.h"

namespace limber {

// The file need not be there yet. Lines of several processes come one after the other, each whole.
class JsonLines {
 public:
  explicit JsonLines(fs::path file);
  // Without what a killed process left half written.
  std::vector<Json> read() const;
  // Throws DiskError.
  void append(const Json&);

 private:
  void write(const std::string&) const;
  fs::path file_;
  bool ended_ = false;  // by a line's end, as far as this process goes
};

}  // namespace limber
