#include "core/json_lines.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <sstream>

#include "core/error.h"
#include "core/json_text.h"

namespace limber {

JsonLines::JsonLines(fs::path file) : file_(std::move(file)) {}

std::vector<Json> JsonLines::read() const {
  std::vector<Json> lines;
  std::error_code none;
  if (!fs::exists(file_, none)) return lines;
  std::istringstream text(read_file(file_));
  for (std::string line; std::getline(text, line);)
    if (Json json = Json::parse(line, nullptr, false); !json.is_discarded()) lines.push_back(std::move(json));
  return lines;
}

void JsonLines::append(const Json& line) {
  std::error_code none;
  if (!ended_ && fs::exists(file_, none) && !read_file(file_).ends_with('\n')) write("\n");
  ended_ = true;
  write(text_of(line) + "\n");
}

void JsonLines::write(const std::string& text) const {
  const int fd = ::open(file_.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0644);
  const bool written = fd >= 0 && ::write(fd, text.data(), text.size()) == ssize_t(text.size());
  const int error = errno;
  if (fd >= 0) ::close(fd);
  if (!written)
    throw DiskError(fmt::format("{}: writing it failed: {}", file_.string(), std::strerror(error)));
}

}  // namespace limber
