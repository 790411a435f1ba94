#include "core/file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <mutex>
#include <set>
#include <utility>

#include "core/error.h"
#include "core/temporary_files.h"

namespace limber {

namespace {

[[noreturn]] void throw_disk_error(const fs::path& path, const char* doing) {
  throw DiskError(fmt::format("{}: {} failed: {}", path.string(), doing, std::strerror(errno)));
}

class Descriptor {
 public:
  explicit Descriptor(int fd) : fd_(fd) {}
  ~Descriptor() {
    if (fd_ >= 0) ::close(fd_);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  operator int() const { return fd_; }
  int release() { return std::exchange(fd_, -1); }

 private:
  int fd_;
};

// Best effort: some file systems refuse fsync on a folder.
void sync_folder(const fs::path& folder) {
  const Descriptor fd(::open(folder.empty() ? "." : folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (fd >= 0) ::fsync(fd);
}

// Where a file is to be renamed to: a link stays, and what it leads to is replaced. Devices and pipes are not
// replaced.
fs::path destination(const fs::path& path) {
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  if (!fs::exists(status)) return path;
  if (!fs::is_regular_file(status) && !fs::is_directory(status))
    throw DiskError(
        fmt::format("{}: is a device or a pipe; files are written whole, so name a file", path.string()));
  return fs::is_symlink(fs::symlink_status(path, error)) ? fs::canonical(path) : path;
}

// What killed processes left goes as soon as this one writes beside it: once for each folder.
void remove_abandoned_beside(const fs::path& path) {
  static std::mutex mutex;
  static std::set<fs::path> done;
  std::error_code error;
  const fs::path folder = fs::absolute(path, error).parent_path();
  const std::lock_guard lock(mutex);
  if (done.insert(folder).second) remove_abandoned(folder);
}

}  // namespace

namespace {

[[noreturn]] void refuse_size(const fs::path& path, const std::string& size, std::uintmax_t max_bytes) {
  throw InputError(
      fmt::format("{}: holds {} bytes, and at most {} are read of such a file; is it the right one?",
                  path.string(), size, max_bytes));
}

}  // namespace

FileReader::FileReader(const fs::path& path, std::uintmax_t max_bytes) : path_(path) {
  // Opening a pipe without O_NONBLOCK would wait for somebody to write to it.
  Descriptor fd(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY));
  if (fd < 0) throw InputError(fmt::format("{}: cannot be read: {}", path.string(), std::strerror(errno)));
  struct stat status;
  if (::fstat(fd, &status) != 0)
    throw InputError(fmt::format("{}: cannot be read: {}", path.string(), std::strerror(errno)));
  if (S_ISDIR(status.st_mode)) throw InputError(fmt::format("{}: is a folder, not a file", path.string()));
  if (!S_ISREG(status.st_mode))
    throw InputError(fmt::format(
        "{}: is a pipe or a device, not a file; save what it gives to a file and name that", path.string()));
  if (std::uintmax_t(status.st_size) > max_bytes)
    refuse_size(path, std::to_string(status.st_size), max_bytes);
  descriptor_ = fd.release(), size_ = std::uintmax_t(status.st_size);
}

FileReader::~FileReader() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

int FileReader::release() { return std::exchange(descriptor_, -1); }

std::size_t FileReader::read(std::span<char> to) {
  while (true) {
    const ssize_t got = ::read(descriptor_, to.data(), to.size());
    if (got < 0 && errno == EINTR) continue;
    if (got < 0)
      throw InputError(fmt::format("{}: reading failed: {}", path_.string(), std::strerror(errno)));
    return std::size_t(got);
  }
}

std::string read_file(const fs::path& path, std::uintmax_t max_bytes) {
  FileReader file(path, max_bytes);
  std::string content;
  content.reserve(std::size_t(file.size()) + 1);
  std::size_t size = 0;
  while (true) {
    content.resize(size + std::max<std::size_t>(1 << 16, content.capacity() - size));
    const std::size_t got = file.read(std::span(content).subspan(size));
    size += got;
    if (got == 0) break;
    // It grows, or does not tell its size.
    if (size > max_bytes) refuse_size(path, "more and more", max_bytes);
  }
  content.resize(size);
  return content;
}

void write_file(const fs::path& path, std::string_view content) {
  FileWriter writer(path);
  writer.append(content);
  writer.commit();
}

FileWriter::FileWriter(const fs::path& path) : path_(path), pending_(path) {
  descriptor_ = ::open(pending_.temporary().c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
  if (descriptor_ < 0) throw_disk_error(path, "creating it");
}

FileWriter::~FileWriter() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

void FileWriter::append(std::string_view content) {
  while (!content.empty()) {
    const ssize_t written = ::write(descriptor_, content.data(), content.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) throw_disk_error(path_, "writing it");
    content.remove_prefix(std::size_t(written));
    size_ += std::uintmax_t(written);
  }
}

void FileWriter::write_at(std::uintmax_t place, std::string_view content) {
  LIMBER_CHECK(place <= size_, place, size_);
  while (place < size_ && !content.empty()) {
    const std::size_t over = std::min<std::uintmax_t>(content.size(), size_ - place);
    const ssize_t written = ::pwrite(descriptor_, content.data(), over, off_t(place));
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) throw_disk_error(path_, "writing it");
    content.remove_prefix(std::size_t(written));
    place += std::uintmax_t(written);
  }
  append(content);
}

void FileWriter::commit() {
  ::close(descriptor_);
  descriptor_ = -1;
  pending_.commit();
}

PendingFile::PendingFile(fs::path final_path)
    : final_(destination(final_path)), temporary_(temporary_name(final_)) {
  remove_abandoned_beside(final_);
}

PendingFile::~PendingFile() {
  if (committed_) return;
  std::error_code ignored;
  fs::remove(temporary_, ignored);
}

void PendingFile::commit() {
  {
    const Descriptor fd(::open(temporary_.c_str(), O_RDONLY | O_CLOEXEC));
    if (fd < 0) throw_disk_error(temporary_, "opening it");
    if (::fsync(fd) != 0) throw_disk_error(final_, "fsync");
  }
  if (::rename(temporary_.c_str(), final_.c_str()) != 0)
    throw_disk_error(final_, "renaming the finished file to it");
  committed_ = true;
  sync_folder(final_.parent_path());
}

void make_folder(const fs::path& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error == std::errc::not_a_directory)
    throw DiskError(fmt::format("{}: is a file, or within one, not a folder; name another", folder.string()));
  if (error) throw DiskError(fmt::format("{}: cannot be made: {}", folder.string(), error.message()));
  if (::access(folder.c_str(), W_OK) != 0) throw_disk_error(folder, "getting permission to write into it");
}

}  // namespace limber
