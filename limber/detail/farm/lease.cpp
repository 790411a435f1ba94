#include "limber/detail/farm/lease.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <optional>
#include <vector>

#include "core/error.h"
#include "core/json_fields.h"
#include "core/json_text.h"
#include "core/process.h"
#include "core/temporary_files.h"

namespace limber::detail {

namespace {

// A lease's file.
struct Owner {
  std::string owner, place;
  std::int64_t pid = 0, began = 0;
  std::string beat;
  template <class Fields>
  void fields(Fields& f) {
    f("owner", owner), f("place", place), f("pid", pid), f("began", began), f.if_there("beat", beat);
  }
};

struct Parts {
  std::string unit;
  int taken;
};
std::optional<Parts> parts_of(const std::string& name) {
  const std::size_t dot = name.rfind('.');
  if (dot == name.npos || dot == 0 || dot + 1 == name.size() || name.size() - dot > 9) return std::nullopt;
  const std::string number = name.substr(dot + 1);
  if (number.find_first_not_of("0123456789") != number.npos) return std::nullopt;
  return Parts{name.substr(0, dot), std::stoi(number)};
}

// "" where it cannot be read: it has just gone, or was just made.
std::string text_in(const fs::path& file) {
  try {
    return read_file(file, 1 << 16);
  } catch (const InputError&) {
    return "";
  }
}

// False, too, where that is not to be known from here.
bool has_ended(const Owner& owner) {
  if (owner.place != place_of_processes() || owner.pid <= 0) return false;
  return limber::has_ended(owner.pid) || (owner.began != 0 && start_of_process(owner.pid) != owner.began);
}

// Nobody where it is damaged.
Owner owner_in(const std::string& text) {
  return fields_or_nothing<Owner>(Json::parse(text, nullptr, false)).value_or(Owner{});
}

}  // namespace

std::string this_worker() {
  char host[256] = "";
  ::gethostname(host, sizeof host - 1);
  const auto environment = [](const char* name) {
    const char* const value = std::getenv(name);
    return std::string(value ? value : "");
  };
  const std::string node = environment("SLURMD_NODENAME"), array = environment("SLURM_ARRAY_JOB_ID"),
                    job = environment("SLURM_JOB_ID");
  std::string name = node.empty() ? host : node;
  if (!array.empty())
    name += fmt::format(", job {}_{}", array, environment("SLURM_ARRAY_TASK_ID"));
  else if (!job.empty())
    name += ", job " + job;
  return name;
}

Lease::Lease(fs::path folder, std::string unit, int taken, std::string owner)
    : folder_(std::move(folder)),
      file_(folder_ / fmt::format("{}.{}", unit, taken)),
      unit_(std::move(unit)),
      owner_(std::move(owner)),
      taken_(taken) {
  write_beat();
  heart_ = std::thread([this] {
    std::unique_lock lock(mutex_);
    while (
        !ends_.wait_for(lock, std::chrono::duration<double>(Leases::between_beats_s), [&] { return ended_; }))
      write_beat();
  });
}

// Opened and closed each time, so that other machines see it (NFS). One that is not there any more was taken
// for lost.
void Lease::write_beat() {
  const Owner owner{owner_, place_of_processes(), ::getpid(), start_of_process(::getpid()),
                    fmt::format("{:>9}", beat_++)};
  const std::string text = text_of(json_of_fields(owner)) + "\n";
  const int fd = ::open(file_.c_str(), O_WRONLY | O_CLOEXEC);
  if (fd < 0) return;
  if (::pwrite(fd, text.data(), text.size(), 0) < 0) {
  }
  ::close(fd);
}

Lease::~Lease() {
  {
    const std::lock_guard lock(mutex_);
    ended_ = true;
  }
  ends_.notify_one();
  heart_.join();
  for (int taken = 1; taken <= taken_; ++taken) {  // its own last: until then nobody takes the unit
    std::error_code none;
    fs::remove(folder_ / fmt::format("{}.{}", unit_, taken), none);
  }
}

Leases::Leases(fs::path folder, double patience_s) : folder_(std::move(folder)), patience_s_(patience_s) {}

std::map<std::string, Leases::Seen> Leases::look() {
  std::map<std::string, Seen> seen;
  std::error_code none;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder_, none))
    if (const auto parts = parts_of(entry.path().filename().string()))
      seen[parts->unit].taken = std::max(seen[parts->unit].taken, parts->taken);
  std::map<fs::path, Content> contents;
  const Clock::time_point looked = Clock::now();
  for (auto& [unit, lease] : seen) {
    const fs::path file = folder_ / fmt::format("{}.{}", unit, lease.taken);
    Content now{text_in(file), looked};
    const auto before = contents_.find(file);
    if (before != contents_.end() && before->second.text == now.text) now.since = before->second.since;
    const Owner owner = owner_in(now.text);
    lease.owner = owner.owner;
    const std::chrono::duration<double> unchanged = looked - now.since;
    lease.lost = has_ended(owner) || unchanged.count() > patience_s_;
    contents.emplace(file, std::move(now));
  }
  contents_ = std::move(contents);
  return seen;
}

std::map<std::string, Leases::Seen> Leases::look_once(const fs::path& folder) {
  std::map<std::string, Seen> seen = Leases(folder, 1e9).look();
  for (auto& [unit, lease] : seen) {
    std::error_code none;
    const auto written = fs::last_write_time(folder / fmt::format("{}.{}", unit, lease.taken), none);
    lease.lost |=
        !none && fs::file_time_type::clock::now() - written > std::chrono::duration<double>(usual_patience_s);
  }
  return seen;
}

std::unique_ptr<Lease> Leases::take(const std::string& unit, const Seen* lost) {
  const int taken = lost ? lost->taken + 1 : 1;
  const fs::path file = folder_ / fmt::format("{}.{}", unit, taken);
  const int fd = ::open(file.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0644);
  if (fd < 0 && errno == EEXIST) return nullptr;
  if (fd < 0) throw DiskError(fmt::format("{}: creating it failed: {}", file.string(), std::strerror(errno)));
  ::close(fd);
  return std::make_unique<Lease>(folder_, unit, taken, this_worker());
}

}  // namespace limber::detail
