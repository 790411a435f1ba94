#include "core/temporary_files.h"

#include <unistd.h>

#include <atomic>
#include <chrono>
#include <regex>
#include <vector>

#include "core/error.h"
#include "core/hash.h"
#include "core/process.h"

namespace limber {

const std::string& place_of_processes() {
  static const std::string place = [] {
    char host[256] = "";
    ::gethostname(host, sizeof host - 1);
    std::error_code none;
    std::string names = host + fs::read_symlink("/proc/self/ns/pid", none).string();
    try {
      names += read_file("/proc/sys/kernel/random/boot_id");
    } catch (const InputError&) {  // not Linux
    }
    return fmt::format("{:08x}", hash_of(names) & 0xffffffff);
  }();
  return place;
}

fs::path temporary_name(const fs::path& final_path) {
  static std::atomic<unsigned> counter{0};
  fs::path name = final_path;
  name.replace_filename(fmt::format(".{}.{}.{}.{}.tmp{}", final_path.stem().string(), place_of_processes(),
                                    ::getpid(), counter++, final_path.extension().string()));
  return name;
}

int remove_abandoned(const fs::path& folder) {
  static const std::regex temporary(R"(\..+\.([0-9a-f]{8})\.([0-9]{1,9})\.[0-9]+\.tmp(\.[^.]*)?)");
  std::vector<fs::path> abandoned;
  std::error_code none;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, none)) {
    const std::string name = entry.path().filename().string();
    std::smatch parts;
    if (!std::regex_match(name, parts, temporary) || !entry.is_regular_file(none)) continue;
    const auto written = entry.last_write_time(none);
    if (parts[1] == place_of_processes()
            ? has_ended(std::stol(parts[2]))
            : written < fs::file_time_type::clock::now() - std::chrono::hours(24))
      abandoned.push_back(entry.path());
  }
  int removed = 0;
  for (const fs::path& file : abandoned) removed += fs::remove(file, none);
  return removed;
}

}  // namespace limber
