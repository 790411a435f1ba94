// A folder that lives as long as the test, in memory where that can be: what is written to a disk to stay
// there is waited for.
#pragma once

#include <stdlib.h>

#include <filesystem>
#include <string>

#include "core/error.h"

namespace limber {

class TemporaryFolder {
 public:
  TemporaryFolder() {
    const std::filesystem::path disk = std::filesystem::temp_directory_path();
    for (const auto& where : {::getenv("TMPDIR") ? disk : std::filesystem::path("/dev/shm"), disk}) {
      std::string name = (where / "limber-XXXXXX").string();
      if (!::mkdtemp(name.data())) continue;
      path_ = name;
      return;
    }
    throw DiskError("no temporary folder can be made");
  }
  ~TemporaryFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  const std::filesystem::path& path() const { return path_; }
  std::filesystem::path operator/(const std::string& name) const { return path_ / name; }

 private:
  std::filesystem::path path_;
};

}  // namespace limber
