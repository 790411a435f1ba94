#include "limber/detail/body/work_folder.h"

#include <fmt/format.h>
#include <stdlib.h>

#include "core/error.h"

namespace limber::detail {

namespace {

std::filesystem::path temporary_folder() {
  std::string name = (std::filesystem::temp_directory_path() / "limber-XXXXXX").string();
  if (!mkdtemp(name.data())) throw DiskError(fmt::format("{}: creating it failed", name));
  return name;
}

}  // namespace

WorkFolder::WorkFolder(std::filesystem::path path)
    : temporary_(path.empty()), path_(temporary_ ? temporary_folder() : std::move(path)) {}

WorkFolder::~WorkFolder() {
  std::error_code ignored;
  if (temporary_) std::filesystem::remove_all(path_, ignored);
}

}  // namespace limber::detail
