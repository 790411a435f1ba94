#include "core/lock.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>

#include "core/error.h"
#include "core/progress.h"

namespace limber {

namespace {
constexpr int between_tries_us = 20000;

[[noreturn]] void refuse(const fs::path& folder) {
  throw InputError(
      fmt::format("{}: another limber is at work in this folder; wait until it ends, or name another folder",
                  folder.string()));
}
}  // namespace

FolderLock::FolderLock(const fs::path& folder, Kind kind, Patience patience)
    : descriptor_(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC)) {
  const auto is_held = [&] {
    return descriptor_ >= 0 && ::flock(descriptor_, (kind == alone ? LOCK_EX : LOCK_SH) | LOCK_NB) != 0 &&
           errno == EWOULDBLOCK;
  };
  while (is_held()) {
    if (patience == waits && stop_signal() == 0) {
      ::usleep(between_tries_us);
      continue;
    }
    ::close(descriptor_);
    throw_if_stopped();
    refuse(folder);
  }
}
FolderLock::~FolderLock() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

void FolderLock::share() {
  if (descriptor_ >= 0) ::flock(descriptor_, LOCK_SH | LOCK_NB);
}

}  // namespace limber
