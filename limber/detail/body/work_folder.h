// Where a call works that is told no folder.
#pragma once

#include <filesystem>

namespace limber::detail {

// A folder that goes with it, if it is a temporary one.
class WorkFolder {
 public:
  // Empty: a temporary one. Throws DiskError.
  explicit WorkFolder(std::filesystem::path);
  ~WorkFolder();
  WorkFolder(const WorkFolder&) = delete;
  WorkFolder& operator=(const WorkFolder&) = delete;
  const std::filesystem::path& path() const { return path_; }

 private:
  bool temporary_;  // made, and removed, by us
  std::filesystem::path path_;
};

}  // namespace limber::detail
